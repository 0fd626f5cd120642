#pragma once
// Undo and redo of whole states. Code that changes a state need not know about undo.
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

namespace touchstone::engine {

/// A list of settled states. State: a value type with ==.
template <class State>
class UndoStack {
  public:
    static constexpr std::size_t kMaxStates = 200;

    /// Call often with the current state, e.g. every frame; `settled`: no drag is in progress. A settled state that
    /// differs from the last one becomes an undo step.
    void note(const State& now, bool settled) {
        if (!settled || (!states_.empty() && states_[at_] == now)) return;
        if (!states_.empty()) states_.resize(++at_);  // discards the redo steps
        states_.push_back(now);
        if (states_.size() > kMaxStates) {
            states_.erase(states_.begin());
            --at_;
        }
    }
    bool canUndo() const { return at_ > 0; }
    bool canRedo() const { return at_ + 1 < states_.size(); }
    /// Returns the state to restore; the caller applies it.
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
