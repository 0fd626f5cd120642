// touchstone qp: any problem of the tick's form, whatever its scale.
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/qp_file.hpp"
#include "tools/touchstone/settings_choice.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numeric>

namespace touchstone::app {
namespace {

constexpr int kFewRows = 4096;  // memory to begin with; a longer problem takes more, and starts cold

/// A problem as solvers like it, and the way back: rows of unit normal in the order of their identities, none without
/// direction, and G times a power of four that makes h about one deep.
class Normalised {
  public:
    Normalised(const QpLine& line, bool asGiven) : rows_(static_cast<int>(line.J.size())), line_(line) {
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
    /// A dropped row asks for what nothing can give.
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

    /// What makes the normal, or of a row of rotation alone the whole, of unit length; exactly 1 where it is one to
    /// rounding, and 0 without direction. No square of an entry overflows on the way.
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
        double depth = 0;  // of h under the rows, in the metric of G; not less than what rounding makes of it
        for (int i = 0; i < rows_.size(); ++i) {
            const Vec6 j = rows_.row(i);
            const double s = j.dot(line_.h) + rows_.gap()[i];
            if (s >= 0) continue;
            const double rounding = 1e-3 * (j.cwiseProduct(line_.h).lpNorm<1>() + std::abs(rows_.gap()[i]));
            depth = std::max(depth, std::max(-s, rounding) / j.cwiseQuotient(line_.G.cwiseSqrt()).norm());
        }
        // Contacts are left as they are, to the bit.
        if (!(depth > 0) || !std::isfinite(depth) || (depth > 1e-4 && depth < 1e4)) return 1;
        // Not so stiff that a row has no length left in the metric.
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

/// Solves one line after another.
class LineSolver {
  public:
    LineSolver(const Settings& settings, bool warm) : settings_(settings), warm_(warm) {}

    QpAnswer answer(const QpLine& line) {
        const SolverInfo& info = solverTable()[static_cast<std::size_t>(settings_.solver)];
        const int m = static_cast<int>(line.J.size());
        if (m > capacity_) {
            capacity_ = std::max(kFewRows, m);
            solver_ = info.make(capacity_);
        }
        if (!warm_ || line.ids.empty()) solver_->reset();

        const bool paper = settings_.mode == Mode::Paper;
        const Normalised normalised(line, paper && !info.exact);
        SolverSettings settings;
        settings.paperForm = paper;
        settings.tolerance = settings_.tolerance * (paper ? 1 : normalised.stiffer());
        const std::uint64_t start = clock_.now();
        const SolveResult result = solver_->solve(normalised.problem(), settings);
        const std::uint64_t end = clock_.now();

        QpAnswer answer;
        answer.y.resize(line.J.size());
        answer.us = static_cast<double>(end - start) * clock_.microseconds;
        answer.iterations = result.iterations;
        answer.status = statusName(result.status);
        if (result.status == SolveStatus::Invalid) {
            answer.why = paper && m > 1024 ? "paper mode's solver takes at most 1024 rows"
                         : paper           ? "paper mode's answer is not finite, as it is with a zero row"
                                           : "the answer is not finite: the problem's numbers are too far apart";
            return answer;
        }
        if (result.status == SolveStatus::Solved && normalised.hopeless())
            answer.status = statusName(SolveStatus::Elastic);
        normalised.takeOver(result, answer);
        return answer;
    }

  private:
    const Settings settings_;
    const bool warm_;
    const StageClock clock_ = stageClock();
    int capacity_ = -1;
    std::unique_ptr<Solver> solver_;
};

}  // namespace

int solveQps(const QpCommand& command) {
    const Settings settings = settingsOf(command);
    if (settings.mode == Mode::Penalty) throw UsageError("--mode penalty solves no problems: use default or paper");
    std::ifstream in(command.file, std::ios::binary);
    if (!in || std::filesystem::is_directory(command.file))
        throw std::runtime_error("cannot read '" + command.file.string() + "': is there such a file?");
    LineSolver solver(settings, command.warm);
    std::string text;
    int number = 0, broken = 0;
    for (QpLine line; nextLine(in, text, number);) {
        const QpFault fault = readQpLine(text, line);
        QpAnswer answer;
        if (fault.why.empty()) {
            answer = solver.answer(line);
        } else {
            answer.y.resize(line.J.size());
            answer.why = fault.why;
        }
        if (fault.broken) {
            ++broken;
            spdlog::error("{}, line {}: {}", command.file.string(), number, fault.why);
        }
        std::puts(toLine(answer).c_str());
    }
    return broken > 0 ? kFailed : kOk;
}

}  // namespace touchstone::app
