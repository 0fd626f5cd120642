// touchstone bench gpu: PQP on the graphics card beside the processor's, and the exact solver.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "haptics/files/output_file.hpp"
#include "haptics/qp/pqp_paper.hpp"
#include "haptics/qp/random_contacts.hpp"
#include "haptics/sandbox/gpu/gpu_pqp.hpp"
#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/csv.hpp"
#include "tools/touchstone/stopwatch.hpp"

namespace touchstone::app {
namespace {

constexpr int kUpdates = 50;  // of every problem, on both
constexpr int kRowsOnCard[] = {10, 100, 1000, 4000}, kBatches[] = {1, 10, 100, 1000};
constexpr double kMostPaperWork = 3e8;        // rows² times problems, above which the paper's form is left out
constexpr double kQuickWork = 1e4;            // rows times problems that --quick measures at most
constexpr std::size_t kProcessorSample = 60;  // problems that the processor solves for its rate

struct BenchGpuCommand {
    std::filesystem::path csv;  ///< empty: none
    bool quick = false;
};

/// Problems a second of a solver, on `threads` threads with their own memory.
double rateOf(const SolverInfo& info, std::span<const QpProblem> problems, const SolverSettings& settings,
              unsigned threads) {
    const auto work = [&](std::size_t from) {
        const auto solver = info.make(problems.front().rows->size());
        for (std::size_t i = from; i < problems.size(); i += threads) {
            solver->reset();
            solver->solve(problems[i], settings);
        }
    };
    double best = 0;
    for (int pass = 0; pass < 3; ++pass) {  // disturbances only add time
        const Stopwatch watch;
        std::vector<std::jthread> others;
        for (unsigned k = 1; k < threads; ++k) others.emplace_back(work, k);
        work(0);
        others.clear();
        best = std::max(best, static_cast<double>(problems.size()) / (threads == 1 ? watch.cpu() : watch.wall()));
    }
    return best;
}

QpCost measureGpu(sandbox::GpuPqp& gpu, const std::vector<Contacts>& contacts, bool paper) {
    std::vector<QpProblem> problems;
    for (const Contacts& c : contacts) problems.push_back(c.problem());
    SolverSettings settings;
    settings.paperForm = paper;
    settings.tolerance = 0;
    settings.maxIterations = kUpdates;
    settings.workLimit = std::int64_t(1) << 40;

    sandbox::GpuTimes best;
    for (int pass = 0; pass < 3; ++pass) {
        gpu.solve(problems, settings);
        if (pass == 0 || gpu.times().total() < best.total()) best = gpu.times();
    }
    const std::span sample(problems.data(), std::min(problems.size(), kProcessorSample));
    const SolverInfo &pqp = *std::find_if(solverTable().begin(), solverTable().end(),
                                          [](const SolverInfo&info) { return info.name == "pqp"; }),
                     &exact = solverTable()[kExactSolver];
    const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
    const double rate = 1e6 * static_cast<double>(problems.size()) / best.total(),
                 one = rateOf(pqp, sample, settings, 1), all = rateOf(pqp, sample, settings, cores);
    return {{"rows", contacts.front().rows.size()},
            {"problems", problems.size()},
            {"form", paper ? "paper" : "guarded"},
            {"updates", kUpdates},
            {"upload_us", best.upload},
            {"dispatch_us", best.dispatch},
            {"solve_us", best.solve},
            {"download_us", best.download},
            {"gpu_per_s", rate},
            {"one_core_per_s", one},
            {"all_cores_per_s", all},
            {"cores", cores},
            {"exact_per_s", rateOf(exact, sample, {}, 1)},
            {"times_one_core", rate / one},
            {"card", gpu.card()}};
}

int benchGpu(const BenchGpuCommand& command) {
    sandbox::GpuPqp gpu;
    std::printf("%s; %d updates of every problem\n", gpu.card().c_str(), kUpdates);
    std::printf("%5s %8s %-7s %11s %11s %11s %11s %12s %12s %12s %12s %8s\n", "rows", "problems", "form", "upload ms",
                "dispatch ms", "solve ms", "download ms", "problems/s", "one core/s", "all cores/s", "exact/s",
                "times");
    std::vector<QpCost> table;
    for (const int rows : kRowsOnCard) {
        std::mt19937_64 random(1);
        std::vector<Contacts> contacts;
        for (const int batch : kBatches) {
            if (command.quick && double(rows) * batch > kQuickWork) continue;
            while (static_cast<int>(contacts.size()) < batch)
                contacts.push_back(randomContacts(random, kContactKinds[contacts.size() % 3], rows));
            for (const bool paper : {false, true}) {
                if (paper && (rows > PaperPqp::kMaxRows || double(rows) * rows * batch > kMostPaperWork)) continue;
                const QpCost cost = measureGpu(gpu, contacts, paper);
                const auto number = [&](const char* key) { return cost[key].get<double>(); };
                std::printf("%5d %8d %-7s %11.3f %11.3f %11.3f %11.3f %12.0f %12.0f %12.0f %12.0f %8.2f\n", rows, batch,
                            cost["form"].get<std::string>().c_str(), number("upload_us") / 1000,
                            number("dispatch_us") / 1000, number("solve_us") / 1000, number("download_us") / 1000,
                            number("gpu_per_s"), number("one_core_per_s"), number("all_cores_per_s"),
                            number("exact_per_s"), number("times_one_core"));
                std::fflush(stdout);
                table.push_back(cost);
            }
        }
    }
    if (!command.csv.empty()) writeFile(command.csv, "the table", toCsv(table));
    return kOk;
}

}  // namespace

const CLI::App* addBenchGpu(CLI::App& bench, Action& action) {
    const auto options = std::make_shared<BenchGpuCommand>();
    CLI::App* gpu =
        addCommand(bench, "gpu", "Measure PQP on the graphics card beside the processor's, by rows and batch",
                   "Example:\n  touchstone bench gpu --csv gpu.csv\n");
    gpu->add_option("--csv", options->csv, "write the table to a CSV file");
    gpu->add_flag("--quick", options->quick, "leave out the largest batches");
    gpu->callback([options, &action] { action = [options] { return benchGpu(*options); }; });
    return gpu;
}

}  // namespace touchstone::app
