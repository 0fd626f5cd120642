#include "haptics/sandbox/gpu/gpu_pqp.hpp"

#include <algorithm>
#include <climits>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "engine/view/gl_context.hpp"
#include "engine/view/gl_objects.hpp"
#include "haptics/qp/unit_rows.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone::sandbox {
namespace {

// As in haptics/qp/pqp.cpp.
constexpr double kFloor = 1e-4, kSmallestFloor = 1e-12;
constexpr float kLargest = 1e30f;        // of a single-precision entry, so that 0 times it is 0
constexpr std::size_t kGroups = 65'535;  // that every driver takes in one dispatch
// Passes of a thread's loops in one dispatch. Mesa's rasteriser ends loops after 65,535, and says nothing; drivers of
// cards end a dispatch of seconds.
constexpr int kPasses = 60'000;
constexpr int kThreads = 256, kReductions = 128;  // of the shader; reductions: passes of the loops that add up lanes

/// As the shader's struct.
struct Row {
    float b[6], offset, inverse;
};
struct Problem {
    int first, limit;
};
struct End {
    int iterations, how;
    float carried;
};
struct State {
    float u, reached;
};
enum { kLimit = 0, kSolved = 1, kGoesOn = 3 };  // of End::how

float single(double value) { return std::clamp(static_cast<float>(value), -kLargest, kLargest); }

}  // namespace

struct GpuPqp::Impl {
    engine::HeadlessContext context;
    std::string card = engine::glDescription();
    std::unique_ptr<engine::ShaderProgram> program;
    engine::Buffer rows, firsts, forces, ends, states;
    std::size_t mostRows = 0;  ///< of a dispatch
    UnitRows unit{kMaxRows};
    GpuTimes times;
    const StageClock clock = stageClock();

    std::vector<Row> packed;
    std::vector<Problem> first;  ///< of each problem, and the end of the last
    std::vector<char> unsatisfiable;
    std::vector<float> y;
    std::vector<End> ended;
    std::vector<State> state;
    std::vector<SolveResult> results;
    std::vector<std::vector<Multiplier>> multipliers;

