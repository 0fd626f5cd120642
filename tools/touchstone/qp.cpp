// touchstone qp: solves quadratic programs of the tick's form, at any scale.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <bit>
#include <climits>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>

#include "haptics/loop/setting_table.hpp"
#include "haptics/qp/pqp_paper.hpp"
#include "haptics/sandbox/gpu/gpu_pqp.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/qp_file.hpp"
#include "tools/touchstone/settings_choice.hpp"

namespace touchstone::app {
namespace {

struct QpCommand {
    std::filesystem::path file;
    std::optional<std::string> mode, solver, tolerance;  ///< as text, checked like settings
    bool warm = false;
};

constexpr const char *kGpuSolver = "pqp-gpu", *kCpuSolver = "pqp";  // of the same updates
constexpr int kFewRows = 4096;  // initial capacity of the solver; a longer problem reallocates it and starts cold

/// A problem scaled for the solvers, and the scaling back: rows with unit normals in the order of their identities,
/// without zero rows, and G times a power of four so that h is about one deep.
class NormalizedProblem {
  public:
    NormalizedProblem(const QpLine& line, bool asGiven) : rows_(static_cast<int>(line.J.size())), line_(line) {
        order_.resize(line.J.size());
        std::iota(order_.begin(), order_.end(), 0);
        if (!line.ids.empty())
            std::stable_sort(order_.begin(), order_.end(), [&](int a, int b) { return id(a) < id(b); });
        std::size_t kept = 0;
        for (const int row : order_) {
            const double scale = asGiven ? 1 : scaleOf(line.J[at(row)]);
            const double gap = scale * line.g[at(row)];
            if (!(scale > 0) || !std::isfinite(gap)) {
                hopeless_ = hopeless_ || line.g[at(row)] < 0;
                continue;
            }
            order_[kept++] = row;
            scales_.push_back(scale);
            rows_.push(scale * line.J[at(row)], gap, id(row));
        }
        order_.resize(kept);
        if (!asGiven) stiffer_ = scaleOfStiffness();
    }

    QpProblem problem() const { return {stiffer_ * line_.G, line_.h, &rows_}; }
    double stiffer() const { return stiffer_; }
    /// True if a dropped zero row cannot be satisfied.
    bool hopeless() const { return hopeless_; }

    void takeOver(const SolveResult& result, QpAnswer& answer) const {
        answer.x = result.x;
        // Residuals in the given unit of force, on rows of unit normal.
        RowSet unit(rows_.size());
        for (int i = 0; i < rows_.size(); ++i) {
            const double scale = scaleOf(rows_.row(i));
            unit.push(scale * rows_.row(i), scale * rows_.gap()[i], rows_.id(i));
        }
        std::vector<Multiplier> multipliers;
        for (const Multiplier& m : result.multipliers) {
            const double y = m.value / stiffer_;
            answer.y[at(order_[at(m.row)])] = y * scales_[at(m.row)];
            multipliers.push_back({m.row, y / scaleOf(rows_.row(m.row))});
        }
        answer.kkt = kktResiduals({line_.G, line_.h, &unit}, result.x, multipliers);
    }

  private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    std::uint64_t id(int row) const { return line_.ids.empty() ? at(row) : line_.ids[at(row)]; }

    /// The factor that scales the normal to unit length, or the whole row if it has only a rotational part. Exactly 1
    /// if the length is one within rounding, 0 for a zero row. No intermediate square overflows.
    static double scaleOf(const Vec6& j) {
        constexpr double kRotationAlone = 1e-9, kUnit = 1e-14;
        const double largest = j.cwiseAbs().maxCoeff();
        if (!(largest > 0)) return 0;
        const int exponent = std::ilogb(largest);
        Vec6 v;
        for (int k = 0; k < 6; ++k) v[k] = std::ldexp(j[k], -exponent);
        const double normal = v.head<3>().norm(), length = normal > kRotationAlone ? normal : v.norm();
        const double scale = std::ldexp(1 / length, -exponent);
        return std::abs(scale - 1) < kUnit ? 1 : scale;
    }

    double scaleOfStiffness() const {
        double depth = 0;  // of h below the rows, in the metric of G; at least its rounding error
        for (int i = 0; i < rows_.size(); ++i) {
            const Vec6 j = rows_.row(i);
            const double s = j.dot(line_.h) + rows_.gap()[i];
            if (s >= 0) continue;
            const double rounding = 1e-3 * (j.cwiseProduct(line_.h).lpNorm<1>() + std::abs(rows_.gap()[i]));
            depth = std::max(depth, std::max(-s, rounding) / j.cwiseQuotient(line_.G.cwiseSqrt()).norm());
        }
        // The problems of usual contacts stay bit-identical.
        if (!(depth > 0) || !std::isfinite(depth) || (depth > 1e-4 && depth < 1e4)) return 1;
        // The stiffness stays so small that no row's length in the metric underflows.
        constexpr int kStiffest = 90;
        return std::ldexp(1.0, std::min(-2 * std::ilogb(depth), kStiffest - std::ilogb(line_.G.maxCoeff())));
    }

