#pragma once
// The haptic tick: device pose in, tool pose and wrench out.
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "haptics/collision/pair_finder.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/threads/stage_clock.hpp"

namespace touchstone {

/// Why a tick is not an ordinary one. Bits of TickRecord::flags; more than one may be set.
enum TickFlag : std::uint32_t {
    kInfeasible = 1 << 0,      ///< rows contradicted each other; the softened answer was used
    kNotDeeper = 1 << 1,       ///< ... and was replaced by the one that deepens no overlap
    kIterationLimit = 1 << 2,  ///< the solver's work limit came first
    kNonFinite = 1 << 3,       ///< the answer was not finite: tool held, force zero
    kRowsTruncated = 1 << 4,   ///< more pairs than rows
    kListOverflow = 1 << 5,    ///< more list entries than memory: tool held, force zero
    kCapped = 1 << 6,          ///< trust or travel budget shortened a move
    kHalved = 1 << 7,          ///< the re-measurement shortened a move
    kUnfinished = 1 << 8,      ///< the tool has not reached where it would go; made up in the next tick
    kBadInput = 1 << 9,        ///< the tick was given an invalid pose (Pose::isValid): tool held, force zero
    kProjected = 1 << 10,      ///< an approximate answer was moved onto the rows
    kPaused = 1 << 11,
    kObstacleHeld = 1 << 12,  ///< an obstacle was on its way, and the tool could not give way: it stayed
};

struct StepInput {
    Pose X_WT_device;  ///< tool node where the device wants it, scene frame
    /// Pair entries found elsewhere, by obstacle, if any; used where they are complete for what the tick asks. They
    /// save time and change no result.
    std::span<const PairEntries* const> entries = {};
    /// Where obstacles are to go, X_WO by obstacle; none: they stay where they are.
    std::span<const Pose> X_WO = {};
};

/// All that a StepState knows when it begins. Where a pose is invalid (Pose::isValid), every tick is held until the
/// state begins with better ones.
struct StepStart {
    std::uint64_t tick = 0;     ///< number of the next tick
    Pose X_WT;                  ///< tool node where the graphic tool is
    Pose X_WT_device;           ///< tool node where the device wanted it last
    bool loadedBefore = false;  ///< the tick before carried force
};

/// What a tick was given. With the world and the ticks since the last `start`, all that its result depends on.
struct TickInput {
    Pose X_WT_device;  ///< as StepInput's, before anything was made of it
    Settings settings;
    std::optional<StepStart> start;  ///< the state began anew, right before this tick
    int obstacle = -1;               ///< whose turn it was to move; -1: none was on its way
    Pose X_WO = {};                  ///< where that one was to go
};

/// What a tick did. A plain struct that is copied through rings and written to files; every field is finite.
struct TickRecord {
    std::uint64_t tick = 0;
    Pose X_WT_device;   ///< tool node where the device wants it
    Pose X_WT;          ///< tool node where it is (the graphic tool)
    Wrench wrench_C;    ///< on the hand, about C of the device pose (the report's)
    Wrench wrench_o;    ///< the same about the tool node's origin (the device's)
    Wrench wrench_out;  ///< what the safety stage let through, about o
    std::uint32_t flags = 0;
    std::uint32_t trips = 0;  ///< guards of the safety stage that acted, a bit each in the order of Trip
    SolveStatus status = SolveStatus::Solved;

    int pairs = 0, rows = 0;  ///< of the accepted solve of the tick's largest linearisation
    int rowsTruncated = 0;
    int rowsScreened = 0;   ///< what screening left of `rows` for an approximate solver; `rows` without it
    int screenInexact = 0;  ///< linearisations whose answer left the ball in which screening is exact
    int iterations = 0;     ///< sum over the tick
    int linearisations = 0;
    double marginUsed = 0;   ///< mm
    double projection = 0;   ///< greatest correction of an approximate answer, mm
    double hover = 0;        ///< greatest true gap over loaded contacts after the move, mm
    double penetration = 0;  ///< deepest overlap of the listed pairs after the move, mm
    KktResiduals kkt;        ///< worst over the tick's linearisations

    int shadowRows = 0, shadowRowsCut = 0, shadowIterations = 0;  ///< cut: by screening or to shadow_rows
    SolveStatus shadowStatus = SolveStatus::Solved;
    double shadowForceError = 0, shadowTorqueError = 0;  ///< N, mN·m, against the exact answer on the same rows