    Impl() {
        if (epoxy_gl_version() < 43)
            throw std::runtime_error("pqp-gpu needs OpenGL 4.3, and this driver has " + card +
                                     ": install the driver of the graphics card");
        program = std::make_unique<engine::ShaderProgram>("pqp.comp");
        GLint64 bytes = 0;
        glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &bytes);
        mostRows = static_cast<std::size_t>(bytes) / sizeof(Row);
    }

    double since(std::uint64_t& start) const {
        const std::uint64_t now = clock.now();
        return static_cast<double>(now - std::exchange(start, now)) * clock.microseconds;
    }

    /// Appends the rows of a problem; false if it cannot be solved.
    bool pack(const QpProblem& problem, bool paper) {
        if (!unit.assign(problem)) return false;
        for (int i = 0; i < unit.size; ++i) {
            Row& row = packed.emplace_back();
            if (paper) {
                const Vec6 j = problem.rows->row(i);
                for (int k = 0; k < 6; ++k) row.b[k] = single(j[k] / unit.root[k]);
                row.offset = single(-j.dot(problem.wanted) - problem.rows->gap()[i]);
            } else {
                for (int k = 0; k < 6; ++k) row.b[k] = single(unit.column[k][static_cast<std::size_t>(i)]);
                row.offset = single(unit.offset[static_cast<std::size_t>(i)]);
                row.inverse = single(unit.inverse[static_cast<std::size_t>(i)]);
            }
        }
        return true;
    }

    void checkCard() const {
        const bool lost = glGetGraphicsResetStatus && epoxy_has_gl_extension("GL_KHR_robustness") &&
                          glGetGraphicsResetStatus() != GL_NO_ERROR;
        if (const GLenum error = glGetError(); lost || error != GL_NO_ERROR)
            throw std::runtime_error(!lost && error == GL_OUT_OF_MEMORY
                                         ? "the card has not enough memory for the problems: solve fewer at once"
                                         : "the card's OpenGL context was lost: start the program again");
    }

    /// Solves what is packed.
    void dispatch(const SolverSettings& settings) {
        const std::size_t count = first.size() - 1;
        const bool paper = settings.paperForm;
        int most = 0, limit = 0;
        for (std::size_t at = 0; at < count; ++at) {
            const std::int64_t size = first[at + 1].first - first[at].first;
            first[at].limit = static_cast<int>(
                std::min<std::int64_t>(settings.maxIterations, settings.workLimit / (paper ? size * size : size)));
            most = std::max(most, static_cast<int>(size));
            limit = std::max(limit, first[at].limit);
        }
        const int rowsEach = (most + kThreads - 1) / kThreads;
        const int passes = kReductions + (paper ? rowsEach * (rowsEach + (most + 3) / 4) : 2 * rowsEach);
        const int updates = std::max(1, kPasses / passes - 2);  // the start takes as long as two
        y.resize(packed.size());
        state.resize(packed.size());
        ended.assign(count, {.iterations = 0, .how = kGoesOn, .carried = paper ? 0.f : 1.f});
        std::uint64_t start = clock.now();
        const auto bind = [](engine::Buffer& buffer, GLuint at) {
            glBindBufferBase(GL_SHADER_STORAGE_BUFFER, at, buffer.id());
        };
        rows.write<Row>(GL_SHADER_STORAGE_BUFFER, packed, GL_STREAM_DRAW), bind(rows, 0);
        firsts.write<Problem>(GL_SHADER_STORAGE_BUFFER, first, GL_STREAM_DRAW), bind(firsts, 1);
        forces.write<float>(GL_SHADER_STORAGE_BUFFER, y, GL_STREAM_READ), bind(forces, 2);
        ends.write<End>(GL_SHADER_STORAGE_BUFFER, ended, GL_STREAM_READ), bind(ends, 3);
        states.write<State>(GL_SHADER_STORAGE_BUFFER, state, GL_STREAM_COPY), bind(states, 4);
        glFinish();
        checkCard();
        times.upload += since(start);

        program->use();
        program->set("paper", paper ? 1 : 0);
        program->set("tolerance", static_cast<float>(settings.tolerance));
        program->set("least", static_cast<float>(std::max(kSmallestFloor, kFloor * settings.tolerance)));
        const auto read = [](const engine::Buffer& buffer, auto& values) {
            glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffer.id());
            glGetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0,
                               static_cast<GLsizeiptr>(values.size() * sizeof values.front()), values.data());
        };
        // Twice as many dispatches each time, until no problem goes on: few questions, and few dispatches in vain.
        std::int64_t made = 0;
        bool goesOn = true;
        for (std::int64_t asked = 1; goesOn && made <= limit; asked *= 2) {
            for (std::int64_t k = 0; k < asked && made <= limit; ++k) {
                made += updates;
                program->set("pause", static_cast<int>(std::min<std::int64_t>(made, INT_MAX)));
                glDispatchCompute(static_cast<GLuint>(count), 1, 1);
                glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
                glFlush();
            }
            times.dispatch += since(start);
            read(ends, ended);
            checkCard();
            goesOn = std::any_of(ended.begin(), ended.end(), [](const End& end) { return end.how == kGoesOn; });
            times.solve += since(start);
        }

        read(forces, y);
        checkCard();
        times.download += since(start);
    }

    /// The answer to a problem from the card's forces.
    void answer(const QpProblem& problem, const SolverSettings& settings, std::size_t at, std::size_t result) {
        SolveResult& r = results[result];
        std::vector<Multiplier>& pushing = multipliers[result];
        r.iterations = ended[at].iterations;
        Vec6 force = Vec6::Zero();
        const int m = first[at + 1].first - first[at].first;
        for (int i = 0; i < m; ++i) {
            const double value = y[static_cast<std::size_t>(first[at].first + i)];
            if (value == 0) continue;
            pushing.push_back({i, value});
            force += value * problem.rows->row(i);
        }
        r.x = problem.wanted + force.cwiseQuotient(problem.stiffness);
        if ((ended[at].how != kLimit && ended[at].how != kSolved) || !r.x.allFinite()) {
            r.status = SolveStatus::Invalid;
            r.x.setZero();
            return;
        }
        r.status = ended[at].how == kSolved ? SolveStatus::Solved : SolveStatus::IterationLimit;
        if (!settings.paperForm && r.status == SolveStatus::Solved && unsatisfiable[at])
            r.status = SolveStatus::Elastic;
        r.multipliers = pushing;
        r.kkt = kktResiduals(problem, r.x, pushing);
    }
};

GpuPqp::GpuPqp() : impl_(std::make_unique<Impl>()) {}
GpuPqp::~GpuPqp() { impl_->context.makeCurrent(); }

const std::string& GpuPqp::card() const { return impl_->card; }
const GpuTimes& GpuPqp::times() const { return impl_->times; }

std::span<const SolveResult> GpuPqp::solve(std::span<const QpProblem> problems, const SolverSettings& settings) {
    Impl& gpu = *impl_;
    gpu.context.makeCurrent();
    gpu.times = {};
    gpu.results.assign(problems.size(), {});
    gpu.multipliers.assign(problems.size(), {});
    std::vector<std::size_t> packed;
    const auto flush = [&] {
        if (packed.empty()) return;
        gpu.dispatch(settings);
        for (std::size_t at = 0; at < packed.size(); ++at) gpu.answer(problems[packed[at]], settings, at, packed[at]);
        packed.clear();
    };
    for (std::size_t p = 0; p < problems.size(); ++p) {
        const std::size_t rows = problems[p].rows ? static_cast<std::size_t>(problems[p].rows->size()) : 0;
        if (packed.size() == kGroups || gpu.packed.size() + rows > gpu.mostRows) flush();
        if (packed.empty()) gpu.packed.clear(), gpu.first = {{}}, gpu.unsatisfiable.clear();
        if (rows > kMaxRows || !gpu.pack(problems[p], settings.paperForm)) continue;
        if (rows == 0) {
            gpu.results[p].status = SolveStatus::Solved;
            gpu.results[p].x = problems[p].wanted;
            continue;
        }
        gpu.first.push_back({static_cast<int>(gpu.packed.size()), 0});
        gpu.unsatisfiable.push_back(gpu.unit.unsatisfiable);
        packed.push_back(p);
    }
    flush();
    return gpu.results;
}

}  // namespace touchstone::sandbox
