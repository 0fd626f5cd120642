#pragma once
// Memory of the tick, shared by the modes. Internal to step().
#include <array>
#include <vector>

#include "haptics/collision/clearance.hpp"
#include "haptics/collision/neighbor_list.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/math/tick_tuning.hpp"
#include "haptics/qp/contact_forces.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/qp/row_screen.hpp"
#include "haptics/surface/feature_list.hpp"
#include "haptics/surface/surface_overlap.hpp"

namespace touchstone {

/// q or -q, which are the same rotation: the one nearer to `like`.
inline Quat withSignOf(const Quat& like, const Quat& q) { return q.dot(like) < 0 ? Quat(-q.coeffs()) : q; }

/// One of the solvers that were made for each row of a table, in its order. Pre: the name is in the table.
inline std::unique_ptr<Solver>& named(std::vector<std::unique_ptr<Solver>>& solvers, std::string_view name) {
    return solvers[findSolver(name) - solverTable().data()];
}
inline std::unique_ptr<FrictionSolver>& named(std::vector<std::unique_ptr<FrictionSolver>>& solvers,
                                              std::string_view name) {
    return solvers[findFrictionSolver(name) - frictionSolverTable().data()];
}

/// Poses of the tick are those of C: p is C in the world, q the tool's rotation.
struct TickState::Impl {
    explicit Impl(const World& world);

    // Constant for the world.
    const World* world;
    Vec3 p_TC;
    double reach;                         ///< ρ, mm
    std::vector<double> obstacleReaches;  ///< of the obstacles, as World::reach() of the tool

    // Where the obstacles are.
    std::vector<Pose> X_WO, X_OW;
    std::vector<Pose> X_WO_start;  ///< at the last begin()
    std::vector<Mat3> R_WO;
    std::vector<double> paces;        ///< by obstacle: the fraction of the maximum move that it tries next
    bool hasInvalidObstacle = false;  ///< an obstacle was given an invalid pose
    bool hasValidStart = true;        ///< begin() was given valid poses, and no obstacle has an invalid one
    int lastMoved = 0;                ///< the obstacle that moved last, since obstacles take turns
    double obstacleTravel = 0;        ///< in this tick, mm
    int pushing = -1;                 ///< the obstacle that has moved in this tick, and not yet the tool; -1: none
    Pose X_OW_before;                 ///< where that obstacle was
    bool begun = false;               ///< it is known what the tool touches or overlaps at its start, see noteStart()

    // Working memory. Every buffer has one use.
    std::vector<std::unique_ptr<ContactList>> leafLists, featureLists;  ///< by obstacle; null: no spheres, no meshes
    std::vector<ContactList*> lists;                                    ///< those that the tick uses
    /// The budget of their searches, held by a pointer since they point to it.
    std::unique_ptr<SearchBudget> searches;
    std::vector<TreeWalk> walks;            ///< for the modes that keep no list; empty if a part has no spheres
    RowSet rows{kRowCapacity};              ///< of the present linearization
    RowSet crossedRows{kRowCapacity};       ///< rows that an answer crosses, before they join `rows`
    RowSet heldRows{kHeldRows};             ///< on which steps of this tick ended, seen from the present pose
    RowSet lastRows{kHeldRows};             ///< on which the last step ended, likewise
    RowSet shadowRows{kShadowRowCapacity};  ///< the rows with the smallest gaps, for the shadow
    AlignedVector<int> shadowOrder;         ///< indices that select them
    RowScreen screen{kRowCapacity};         ///< of the rendering solver
    RowScreen shadowScreen{kRowCapacity};   ///< of the shadow
    std::vector<std::unique_ptr<Solver>> renderers;                  ///< one for each row of solverTable()
    std::vector<std::unique_ptr<Solver>> shadows;                    ///< likewise
    std::unique_ptr<Solver> projector;                               ///< exact: projects approximate answers
    std::unique_ptr<Solver> reference;                               ///< exact: for audits and the shadow's error
    std::vector<std::unique_ptr<FrictionSolver>> frictionRenderers;  ///< likewise of frictionSolverTable()
    std::vector<std::unique_ptr<FrictionSolver>> frictionShadows;    ///< likewise
    std::unique_ptr<FrictionSolver> frictionReference;               ///< exact: for the shadow's error
    struct DeepPair {
        double gap;
        std::uint64_t id;
    };
    std::vector<DeepPair> deepest;  ///< the pairs that paper mode keeps
    struct Contact {
        std::uint64_t id;
        double force;  ///< N
    };
    std::vector<Contact> contacts;  ///< the contacts that carry load in the tick's last exact solve

    TickInput given;                      ///< the input of the last tick
    Settings settings;                    ///< likewise
    std::optional<TickStart> startGiven;  ///< likewise, if the state began right before it
    std::optional<TickStart> start;       ///< set by begin() until the next tick reports it

    // Remembered from tick to tick.
    std::uint64_t tick = 0;
    Pose graphic, device;
    Wrench wrench;         ///< of the last tick, about C
    ContactForces forces;  ///< with friction
    bool loaded = false;   ///< the last tick put force on the hand (Tick::loaded)
    std::vector<StraightMotion>
        motions;             ///< by obstacle: where the last tick left the graphic tool, and its motion to there
    TouchingPairs touching;  ///< that carried force in the last step
    Within asked;            ///< the pairs that this tick asked its lists for; a negative margin: none

