#include "haptics/loop/work_limits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <type_traits>
#include <utility>

#include "haptics/qp/solver.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone {
namespace {

/// The smallest time of a few runs, since disturbances only add to a run.
double nanosecondsPerRowIteration(int rows) {
    constexpr int kRuns = 5, kIterations = 500;
    // The problem is a tool of 50 mm that is pressed into planes with unit normals, spread over a half-space by the
    // golden angle.
    RowSet set(rows);
    for (int i = 0; i < rows; ++i) {
        const double z = 1 - (i + 0.5) / rows, radius = std::sqrt(1 - z * z), angle = 2.399963229728653 * i;
        const Vec3 n(radius * std::cos(angle), radius * std::sin(angle), z);
        const Vec3 lever = -50 * Vec3(n.z(), n.x(), n.y());
        Vec6 row;
        row << n, lever.cross(n);
        set.push(row, 0.1 * i / rows, static_cast<std::uint64_t>(i));
    }
    QpProblem problem;
    problem.stiffness << 1, 1, 1, 1000, 1000, 1000;
    problem.wanted << 0.3, -0.2, -5, 0.02, 0.05, -0.01;
    problem.rows = &set;

    // The tolerance is never reached, so that the solver makes all iterations.
    const SolverSettings settings{.tolerance = 1e-300, .maxIterations = kIterations};
    const std::unique_ptr<Solver> solver = findSolver("pqp")->make(rows);
    double least = 1e30;
    for (int run = 0; run < kRuns; ++run) {
        solver->reset();
        const double start = threadCpuMicroseconds();
        const SolveResult result = solver->solve(problem, settings);
        const double spent = threadCpuMicroseconds() - start;
        least = std::min(least, 1e3 * spent / (static_cast<double>(rows) * std::max(result.iterations, 1)));
    }
    return least;
}

/// A sentence if a solver on another device does not fit a share of the tick; then the processor's takes its place.
std::string keepInTick(std::string_view& solver, double rate, double share) {
    if (solver == kNoSolver) return {};
    const SolverInfo& info = *findSolver(solver);
    if (!info.roundTrip) return {};
    const RoundTrip& trip = info.roundTrip();
    const double needed = trip.us + kLeastUpdates * trip.updateUs, available = share * 1e6 / rate;
    if (trip.trouble.empty() && needed <= available) return {};
    solver = "pqp";
    const std::string instead = std::string(info.name) + " is not used here, and pqp solves on the processor: ";
    if (!trip.trouble.empty()) return instead + trip.trouble;
    std::array<char, 200> why{};
    std::snprintf(why.data(), why.size(),
                  "its round trip with %d updates takes %.0f µs, and a tick at %.0f Hz has %.0f µs for it",
                  kLeastUpdates, needed, rate, available);
    return instead + why.data();
}

}  // namespace

std::vector<std::string> keepRoundTripsInTick(Settings& settings, const WorkShares& shares) {
    std::vector<std::string> sentences{keepInTick(settings.solver, settings.rate, shares.solver),
                                       keepInTick(settings.shadow, settings.rate, shares.shadow)};
    std::erase(sentences, "");
    return sentences;
}

double calibrateWork() { return std::max(nanosecondsPerRowIteration(kFewRows), nanosecondsPerRowIteration(300)); }

Settings limitWork(Settings settings, double nanosecondsPerRowIteration, const WorkShares& shares) {
    const double available = 1e9 / settings.rate / nanosecondsPerRowIteration;  // rows x iterations in a period
    const auto lower = [&](auto& count, double limit) {
        using Count = std::remove_reference_t<decltype(count)>;
        if (limit < static_cast<double>(count)) count = std::max(Count{1}, static_cast<Count>(limit));
    };
    lower(settings.solverWork, shares.solver * available);
    lower(settings.shadowWork, shares.shadow * available);
    lower(settings.iterationCap, std::min(shares.solver, shares.shadow) * available / kFewRows);
    for (const auto& [name, share] :
         {std::pair{settings.solver, shares.solver}, std::pair{settings.shadow, shares.shadow}}) {
        const SolverInfo* solver = findSolver(name);
        if (!solver || !solver->roundTrip) continue;
        const RoundTrip& trip = solver->roundTrip();
        const double us = share * 1e6 / settings.rate;
        settings.solverWait = std::min(settings.solverWait, us);
        lower(settings.iterationCap, (us - trip.us) / trip.updateUs);
    }
    return settings;
}

}  // namespace touchstone
