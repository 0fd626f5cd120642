#pragma once
// Undo and redo over whole states: whoever changed what need not know of it.
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace touchstone::engine {

/// Keeps the states in which the user came to rest. State: a value with ==.
template <class State>
class UndoStack {
  public:
    static constexpr std::size_t kMost = 200;

    /// To be told the present state often, e.g. each frame; `settled`: no drag is going on. A settled state that
    /// differs from the last one is a step that can be undone.
    void note(const State& now, bool settled) {
        if (!settled || (!states_.empty() && states_[at_] == now)) return;
        if (!states_.empty()) states_.resize(++at_);  // what was undone is gone
        states_.push_back(now);
        if (states_.size() > kMost) {
            states_.erase(states_.begin());
            --at_;
        }
    }
    bool canUndo() const { return at_ > 0; }
    bool canRedo() const { return at_ + 1 < states_.size(); }
    /// The state to go back to; the caller puts it in place.
    std::optional<State> undo() { return canUndo() ? std::optional(states_[--at_]) : std::nullopt; }
    std::optional<State> redo() { return canRedo() ? std::optional(states_[++at_]) : std::nullopt; }
    void clear() {
        states_.clear();
        at_ = 0;
    }

  private:
    std::vector<State> states_;
    std::size_t at_ = 0;  ///< the present one
};

}  // namespace touchstone::engine
