#pragma once
// Memory of the tick, shared by the modes. Internal to step().
#include <array>
#include <vector>

#include "haptics/collision/clearance.hpp"
#include "haptics/collision/neighbor_list.hpp"
#include "haptics/loop/step.hpp"

namespace touchstone {

inline constexpr int kRowCapacity = 1 << 15;
inline constexpr int kPaperRowCapacity = 1024;
inline constexpr int kShadowRowCapacity = 4096;
inline constexpr double kOverlapTolerance = 0.5e-3;  // mm: what a linearisation may enter

/// Poses of the tick are those of C: p is C in the world, q the tool's rotation.
struct StepState::Impl {
    explicit Impl(const World& world);

    // Constant for the world.
    const World* world;
    Vec3 p_TC;
    double reach;
    std::vector<double> reaches;  ///< of the obstacles, as World::reach()

    // Where the obstacles are.
    std::vector<Pose> X_WO, X_OW;
    std::vector<Pose> X_WO_start;  ///< when the state last began
    std::vector<Mat3> R_WO;
    std::vector<double> paces;  ///< share of the greatest move that an obstacle tries next
    bool misplaced = false;     ///< an obstacle is to be where no pose is
    bool sound = true;          ///< it began with poses that are valid, and no obstacle is misplaced
    int lastMoved = 0;          ///< obstacles take turns
    double obstacleTravel = 0;  ///< of this tick, mm

    // Working memory.
    std::vector<NeighborList> lists;
    std::vector<TreeWalk> walks;  ///< of the modes that keep no list
    RowSet rows{kRowCapacity};
    RowScreen screen{kRowCapacity};
    RowSet relaxed{kRowCapacity};                    ///< rows with violated gaps set to zero; the shadow's deepest rows
    std::vector<std::unique_ptr<Solver>> renderers;  ///< by index into solverTable()
    std::vector<std::unique_ptr<Solver>> shadows;
    std::unique_ptr<Solver> projector, reference;  ///< exact, with warm starts of their own
    struct DeepPair {
        double gap;
        std::uint64_t id;
    };
    std::vector<DeepPair> deepest;
    std::vector<int> order;
    struct Contact {
        std::uint64_t id;
        double force;  ///< N
    };
    std::vector<Contact> contacts;  ///< loaded contacts of the tick's last exact solve

    TickInput given;                 ///< to the last tick
    std::optional<StepStart> start;  ///< since then

    // Remembered from tick to tick.
    std::uint64_t tick = 0;
    Pose graphic, device;
    bool loaded = false;       ///< the last tick carried force
    std::vector<Course> ways;  ///< by obstacle: where a tick left the graphic tool, and its way there
    /// The solver's, of the last two ticks, by linearisation; the last for those after it.
    std::array<std::array<Vec6, 2>, 4> lastSteps;
    Within asked;  ///< of the lists, in this tick; margin negative: nothing

    Pose referencePose(const Pose& X_WT) const { return {X_WT * p_TC, X_WT.q}; }
    Pose nodePose(const Pose& q) const { return {q.p - q.q * p_TC, q.q}; }
    Pose inObstacle(int obstacle, const Pose& q) const { return X_OW[obstacle] * nodePose(q); }
    void place(int obstacle, const Pose& X);
    /// The first obstacle that is to go where no pose is; -1: none.
    int badTarget(std::span<const Pose> targets) const;
    /// The next obstacle that is not where it is to be; -1: none.
    int nextToMove(std::span<const Pose> targets) const;
    /// Moves it towards its target, no leaf of it by more than `most` mm.
    void moveObstacle(int obstacle, const Pose& target, double most);
    double lengthOf(const Vec6& x) const { return x.head<3>().norm() + reach * x.tail<3>().norm(); }

    void ask(const Within& within) {
        asked = {std::max(asked.margin, within.margin), std::max(asked.curve, within.curve),
                 std::max(asked.most, within.most)};
    }

    /// Keeps what `result` says of the loaded contacts.
    void rememberContacts(const RowSet& from, const SolveResult& result);
    /// Greatest true gap at `q` over contacts that carry more than max(0.02 N, 1 % of the largest).
    double hoverAt(const Pose& q) const;
};

/// What one tick works with.
struct Tick {
    StepState::Impl& state;
    const Settings& settings;
    const StageClock& clock;
    bool audit;
    TickRecord& record;

    std::uint64_t now() const { return clock.now ? clock.now() : 0; }
    void addTime(double& stage, std::uint64_t since) const { stage += double(now() - since) * clock.microseconds; }
    Vec6 stiffness() const;
    /// The problem's rows as an approximate solver takes them.
    const RowSet& screened(const RowSet& rows) const {
        const bool off = settings.mode == Mode::Paper || rows.size() == 0;
        return state.screen.run(rows, off ? Screening::None : settings.screening, state.reach, settings.trust);
    }
    /// Takes over status, iterations and residuals of a solve of this tick.
    void note(const SolveResult& result);
    /// Runs the shadow on the problem; `rendered` is the answer of the rendering solver to it.
    void runShadow(const QpProblem& problem, const Vec6& rendered);
};

/// Each moves `state.graphic` towards `device` and returns the wrench about C; false: hold the tool, no force.
bool defaultTick(Tick& tick, const Pose& device, Wrench& wrench);
bool paperTick(Tick& tick, const Pose& device, Wrench& wrench);
bool penaltyTick(Tick& tick, const Pose& device, Wrench& wrench);

}  // namespace touchstone
