#pragma once
// The haptic tick: from a device pose to a tool pose and a wrench.
#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "haptics/loop/settings.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/qp/solver_values.hpp"

namespace touchstone {

/// An obstacle on its way.
struct ObstacleMove {
    int obstacle = -1;  ///< the obstacle whose turn it is to move; -1: none moves
    Pose X_WO = {};     ///< its target pose
};

/// What goes into a tick. Together with the world, the settings and the ticks since the state began, it determines the
/// result.
struct TickInput {
    Pose X_WT_device;        ///< where the device wants the tool node, scene frame
    ObstacleMove move = {};  ///< see TickState::nextMove()
};

/// The pairs of features that carried force at the end of a tick. The next tick tries them first.
struct TouchingPairs {
    std::array<std::uint64_t, 6> ids{};  ///< contactId(); six carry a rigid body
    int count = 0;

    std::span<const std::uint64_t> span() const { return {ids.data(), std::size_t(count)}; }
    void clear() { count = 0; }
    /// Does nothing if there is no room.
    void push(std::uint64_t id) {
        if (count < int(ids.size())) ids[std::size_t(count++)] = id;
    }
};

/// Everything that a TickState knows when it begins. If a pose is invalid (Pose::isValid), every tick is held until the
/// state begins again with valid ones.
struct TickStart {
    std::uint64_t tick = 0;       ///< number of the next tick
    Pose X_WT;                    ///< pose of the tool node (the graphic tool)
    Pose X_WT_device;             ///< where the device last wanted the tool node
    bool loadedBefore = false;    ///< the last tick put force on the hand
    TouchingPairs touching = {};  ///< at the end of the last tick; those that the world does not have are left out
};

/// What was unusual about a tick. Bits of TickRecord::flags; more than one may be set.
enum TickFlag : std::uint32_t {
    kInfeasible = 1 << 0,      ///< the rows contradicted each other; the softened answer was used
    kNotDeeper = 1 << 1,       ///< ... and was replaced by the answer that deepens no overlap
    kIterationLimit = 1 << 2,  ///< the work limit ended a solve, or a friction baseline had no answer (ContactForces)
    kNonFinite = 1 << 3,       ///< the answer was not finite: tool held, zero force
    kRowsTruncated = 1 << 4,   ///< there were more pairs than rows
    kListOverflow = 1 << 5,    ///< there were more list entries than memory: tool held, zero force
    kCapped = 1 << 6,          ///< trust or the travel budget shortened a move
    kHalved = 1 << 7,          ///< a pair that got deeper shortened a move
    kUnfinished = 1 << 8,      ///< the tool did not reach its goal in this tick; the next tick continues
    /// The tick was given an invalid pose (Pose::isValid), a solver that no table has, or a mode whose spheres the
    /// world lacks: tool held, no force.
    kBadInput = 1 << 9,
    kProjected = 1 << 10,     ///< an approximate answer was projected onto the rows
    kPaused = 1 << 11,        ///< the setting `pause` held the tool
    kObstacleHeld = 1 << 12,  ///< a moving obstacle stayed where it was because the tool could not move out of its way
    kFrictionSoft = 1 << 14,  ///< friction was solved inside the cones, but contacts gave way by up to 0.3 µm
    kFrictionHeld = 1 << 15,  ///< no forces with friction were found: tool and force stay as the last tick left them
    kByProcessor = 1 << 16,   ///< the renderer's device was late or lost, so that the processor answered
    /// Meshes overlap, as at the start, by more than the distance that is kept: the tool passes through what it is in
    /// until it is out, and feels everything else.
    kOverlapping = 1 << 13,
};

/// The result of a tick. A plain struct that is copied through rings and written to files; every field is finite.
struct TickRecord {
    std::uint64_t tick = 0;
    Pose X_WT_device;   ///< where the device wants the tool node
    Pose X_WT;          ///< where the tool node is (the graphic tool)
    Wrench wrench_C;    ///< on the hand, about C of the device pose; reports use it
    Wrench wrench_o;    ///< the same about the tool node's origin; devices use it
    Wrench wrench_out;  ///< the wrench after the safety stage, about o
    std::uint32_t flags = 0;
    std::uint32_t trips = 0;  ///< guards of the safety stage that acted, one bit each, in the order of Trip
    SolveStatus status = SolveStatus::Solved;