    RowSet rows_;
    const QpLine& line_;
    std::vector<int> order_;      ///< of the kept rows: the row given
    std::vector<double> scales_;  ///< of the kept rows
    double stiffer_ = 1;
    bool hopeless_ = false;
};

const char* statusName(SolveStatus status) {
    return status == SolveStatus::Elastic ? "infeasible-elastic" : name(status);
}

/// Completes the answer to a line.
QpAnswer finished(const QpLine& line, const NormalizedProblem& normalized, const SolveResult& result, bool paper,
                  int mostRows, double us) {
    QpAnswer answer;
    answer.y.resize(line.J.size());
    answer.us = us;
    answer.iterations = result.iterations;
    answer.status = statusName(result.status);
    if (result.status == SolveStatus::Invalid) {
        answer.why = static_cast<int>(line.J.size()) > mostRows
                         ? std::string(paper ? "paper mode's" : "the card's") + " solver takes at most " +
                               std::to_string(mostRows) + " rows"
                     : paper ? "paper mode's answer is not finite, for example because of a zero row"
                             : "the answer is not finite: the problem's numbers differ too much in size";
        return answer;
    }
    if (result.status == SolveStatus::Solved && normalized.hopeless()) answer.status = statusName(SolveStatus::Elastic);
    normalized.takeOver(result, answer);
    return answer;
}

/// Solves lines; the answers are in their order.
class LineSolver {
  public:
    virtual ~LineSolver() = default;
    virtual void add(QpLine line) = 0;
    virtual void addAnswer(QpAnswer answer) = 0;
    virtual void finish() {}
};

/// One line after another on the CPU.
class CpuLines final : public LineSolver {
  public:
    CpuLines(const Settings& settings, bool warm) : settings_(settings), warm_(warm) {}

    void addAnswer(QpAnswer answer) override { std::puts(toLine(answer).c_str()); }
    void add(QpLine line) override { addAnswer(answerTo(line)); }
    QpAnswer answerTo(const QpLine& line) {
        const SolverInfo& info = *findSolver(settings_.solver);
        const int m = static_cast<int>(line.J.size());
        if (m > capacity_) {
            capacity_ = std::max(kFewRows, m);
            solver_ = info.make(capacity_);
        }
        if (!warm_ || line.ids.empty()) solver_->reset();

        const bool paper = settings_.mode == Mode::Paper;
        const NormalizedProblem normalized(line, paper && !info.exact);
        SolverSettings settings;
        settings.paperForm = paper;
        settings.tolerance = settings_.tolerance * (paper ? 1 : normalized.stiffer());
        const std::uint64_t start = clock_.now();
        const SolveResult result = solver_->solve(normalized.problem(), settings);
        const std::uint64_t end = clock_.now();
        return finished(line, normalized, result, paper, paper ? PaperPqp::kMaxRows : INT_MAX,
                        static_cast<double>(end - start) * clock_.microseconds);
    }

  private:
    const Settings settings_;
    const bool warm_;
    const StageClock clock_ = stageClock();
    int capacity_ = -1;
    std::unique_ptr<Solver> solver_;
};

/// All lines at once on the graphics card, when the last has been read. The time of a line is its share of the batch.
/// If the card fails, the CPU goes on.
class GpuLines final : public LineSolver {
  public:
    explicit GpuLines(const Settings& settings) : settings_(settings) {}

    void addAnswer(QpAnswer answer) override { answers_.push_back(std::move(answer)); }
    void add(QpLine line) override {
        lines_.push_back({std::make_unique<QpLine>(std::move(line)), answers_.size()});
        answers_.emplace_back();
    }
    void finish() override {
        try {
            solveOnCard();
        } catch (const std::runtime_error& e) {
            spdlog::warn("{} failed, and {} solves on the processor: {}", kGpuSolver, kCpuSolver, e.what());
            CpuLines cpu(settings_, false);
            for (const auto& [line, at] : lines_) answers_[at] = cpu.answerTo(*line);
        }
        for (const QpAnswer& answer : answers_) std::puts(toLine(answer).c_str());
    }

  private:
    struct Line {
        std::unique_ptr<QpLine> line;  // which its normalized problem refers to
        std::size_t answer;
    };

    void solveOnCard() {
        const bool paper = settings_.mode == Mode::Paper;
        // The tolerance is one for all problems of a dispatch, and that of a scaled problem is scaled.
        std::map<double, std::vector<std::size_t>> byScale;
        std::vector<NormalizedProblem> normalized;
        for (const auto& [line, at] : lines_) {
            normalized.emplace_back(*line, paper);
            byScale[paper ? 1 : normalized.back().stiffer()].push_back(normalized.size() - 1);
        }
        sandbox::GpuTimes times;
        for (const auto& [scale, members] : byScale) {
            std::vector<QpProblem> problems;
            for (const std::size_t i : members) problems.push_back(normalized[i].problem());
            SolverSettings settings;
            settings.paperForm = paper;
            settings.tolerance = settings_.tolerance * scale;
            const auto results = gpu_.solve(problems, settings);
            const double us = gpu_.times().total() / static_cast<double>(members.size());
            times += gpu_.times();
            for (std::size_t k = 0; k < members.size(); ++k)
                answers_[lines_[members[k]].answer] = finished(*lines_[members[k]].line, normalized[members[k]],
                                                               results[k], paper, sandbox::GpuPqp::kMaxRows, us);
        }
        spdlog::info(
            "{}: {} problems, {:.0f} a second; upload {:.2f} ms, dispatch {:.2f} ms, solve {:.2f} ms, "
            "download {:.2f} ms",
            gpu_.card(), lines_.size(), 1e6 * static_cast<double>(lines_.size()) / std::max(1.0, times.total()),
            times.upload / 1000, times.dispatch / 1000, times.solve / 1000, times.download / 1000);
    }

