#include <catch2/catch.hpp>

#include "engine/edit/undo.hpp"

namespace touchstone::undo_tests {

TEST_CASE("undo: steps are settled states, and a new step discards the redo list", "[edit]") {
    engine::UndoStack<int> undo;
    undo.note(1, true);
    undo.note(1, true);
    CHECK_FALSE(undo.canUndo());
    undo.note(5, false);  // in the middle of a drag
    undo.note(2, true);
    undo.note(3, true);
    CHECK(undo.undo() == 2);
    CHECK(undo.undo() == 1);
    CHECK_FALSE(undo.undo());
    CHECK(undo.redo() == 2);
    undo.note(2, true);  // the caller set it: not a step
    CHECK(undo.canRedo());
    undo.note(7, true);
    CHECK_FALSE(undo.canRedo());
    CHECK(undo.undo() == 2);
    for (int i = 0; i < 1000; ++i) undo.note(10 + i, true);
    int steps = 0;
    while (undo.undo()) ++steps;
    CHECK(steps == int(engine::UndoStack<int>::kMaxStates) - 1);
}

}  // namespace touchstone::undo_tests
