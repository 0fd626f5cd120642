#pragma once
// Friction in a tick. Internal to step().
#include "haptics/loop/tick_memory.hpp"

namespace touchstone {

/// Finds the forces on the state's rows by Coulomb's law. The slip of a contact counts since the tick began and not
/// since its last step, or from where the tool was when an answer was found only by counting from there.
/// Pre: until record() the motions are those of the tick's start, as everywhere in a tick.
class TickFriction final : RowContacts {
  public:
    explicit TickFriction(Tick& tick);

    /// Whether there is any in this tick.
    bool any() const { return any_; }
    /// The answer nearest to `wanted` on the state's rows, with damping of the tool, see Tick::problemOf(). Keeps the
    /// contacts that carry load.
    ContactForces::Result solve(const Vec6& wanted, double damping = 0);
    /// Whether the last solve without damping found no forces.
    bool failed() const { return failed_; }
    /// Whether the solves of this tick have taken so long that it must end.
    bool isSpent() const;
    /// After failed(): the force of the last tick holds the tool at `start`, inside the cones; that of the springs
    /// would not. Returns false if an obstacle that moved in this tick may have taken that place.
    bool hold(const Pose& start, Wrench& wrench);
    /// Writes slip, dissipation and force to the tick's record.
    void record() const;

  private:
    Place placeOf(std::uint64_t id) const noexcept override { return placeOf(id, restarted_); }
    Place placeOf(std::uint64_t id, bool restarted) const noexcept;

    Tick& tick_;
    TickState::Impl& state_;
    const Settings& settings_;
    bool any_, failed_ = false;
    int evaluations_ = 0;     ///< by the exact solver
    bool restarted_ = false;  ///< slip counts from restart_ and not since the tick began
    Pose restart_;
};

}  // namespace touchstone
