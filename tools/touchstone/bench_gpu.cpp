// touchstone bench gpu: PQP on the graphics card beside the processor's, and the exact solver.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "engine/scene/text.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/loop/work_limits.hpp"
#include "haptics/qp/pqp_paper.hpp"
#include "haptics/qp/random_contacts.hpp"
#include "haptics/sandbox/gpu/gpu_pqp.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "tools/touchstone/bench.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/csv.hpp"
#include "tools/touchstone/figures.hpp"
#include "tools/touchstone/stopwatch.hpp"

namespace touchstone::app {

using nlohmann::ordered_json;

namespace {

constexpr int kUpdates = 50;  // of every problem, on both
constexpr int kRowsOnCard[] = {10, 100, 1000, 4000}, kBatches[] = {1, 10, 100, 1000};
constexpr double kLongest = 60, kQuickLongest = 1;  // s that a batch may take on the card, with --quick
constexpr double kOnce = 10;                        // s above which a batch is measured once
constexpr std::size_t kProcessorSample = 60;        // problems that the processor solves for its rate

struct BenchGpuCommand {
    std::filesystem::path out;  ///< folder; empty: none
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
        if (best.total() > 1e6 * kOnce) break;
    }
    const std::span sample(problems.data(), std::min(problems.size(), kProcessorSample));
    const SolverInfo &pqp = *findSolver("pqp"), &exact = *findSolver(kExactSolver);
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

/// Whether a window may render with it.
std::string renderingSentence() {
    const SolverInfo& info = *findSolver("pqp-gpu");
    const RoundTrip& trip = info.roundTrip();
    Settings settings;
    settings.solver = "pqp-gpu";
    const bool fits = keepRoundTripsInTick(settings).empty();
    return engine::formatted(
        "One problem of 300 rows takes %.0f µs to the card and back, and %.1f µs more for each update, so a window at "
        "1 kHz "
        "%s with it.\n\n",
        trip.us, trip.updateUs, fits ? "renders" : "does not render");
}

/// The page beside the folder: Markdown.
void writeGpuPage(const std::filesystem::path& out, const std::vector<QpCost>& table,
                  const std::vector<Figure>& figures) {
    const std::filesystem::path folder = out.filename().empty() ? out.parent_path() : out;
    const std::string name = folder.filename().string(), card = table.front()["card"];
    const bool software = card.find("llvmpipe") != std::string::npos;
    const ordered_json build = sandbox::buildInfo();
    std::string asked;
    for (const QpCost& row : table)
        if (row["rows"] == 1000 && row["problems"] == 1000)
            asked += engine::formatted("%s%.3g times (%s form)", asked.empty() ? "" : ", ",
                                       row["times_one_core"].get<double>(), row["form"].get<std::string>().c_str());
    std::string page =
        "# PQP on a graphics card\n\nWritten by `touchstone bench gpu --out " + folder.generic_string() +
        "`; [gpu.csv](" + name + "/gpu.csv) has all figures.\n\nCard: " + card +
        ". Processor: " + build["machine"]["processor"].get<std::string>() + ", " +
        std::to_string(table.front()["cores"].get<int>()) + " cores. Every problem gets " + std::to_string(kUpdates) +
        " updates, on the card in single precision and on the processor by the same form of PQP; *exact* is the exact "
        "solver on one core. *Upload* includes the rounding of the rows; *download* includes the answers that all "
        "cores "
        "compute from the forces. *Dispatch* ends when the driver has taken the commands. Batches that would take more "
        "than " +
        shortNumber(kLongest) + " s on the card are left out.\n\n" + renderingSentence() +
        "Goal: at 1,000 rows and 1,000 problems at least 20 times the problems of one core. " +
        (asked.empty() ? "Not measured." : (software ? "Not measured on a card; here " : "Measured: ") + asked + ".") +
        "\n";
    if (software)
        page +=
            "\n**This is no graphics card**: llvmpipe, Mesa's rasterizer, computes on the processor. The table shows "
            "that it works, not what a card gains; run the command on a machine with a card.\n";
    for (const Figure& figure : figures) page += "\n![" + figure.caption + "](" + name + "/" + figure.name + ".svg)\n";
    page +=
        "\n| rows | problems | form | upload, ms | dispatch, ms | solve, ms | download, ms | card: problems/s | one "
        "core | all "
        "cores | exact | card / one core |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for (const QpCost& row : table) {
        page += "| " + row["rows"].dump() + " | " + row["problems"].dump() + " | " + row["form"].get<std::string>();
        for (const char* key : {"upload_us", "dispatch_us", "solve_us", "download_us"})
            page += " | " + engine::formatted("%.3g", row[key].get<double>() / 1000);
        for (const char* key : {"gpu_per_s", "one_core_per_s", "all_cores_per_s", "exact_per_s"})
            page += " | " + engine::formatted("%.0f", row[key].get<double>());
        page += " | " + engine::formatted("%.2g", row["times_one_core"].get<double>()) + " |\n";
    }
    writeFile(std::filesystem::path(folder).concat(".md"), "the page", page);
}

int benchGpu(const BenchGpuCommand& command) {
    sandbox::GpuPqp gpu;
    std::printf("%s; %d updates of every problem\n", gpu.card().c_str(), kUpdates);
    std::printf("%5s %8s %-7s %11s %11s %11s %11s %12s %12s %12s %12s %8s\n", "rows", "problems", "form", "upload ms",
                "dispatch ms", "solve ms", "download ms", "problems/s", "one core/s", "all cores/s", "exact/s",
                "times");
    if (!command.out.empty()) makeFolder(command.out, "the table");
    std::vector<QpCost> table;
    const double longest = command.quick ? kQuickLongest : kLongest;
    for (const int rows : kRowsOnCard) {
        for (const bool paper : {false, true}) {
            if (paper && rows > PaperPqp::kMaxRows) continue;
            std::mt19937_64 random(1);
            std::vector<Contacts> contacts;
            double expected = 0;  // s
            for (const int batch : kBatches) {
                if (expected > longest) {
                    std::printf("%5d %8d %-7s left out: about %.0f s\n", rows, batch, paper ? "paper" : "guarded",
                                expected);
                    break;
                }
                while (static_cast<int>(contacts.size()) < batch)
                    contacts.push_back(randomContacts(random, kContactKinds[contacts.size() % 3], rows));
                const QpCost cost = measureGpu(gpu, contacts, paper);
                const auto number = [&](const char* key) { return cost[key].get<double>(); };
                std::printf("%5d %8d %-7s %11.3f %11.3f %11.3f %11.3f %12.0f %12.0f %12.0f %12.0f %8.2f\n", rows, batch,
                            cost["form"].get<std::string>().c_str(), number("upload_us") / 1000,
                            number("dispatch_us") / 1000, number("solve_us") / 1000, number("download_us") / 1000,
                            number("gpu_per_s"), number("one_core_per_s"), number("all_cores_per_s"),
                            number("exact_per_s"), number("times_one_core"));
                std::fflush(stdout);
                table.push_back(cost);
                expected = 10 * batch / number("gpu_per_s");
            }
        }
    }
    if (!command.out.empty()) {
        writeFile(command.out / "gpu.csv", "the table", toCsv(table));
        writeGpuPage(command.out, table, drawFigures("gpu", command.out));
    }
    return kOk;
}

}  // namespace

const CLI::App* addBenchGpu(CLI::App& bench, Action& action) {
    const auto options = std::make_shared<BenchGpuCommand>();
    CLI::App* gpu =
        addCommand(bench, "gpu", "Measure PQP on the graphics card beside the processor's, by rows and batch",
                   "Example:\n  touchstone bench gpu --out docs/gpu\n");
    gpu->add_option("--out", options->out, "folder for the table and a figure; the page is beside it, as DIR.md");
    gpu->add_flag("--quick", options->quick, "leave out the largest batches");
    gpu->callback([options, &action] { action = [options] { return benchGpu(*options); }; });
    return gpu;
}

}  // namespace touchstone::app