    int pairs = 0, rows = 0;  ///< of the accepted solve of the tick's largest linearization
    int rowsTruncated = 0;
    int rowsScreened = 0;    ///< rows that remain after screening for an approximate solver; `rows` without screening
    int screenInexact = 0;   ///< linearizations whose answer lies outside the ball in which screening is exact
    int iterations = 0;      ///< sum over the tick
    int linearizations = 0;  ///< number of linearizations, flights included
    double marginUsed = 0;   ///< mm
    double projection = 0;   ///< greatest correction of an approximate answer, mm
    double hover = 0;        ///< greatest true gap over loaded contacts after the move, mm
    double penetration = 0;  ///< deepest overlap of the listed pairs after the move, mm
    KktResiduals kkt;        ///< worst over the tick's linearizations
    TouchingPairs touching;  ///< at the end of the tick, without friction and with an exact solver

    int sticking = 0, sliding = 0;  ///< loaded contacts with friction, at the tick's end
    double slip = 0;                ///< greatest of a loaded contact in this tick, mm
    double frictionForce = 0;       ///< size of the sum of all friction forces, N
    CoulombResiduals coulomb;       ///< worst over the tick's linearizations; all 0 without friction
    int frictionStage = 0;          ///< what the hardest solve took: 1 Newton's steps, 2 rounds, 3 a path; 0 without

    /// Rows, with friction contacts, that the shadow received; cut: removed by screening or by shadow_rows.
    int shadowRows = 0, shadowRowsCut = 0, shadowIterations = 0;
    SolveStatus shadowStatus = SolveStatus::Solved;      ///< with friction Invalid where it had no answer
    double shadowForceError = 0, shadowTorqueError = 0;  ///< N, mN·m, against the exact answer on the same rows

    double collisionUs = 0, solveUs = 0, shadowUs = 0, totalUs = 0;  ///< not part of the hash; the caller sets totalUs
    double listWorkerUs = 0;                                         ///< CPU time of the list worker; set by the caller
    double periodUs = 0;         ///< time since the previous tick began; set by the loop, 0 without a clock
    std::uint64_t overruns = 0;  ///< number of late ticks before this one; set by the loop
};

/// All memory of the tick, and what it remembers from the last tick: graphic tool, neighbor lists, warm starts. Only
/// one thread may use it at a time. Construct it off the loop: the constructor allocates and touches all memory.
class TickState {
  public:
    explicit TickState(const World& world);
    ~TickState();
    TickState(TickState&&) noexcept;
    TickState& operator=(TickState&&) noexcept;

    /// Forgets everything except where the obstacles are. All later ticks depend only on that, on `start` and on the
    /// inputs of step(). X_WO: new poses of the first obstacles, if any.
    void begin(const TickStart& start, std::span<const Pose> X_WO = {}) noexcept;
    /// Begins with graphic tool and device at X_WT.
    void reset(const Pose& X_WT) noexcept { begin({.X_WT = X_WT, .X_WT_device = X_WT}); }
    /// Begins with graphic tool and device where a tick left them, from its record. The next tick gives the same answer
    /// as without this call, up to rounding.
    void resume(const TickRecord& record) noexcept;

    /// Poses of the obstacles, X_WO by obstacle; at first those of the world.
    std::span<const Pose> obstacles() const noexcept;
    /// The move of the next tick on the way to these target poses, X_WO by obstacle: obstacles that are not there take
    /// turns. If a target is invalid (Pose::isValid) it is that one, and the tick then sets kBadInput.
    ObstacleMove nextMove(std::span<const Pose> X_WO) const noexcept;

    struct Impl;  ///< internal
    std::unique_ptr<Impl> impl;
};

/// One tick. Pre: `state` was made for `world`, and checkSettings() finds no error. Pure: the result depends only on
/// the arguments; no lock, log, I/O, allocation, throw or clock. If the tick fails, the record has a flag, the tool is
/// held and the force is zero. An obstacle moves by at most min(trust / 2, 0.25 mm/ms) and pushes the tool. In default
/// mode the move is undone and the tick repeated without it if a pair would end with a gap below min(its gap before,
/// -0.5 µm); the obstacle then tries shorter moves. An invalid pose (Pose::isValid) of the device or of the obstacle's
/// target, or the name of a solver that there is not, sets kBadInput, and nothing moves in that tick.
TickRecord step(const World& world, const Settings& settings, const TickInput& input, TickState& state) noexcept;

}  // namespace touchstone