    double collisionUs = 0, solveUs = 0, shadowUs = 0, totalUs = 0;  ///< not part of the hash; the caller sets totalUs
    double helperUs = 0;         ///< of the thread beside the ticks, set by the caller
    double periodUs = 0;         ///< by the clock, since the tick before began; set by the loop, 0 without one
    std::uint64_t overruns = 0;  ///< deadlines missed by the ticks before this one; set by the loop
};

/// A tick whole, as it is recorded.
struct RecordedTick {
    TickInput input;
    TickRecord record;
    std::uint64_t session = 0;  ///< the holder's; tells the world
    std::uint64_t starts = 0;   ///< of the holder's states so far; counted by the loop
};

/// FNV-1a over what repeats: tick, both poses, wrench_C, flags and status. Chain by passing the last hash.
std::uint64_t hashTick(const TickRecord& record, std::uint64_t previous = 0xcbf29ce484222325ull);

/// All memory of the tick and what it remembers from the last: graphic tool, neighbor lists, warm starts. One thread
/// at a time. Build it off the loop; it allocates and touches everything in the constructor.
class StepState {
  public:
    explicit StepState(const World& world);
    ~StepState();
    StepState(StepState&&) noexcept;
    StepState& operator=(StepState&&) noexcept;

    /// Forgets everything but for where the obstacles are: what follows depends on that, `start` and what step() is
    /// given. X_WO: the obstacles are there, as far as it tells.
    void begin(const StepStart& start, std::span<const Pose> X_WO = {}) noexcept;
    /// Begins with graphic tool and device at X_WT.
    void reset(const Pose& X_WT) noexcept { begin({.X_WT = X_WT, .X_WT_device = X_WT}); }

    /// Puts both where a tick left them, as far as its record tells: the next tick answers as it would have, to
    /// rounding.
    void resume(const TickRecord& record) noexcept;

    /// Where the obstacles are, X_WO by obstacle: at first where the world has them.
    std::span<const Pose> obstacles() const noexcept;
    /// Which pairs the last step() asked for; negative margin: none.
    const Within& asked() const noexcept;
    /// Where the obstacles were when it last began.
    std::span<const Pose> obstaclesAtStart() const noexcept;
    /// What the last step() was given.
    const TickInput& input() const;

    /// The solver that moves the tool, by index into solverTable(), for who wants to put one in between that watches.
    std::unique_ptr<Solver>& renderer(int solver);

    struct Impl;
    std::unique_ptr<Impl> impl;
};

/// One tick. Pre: `state` was made for `world`. Pure: the result depends on the arguments alone; no lock, log, I/O,
/// allocation, throw or clock. A failure is a flag in the record, the tool held where it was and zero force.
/// With `audit` the exact solver also runs on the last linearisation's rows so that hover is known for any solver.
/// Obstacles on their way take turns: one moves in a tick, by at most min(trust / 2, 0.25 mm/ms), and pushes the tool.
/// In default mode it is taken back, and the tick repeated without it, where a pair would end in a gap below
/// min(its gap before, -0.5 µm); it then tries shorter moves. An invalid pose (Pose::isValid), of the device or of
/// where an obstacle is to go, is kBadInput: nothing moves in that tick.
TickRecord step(const World& world, const Settings& settings, const StepInput& input, StepState& state,
                const StageClock& clock = {}, bool audit = false) noexcept;

/// True least gap of tool and obstacles at X_WT, mm, negative when they overlap, by branch and bound over the trees; at
/// most `atMost`. Not the tick's own measurement: reports and tests judge the tick by it. X_WO: where the obstacles
/// are, if not where the world has them.
double trueClearance(const World& world, const Pose& X_WT, double atMost = 1e30, std::span<const Pose> X_WO = {});

/// The deepest overlap alone, for who asks at every tick: max(0, -trueClearance), the same to the last bit, in a
/// fraction of the time where surfaces conform. By a walk of its own, not from the tick's lists. Allocates in the
/// constructor only.
class PenetrationMeter {
  public:
    explicit PenetrationMeter(const World& world);
    double depth(const Pose& X_WT, std::span<const Pose> X_WO = {});  ///< mm

  private:
    const World* world_;
    std::vector<TreeWalk> walks_;
    double depth_ = 0;  ///< at the last pose
};

}  // namespace touchstone
