// How a tick solves its problems, and compares solvers on them.
#include <algorithm>

#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/tick_memory.hpp"

namespace touchstone {

Vec6 Tick::stiffness() const {
    Vec6 G;
    G << Vec3::Constant(settings.stiffness), Vec3::Constant(settings.torsion);
    return G;
}

Wrench Tick::coupling(const Vec6& deviation) {
    loaded = !deviation.isZero(0);
    return {settings.stiffness * deviation.head<3>(), settings.torsion * deviation.tail<3>()};
}

void Tick::note(const SolveResult& result) {
    record.iterations += result.iterations;
    record.status = std::max(record.status, result.status);
    if (result.status == SolveStatus::Elastic) record.flags |= kInfeasible;
    if (result.status == SolveStatus::IterationLimit) record.flags |= kIterationLimit;
    if (result.status == SolveStatus::Invalid) record.flags |= kNonFinite;
    if (result.byProcessor) record.flags |= kByProcessor;
    record.kkt.primal_mm = std::max(record.kkt.primal_mm, result.kkt.primal_mm);
    record.kkt.dual_N = std::max(record.kkt.dual_N, result.kkt.dual_N);
    record.kkt.stationarity_N = std::max(record.kkt.stationarity_N, result.kkt.stationarity_N);
    record.kkt.complementarity_mJ = std::max(record.kkt.complementarity_mJ, result.kkt.complementarity_mJ);
}

QpProblem Tick::problemOf(const Vec6& target, double damping) const {
    if (damping == 0) return {stiffness(), target, &state.rows};
    // Damping is a spring to where the tool is, and two springs pull as one to a place between theirs.
    const Vec6 G = stiffness() + damping * state.metric();
    return {G, stiffness().cwiseProduct(target).cwiseQuotient(G), &state.rows};
}

Tick::Solved Tick::solve(const Vec6& target, double trust, double damping) {
    const QpProblem problem = problemOf(target, damping);
    const SolverSettings limits = solverSettings(settings);
    const bool exact = findSolver(settings.solver)->exact;

    const std::uint64_t start = now();
    const QpProblem given{problem.stiffness, problem.wanted,
                          exact ? problem.rows : &screened(state.screen, state.rows)};
    SolveResult result = named(state.renderers, settings.solver)->solve(given, limits);
    if (!exact) {
        if (kktResiduals(problem, problem.wanted, {}).primal_mm == 0)
            result.x = problem.wanted;  // `wanted` violates no row
        if (given.rows->size() < problem.rows->size()) {
            result.kkt.primal_mm = kktResiduals(problem, result.x, {}).primal_mm;
            record.screenInexact += !RowScreen::isExact(settings.screening, result.x, state.reach, trust);
        }
    }
    note(result);
    addTime(record.solveUs, start);
    Solved solved{result.x, result.x, result.status, result.slack, given.rows->size()};
    if (result.status == SolveStatus::Invalid) return solved;
    if (exact) {
        state.rememberContacts(state.rows, result);
    } else {
        if (audit) state.rememberContacts(state.rows, state.reference->solve(problem, limits));
        if (result.kkt.primal_mm > kViolation) {
            const SolveResult onto = project(result.x);
            solved.x = onto.x;
            solved.status = onto.status;
            solved.slack = onto.slack;
        }
    }
    return solved;
}

SolveResult Tick::project(const Vec6& x) {
    const std::uint64_t start = now();
    const SolveResult onto = state.projector->solve({stiffness(), x, &state.rows}, solverSettings(settings));
    addTime(record.solveUs, start);
    if (onto.status == SolveStatus::Invalid) return onto;
    if (onto.status == SolveStatus::Elastic) record.flags |= kInfeasible;
    record.projection = std::max(record.projection, state.lengthOf(onto.x - x));
    record.flags |= kProjected;
    return onto;
}

void Tick::runShadow(const QpProblem& problem, const Vec6& rendered) {
    const std::uint64_t start = now();
    const bool paper = settings.mode == Mode::Paper;
    QpProblem shared = problem;
    if (!findSolver(settings.shadow)->exact) shared.rows = &screened(state.shadowScreen, *problem.rows);
    const int maxRows = std::min(settings.shadowRows, paper ? kPaperRowCapacity : kShadowRowCapacity);
    record.shadowRowsCut = std::max(0, problem.rows->size() - std::min(maxRows, shared.rows->size()));
    if (shared.rows->size() > maxRows) {
        // Keep the rows with the smallest gaps, ties by identity, in their order.
        const RowSet& rows = *shared.rows;
        const auto first = state.shadowOrder.begin(), middle = first + maxRows, last = first + rows.size();
        for (int i = 0; i < rows.size(); ++i) state.shadowOrder[i] = i;
        std::nth_element(first, middle, last, [&](int a, int b) {
            return rows.gap()[a] != rows.gap()[b] ? rows.gap()[a] < rows.gap()[b] : rows.id(a) < rows.id(b);
        });
        std::sort(first, middle);
        state.shadowRows.clear();
        for (auto i = first; i != middle; ++i) state.shadowRows.push(rows.row(*i), rows.gap()[*i], rows.id(*i));
        shared.rows = &state.shadowRows;
    }
    record.shadowRows = shared.rows->size();

    SolverSettings s = solverSettings(settings);
    s.workLimit = settings.shadowWork;
    if (!s.paperForm) s.maxIterations = settings.iterationCap;
    const SolveResult shadow = named(state.shadows, settings.shadow)->solve(shared, s);
    record.shadowIterations = shadow.iterations;
    record.shadowStatus = shadow.byProcessor ? SolveStatus::Invalid : shadow.status;
    addTime(record.shadowUs, start);

    // The error is measured against the exact answer to the same rows. If the shadow itself is exact, the difference is
    // the rendering solver's error.
    const bool renderedIsExact = findSolver(settings.solver)->exact;
    Vec6 exact = rendered;
    if (record.shadowRowsCut || !(renderedIsExact || findSolver(settings.shadow)->exact))
        exact = state.reference->solve(shared, s).x;
    const WrenchError error = wrenchError(shared, shadow.x, exact);
    record.shadowForceError = error.force_N;
    record.shadowTorqueError = error.torque_mNm;
}

void Tick::runFrictionShadow(const FrictionProblem& problem, const Vec6& rendered, bool exact) {
    const std::uint64_t start = now();
    FrictionSolver& solver = *named(state.frictionShadows, settings.frictionShadow);
    solver.limitWork(settings.shadowWork);
    const FrictionResult shadow = solver.solve(problem, Vec6::Zero());
    record.shadowRows = int(problem.contacts.size());
    record.shadowIterations = shadow.iterations;
    record.shadowStatus = shadow.status == FrictionStatus::None ? SolveStatus::Invalid : SolveStatus::Solved;
    addTime(record.shadowUs, start);
    if (record.shadowStatus == SolveStatus::Invalid) return;

    // As for the shadow without friction.
    Vec6 truth = rendered;
    if (!exact && !findFrictionSolver(settings.frictionShadow)->exact)
        truth = state.frictionReference->solve(problem, rendered).x;
    const WrenchError error = wrenchError({problem.stiffness, problem.wanted, nullptr}, shadow.x, truth);
    record.shadowForceError = error.force_N;
    record.shadowTorqueError = error.torque_mNm;
}

}  // namespace touchstone