    const Settings settings_;
    sandbox::GpuPqp gpu_;
    std::vector<Line> lines_;
    std::vector<QpAnswer> answers_;
};

/// Without a card, in one sentence why, and the CPU solves the same.
std::unique_ptr<LineSolver> lineSolver(const Settings& settings, const QpCommand& command) {
    if (command.solver == kGpuSolver) try {
            return std::make_unique<GpuLines>(settings);
        } catch (const std::runtime_error& e) {
            spdlog::warn("{} cannot be used, and {} solves on the processor: {}", kGpuSolver, kCpuSolver, e.what());
        }
    return std::make_unique<CpuLines>(settings, command.warm);
}

Settings settingsOf(const QpCommand& command) {
    SettingsChoice choice;
    choice.solver = command.solver == kGpuSolver ? kCpuSolver : command.solver;  // a batch has a way of its own
    choice.tolerance = command.tolerance;
    Settings settings = withCommandLine({}, choice);
    if (command.mode) setFromOption(settings, "mode", *command.mode, "--mode");
    return settings;
}

/// Returns kFailed if a line is broken; the other lines are still answered.
int solveQps(const QpCommand& command) {
    const Settings settings = settingsOf(command);
    if (settings.mode != Mode::Default && settings.mode != Mode::Paper)
        throw UsageError("--mode " + std::string(modeNames()[static_cast<std::size_t>(settings.mode)]) +
                         " is no form of a quadratic program: use --mode default or --mode paper");
    std::ifstream in(command.file, std::ios::binary);
    if (!in || std::filesystem::is_directory(command.file))
        throw std::runtime_error("cannot read '" + command.file.string() + "': check that the file exists");
    if (command.solver == kGpuSolver && command.warm)
        throw UsageError(
            "--warm: the problems of a batch are solved at once: leave it out, or choose another --solver");
    const std::unique_ptr<LineSolver> solver = lineSolver(settings, command);
    std::string text;
    int number = 0, broken = 0;
    for (QpLine line; nextLine(in, text, number);) {
        const QpFault fault = readQpLine(text, line);
        if (fault.broken) {
            ++broken;
            spdlog::error("{}, line {}: {}", command.file.string(), number, fault.why);
        }
        if (fault.why.empty()) {
            solver->add(line);
        } else {
            QpAnswer answer;
            answer.y.resize(line.J.size());
            answer.why = fault.why;
            solver->addAnswer(std::move(answer));
        }
    }
    solver->finish();
    return broken > 0 ? kFailed : kOk;
}

/// The footer names a solver that has a tolerance.
std::string qpFooter() {
    std::string_view approximate;
    for (const SolverInfo& solver : solverTable())
        if (!solver.exact && approximate.empty()) approximate = solver.name;
    return "A line is min ½(x-h)'G(x-h) s.t. J x >= -g: G is a diagonal; units are mm, N, mN·m and rad. The answers "
           "are\n"
           "printed in the same order, one object per line; a problem that cannot be solved is answered 'invalid' "
           "with\n"
           "the reason.\n\n"
           "Examples:\n"
           "  touchstone qp problems.jsonl --solver " +
           std::string(approximate) +
           " --tolerance 1e-3\n"
           "  touchstone run bunnies --headless --dump-qp bunnies.jsonl\n"
           "  touchstone qp bunnies.jsonl --warm\n"
           "  touchstone qp bunnies.jsonl --solver pqp-gpu\n";
}

}  // namespace

void addQp(CLI::App& program, Action& action) {
    const auto options = std::make_shared<QpCommand>();
    CLI::App* command =
        addCommand(program, "qp", "Solve quadratic programs of contact, one JSON object per line", qpFooter().c_str());
    command->add_option("FILE", options->file, "lines of {\"G\":[6],\"J\":[[6],…],\"g\":[…],\"h\":[6],\"ids\":[…]}")
        ->required();
    command->add_option("--solver", options->solver,
                        "one of " + namesOf(solverTable()) + " (default: the first); pqp-gpu solves all lines at once");
    command->add_option("--tolerance", options->tolerance, kToleranceHelp);
    command->add_option("--mode", options->mode,
                        "default, or paper: approximate solvers in their published form, on unscaled rows");
    command->add_flag("--warm", options->warm, "start each problem from the answer of the previous line, by ids");
    command->callback([options, &action] { action = [options] { return solveQps(*options); }; });
}

}  // namespace touchstone::app
