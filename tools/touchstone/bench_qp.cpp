// touchstone bench qp: the time and error of the solvers against the number of rows.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>

#include "haptics/files/output_file.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/qp/random_contacts.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/csv.hpp"

namespace touchstone::app {
namespace {

constexpr int kRowCounts[] = {10, 30, 100, 200, 500, 1000, 2000, 4000};
constexpr int kPaperRows = 1024;  // the paper's form is not measured beyond
constexpr std::uint64_t kSeed = 1;
constexpr ContactKind kKinds[] = {ContactKind::Slide, ContactKind::Wedge, ContactKind::Pinch};

struct Way {
    const SolverInfo* solver;
    double tolerance;
    bool paper, warm;
};

/// Every solver of the table, the exact ones first: the program's exact solver also with a warm start, an approximate
/// one at several tolerances, with a warm start and in the paper's form.
std::vector<Way> waysToSolve(bool gpu) {
    std::vector<Way> ways;
    const std::vector<const SolverInfo*> solvers = benchSolvers(gpu);
    for (const SolverInfo* solver : solvers) {
        if (!solver->exact) continue;
        ways.push_back({solver, 0, false, false});
        if (solver->name == kExactSolver) ways.push_back({solver, 0, false, true});
    }
    for (const SolverInfo* solver : solvers) {
        if (solver->exact) continue;
        for (const auto& [tolerance, paper, warm] :
             {std::tuple{0.1, false, false}, std::tuple{0.01, false, false}, std::tuple{0.01, false, true},
              std::tuple{1e-4, false, false}, std::tuple{0.01, true, false}, std::tuple{1e-4, true, false}})
            ways.push_back({solver, tolerance, paper, warm});
    }
    return ways;
}

struct Measured {
    double medianUs, p99Us, iterations, medianError, worstError;
    int unsolved;
};

/// The wanted increment one tick later.
Vec6 movedOn(const Vec6& wanted, int i) {
    Vec6 step;
    step << 0.02, -0.01, 0.01, 2e-4, 1e-4, -2e-4;
    return i % 2 ? Vec6(wanted + step) : Vec6(wanted - step);
}

/// Each time is the minimum of several passes over all problems: disturbances only add time, and the branch predictor
/// cannot learn a problem from one call to the next. The rows are copied into place before every call, because in a
/// tick they have just been written.
Measured measure(const Way& way, const std::vector<Contacts>& problems, int passes) {
    const SolverInfo& info = *way.solver;
    const int m = problems.front().rows.size();
    const auto solver = info.make(m), exact = findSolver(kExactSolver)->make(m);
    const StageClock clock = stageClock();
    SolverSettings settings;
    settings.paperForm = way.paper;
    settings.tolerance = way.tolerance;
    settings.workLimit = way.paper ? 2'000'000'000 : 20'000'000;

    std::vector<double> times(problems.size(), 1e30), errors(problems.size());
    Measured result{};
    Contacts inPlace(m);
    for (int pass = 0; pass < passes; ++pass) {
        for (std::size_t i = 0; i < problems.size(); ++i) {
            inPlace = problems[i];
            solver->reset();
            if (way.warm) {
                solver->solve(inPlace.problem(), settings);
                inPlace.wanted = movedOn(inPlace.wanted, static_cast<int>(i));
            }
            const QpProblem problem = inPlace.problem();
            const std::uint64_t start = clock.now();
            const SolveResult solved = solver->solve(problem, settings);
            const std::uint64_t end = clock.now();
            times[i] = std::min(times[i], static_cast<double>(end - start) * clock.microseconds);
            if (pass > 0) continue;
            result.iterations += solved.iterations / static_cast<double>(problems.size());
            result.unsolved += solved.status != SolveStatus::Solved || solved.byProcessor;
            exact->reset();
            errors[i] = wrenchError(problem, solved.x, exact->solve(problem, {}).x).force_N;
        }
    }
    result.medianUs = *percentile(times, 50);
    result.p99Us = *percentile(times, 99);
    result.medianError = *percentile(errors, 50);
    result.worstError = *percentile(errors, 100);
    return result;
}

struct BenchQpCommand {
    std::filesystem::path csv;  ///< empty: none
    bool quick = false, gpu = false;
};

}  // namespace

std::span<const int> qpRowCounts() { return kRowCounts; }

std::vector<QpCost> measureQp(int rows, bool quick, bool gpu) {
    std::mt19937_64 random(kSeed);
    const int count = quick || rows > 1000 ? 30 : 300;
    std::vector<Contacts> problems;
    for (int i = 0; i < count; ++i)
        problems.push_back(randomContacts(random, kKinds[static_cast<std::size_t>(i) % std::size(kKinds)], rows));
    std::vector<QpCost> costs;
    for (const Way& way : waysToSolve(gpu)) {
        if (way.paper && rows > kPaperRows) continue;
        const Measured got = measure(way, problems, way.solver->name == kExactSolver ? 9 : 3);
        costs.push_back({{"rows", rows},
                         {"solver", way.solver->name},
                         {"form", way.paper ? "paper" : "default"},
                         {"tolerance", way.tolerance},
                         {"start", way.warm ? "warm" : "cold"},
                         {"median_us", got.medianUs},
                         {"p99_us", got.p99Us},
                         {"iterations", got.iterations},
                         {"median_error_N", got.medianError},
                         {"worst_error_N", got.worstError},
                         {"unsolved", got.unsolved}});
    }
    return costs;
}

namespace {

int benchQp(const BenchQpCommand& command) {
    std::vector<QpCost> table;
    benchSolvers(command.gpu);  // throws before anything is printed
    std::printf("%5s  %-16s %-7s %-9s %-5s %12s %12s %10s %14s %14s %9s\n", "rows", "solver", "form", "tolerance",
                "start", "median µs", "p99 µs", "iterations", "median err N", "worst err N", "unsolved");
    for (const int m : kRowCounts) {
        for (const QpCost& cost : measureQp(m, command.quick, command.gpu)) {
            const auto text = [&](const char* key) { return cost[key].get<std::string>(); };
            const auto number = [&](const char* key) { return cost[key].get<double>(); };
            std::printf("%5d  %-16s %-7s %-9g %-5s %11.2f %11.2f %10.1f %14.2g %14.2g %9d\n", m, text("solver").c_str(),
                        text("form").c_str(), number("tolerance"), text("start").c_str(), number("median_us"),
                        number("p99_us"), number("iterations"), number("median_error_N"), number("worst_error_N"),
                        cost["unsolved"].get<int>());
            std::fflush(stdout);
            table.push_back(cost);
        }
    }
    if (!command.csv.empty()) writeFile(command.csv, "the table", toCsv(table));
    return kOk;
}

}  // namespace

const CLI::App* addBenchQp(CLI::App& bench, Action& action) {
    const auto options = std::make_shared<BenchQpCommand>();
    CLI::App* qp = addCommand(bench, "qp", "Measure the solvers alone, on generated contacts of 10 to 4,000 rows",
                              "Example:\n  touchstone bench qp --csv qp.csv\n");
    qp->add_option("--csv", options->csv, "write the table to a CSV file");
    qp->add_flag("--quick", options->quick, "fewer problems");
    qp->add_flag("--gpu", options->gpu, kGpuHelp);
    qp->callback([options, &action] { action = [options] { return benchQp(*options); }; });
    return qp;
}

}  // namespace touchstone::app