    Pose referencePose(const Pose& X_WT) const { return {X_WT * p_TC, X_WT.q}; }
    Pose nodePose(const Pose& q) const { return {q.p - q.q * p_TC, q.q}; }
    Pose inObstacle(int obstacle, const Pose& q) const { return X_OW[obstacle] * nodePose(q); }
    /// The pose from which the next step moves features: in front of an obstacle that pushes, where it was before.
    Pose before(int obstacle, const Pose& q) const {
        return (obstacle == pushing ? X_OW_before : X_OW[obstacle]) * nodePose(q);
    }
    void place(int obstacle, const Pose& X);
    /// Selects the lists of a geometry.
    void use(Geometry geometry, double contactDistance);
    /// Begins inside the meshes that the tool touches or overlaps, see ContactList::beginInside().
    void noteStart();
    /// Ends that for meshes that are apart. Returns whether any still overlap by more than counts as touching.
    bool checkOverlaps();
    bool areApart(int obstacle) const;                ///< whether meshes are farther apart than a step may bring them
    bool isDeeper(int obstacle, double depth) const;  ///< whether they overlap by more than the depth, mm
    /// Moves an obstacle toward its target so that none of its leaves travels more than `maxTravel` mm.
    void moveObstacle(int obstacle, const Pose& target, double maxTravel);
    /// Upper bound on the travel of any tool leaf for the increment x, mm: |δp| + ρ|δθ|.
    double lengthOf(const Vec6& x) const { return x.head<3>().norm() + reach * x.tail<3>().norm(); }
    /// The diagonal metric in which a rotation counts as the travel that it makes at the reach: |δp|² + ρ²|δθ|².
    Vec6 metric() const { return (Vec6() << Vec3::Ones(), Vec3::Constant(reach * reach)).finished(); }

    /// Notes that the tick asked its lists for these pairs.
    void noteAsked(const Within& within) {
        if (asked.margin < 0) asked = within;
        asked = {std::max(asked.margin, within.margin), std::max(asked.curve, within.curve),
                 std::max(asked.most, within.most), std::max(asked.turn, within.turn)};
    }

    /// Keeps the contacts that carry load in this result.
    void rememberContacts(const RowSet& from, const SolveResult& result);
    /// Greatest true gap at `q` over contacts that carry more than max(0.02 N, 1 % of the largest force).
    double hoverAt(const Pose& q) const;
};

/// What one tick works with.
struct Tick {
    TickState::Impl& state;
    const Settings& settings;
    const StageClock& clock;
    bool audit;
    TickRecord& record;
    bool loaded = false;  ///< something holds the graphic tool away from the device, so the tick puts force on the hand

    std::uint64_t now() const { return clock.now ? clock.now() : 0; }
    void addTime(double& stage, std::uint64_t since) const { stage += double(now() - since) * clock.microseconds; }
    Vec6 stiffness() const;
    /// Wrench of the coupling (3) about C if the graphic tool is this increment away from the device; sets `loaded`.
    Wrench coupling(const Vec6& deviation);
    /// The rows that an approximate solver is given, after `screen` has removed redundant ones.
    const RowSet& screened(RowScreen& screen, const RowSet& rows) const {
        const bool off = settings.mode == Mode::Paper || rows.size() == 0;
        return screen.run(rows, off ? Screening::None : settings.screening, state.reach, settings.trust);
    }
    /// Adds status, iterations and residuals of a solve to the record.
    void note(const SolveResult& result);
    /// The problem of the increment nearest to `target` on the state's rows. damping: of the tool, N/mm in the
    /// metric().
    QpProblem problemOf(const Vec6& target, double damping = 0) const;
    struct Solved {
        Vec6 x, rendered;  ///< `rendered`: x before a projection
        SolveStatus status = SolveStatus::Invalid;
        double slack = 0;
        int rows = 0;  ///< after screening
    };
    /// Solves problemOf(target, damping) with the rendering solver, and keeps the contacts that carry load. An
    /// approximate answer is projected onto the rows. trust: of the step, mm, for the screening.
    Solved solve(const Vec6& target, double trust, double damping = 0);
    /// Moves an approximate answer onto the state's rows.
    SolveResult project(const Vec6& x);
    /// Runs the shadow on the problem; `rendered` is the rendering solver's answer to it.
    void runShadow(const QpProblem& problem, const Vec6& rendered);
    /// Likewise with friction. `exact`: whether `rendered` is the answer of an exact solver.
    void runFrictionShadow(const FrictionProblem& problem, const Vec6& rendered, bool exact);
};

/// The modes. Each moves `state.graphic` toward `device` and sets `wrench`. If it returns false, the tool is held and
/// there is no force.
bool defaultTick(Tick& tick, const Pose& device, Wrench& wrench);
bool paperTick(Tick& tick, const Pose& device, Wrench& wrench);
bool penaltyTick(Tick& tick, const Pose& device, Wrench& wrench);
bool godObjectTick(Tick& tick, const Pose& device, Wrench& wrench);

}  // namespace touchstone
