#pragma once
// What measures, recordings and other threads have to do with a tick, beyond tick.hpp.
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "haptics/collision/pair_finder.hpp"
#include "haptics/loop/tick.hpp"
#include "haptics/qp/friction.hpp"
#include "haptics/qp/solver.hpp"
#include "haptics/threads/stage_clock.hpp"

namespace touchstone {

/// None of these changes what a tick does.
struct StepOptions {
    StageClock clock = {};  ///< for stage times
    /// The exact solver also runs on the rows of the last linearization, so that hover is known for any solver.
    bool audit = false;
    /// Pair entries from another thread, by obstacle, if any. The tick uses them if they are complete for what it asks.
    /// They save time and do not change the result.
    std::span<const PairEntries* const> entries = {};
};

TickRecord step(const World& world, const Settings& settings, const TickInput& input, TickState& state,
                const StepOptions& options) noexcept;

/// A complete tick, as it is recorded.
struct RecordedTick {
    TickInput input;
    Settings settings;
    std::optional<TickStart> start;  ///< set if the state began right before this tick
    TickRecord record;
    std::uint64_t session = 0;  ///< the session's number, which identifies the world
    std::uint64_t starts = 0;   ///< number of starts of a state up to this tick; counted by the loop
};
/// The last tick of the state, whose result was `record`.
RecordedTick recordedTick(const TickState& state, const TickRecord& record, std::uint64_t session = 0);
/// Poses of the obstacles at the last TickState::begin().
std::span<const Pose> obstaclesAtStart(const TickState& state) noexcept;

/// FNV-1a over the bit-reproducible fields: tick, both poses, wrench_C, flags and status. Chain by passing the last
/// hash.
std::uint64_t hashTick(const TickRecord& record, std::uint64_t previous = 0xcbf29ce484222325ull);

/// The pairs that the last step() asked its lists for; a negative margin: none.
const Within& askedPairs(const TickState& state) noexcept;
/// The contacts that carried force in the last tick, in order of their id; empty if there was no friction.
std::span<const ContactForce> frictionContacts(const TickState& state) noexcept;
/// What the searches of the last tick took.
const SearchBudget& searches(const TickState& state) noexcept;
/// The solver that moves the tool if the settings name it. A caller may replace it by one that observes it.
std::unique_ptr<Solver>& renderer(TickState& state, std::string_view solver);
/// Likewise with friction.
std::unique_ptr<FrictionSolver>& frictionRenderer(TickState& state, std::string_view solver);

/// Whether parts rub on each other with these settings: default mode, and friction of any pair.
bool hasFriction(const World& world, const Settings& settings);

}  // namespace touchstone
