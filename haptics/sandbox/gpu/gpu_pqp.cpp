#include "haptics/sandbox/gpu/gpu_pqp.hpp"

#include <algorithm>
#include <climits>
#include <cmath>
#include <stdexcept>
#include <thread>
#include <vector>

#include "engine/view/gl_context.hpp"
#include "engine/view/gl_objects.hpp"
#include "haptics/builder/workers.hpp"
#include "haptics/math/simd.hpp"
#include "haptics/qp/unit_rows.hpp"
#include "haptics/threads/rt_thread.hpp"

namespace touchstone::sandbox {
namespace {

constexpr const char* kNoMemory = "the card has not enough memory for the problems: solve fewer at once";
// As in haptics/qp/pqp.cpp.
constexpr double kFloor = 1e-4, kSmallestFloor = 1e-12;
constexpr float kLargest = 1e30f;        // of a single-precision entry, so that 0 times it is 0
constexpr std::size_t kGroups = 65'535;  // that every driver takes in one dispatch
// Passes of a thread's loops in one dispatch. Mesa's rasterizer ends loops after 65,535, and says nothing; drivers of
// cards end a dispatch of seconds.
constexpr int kPasses = 60'000;
constexpr int kThreads = 256, kReductions = 128;  // of the shader; reductions: passes of the loops that add up lanes

// Columns of each problem, as in the shader: b (six), offset and inverse, one column after the other.
constexpr std::size_t kColumns = 8;
constexpr std::size_t kGrain = 20'000;  // rows that are worth a thread on the way to the card or back
/// As the shader's structs.
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

}  // namespace

struct GpuPqp::Impl {
    enum class Known : char { Satisfiable, Unsatisfiable, Invalid };

    engine::HeadlessContext context;
    std::string card = engine::glDescription();
    std::unique_ptr<engine::ShaderProgram> program;
    engine::Buffer staging, columns, firsts, forces, ends, states;
    std::size_t mostRows = 0;  ///< of a dispatch
    GpuTimes times;
    const StageClock clock = stageClock();

    std::vector<std::size_t> batch;  ///< problems of a dispatch
    std::vector<Problem> first;      ///< of each problem of the batch, and the end of the last
    std::vector<Known> known;        ///< of each problem of the batch
    std::vector<float> y;
    std::vector<End> ended;
    std::vector<SolveResult> results;
    std::vector<std::vector<Multiplier>> multipliers;

    Impl() {
        if (epoxy_gl_version() < 43)
            throw std::runtime_error("pqp-gpu needs OpenGL 4.3, and this driver has " + card +
                                     ": install the driver of the graphics card");
        program = std::make_unique<engine::ShaderProgram>("pqp.comp");
        GLint64 bytes = 0;
        glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &bytes);
        mostRows = static_cast<std::size_t>(bytes) / (kColumns * sizeof(float));
    }

    double since(std::uint64_t& start) const {
        const std::uint64_t now = clock.now();
        return static_cast<double>(now - std::exchange(start, now)) * clock.microseconds;
    }

    std::size_t rows() const { return static_cast<std::size_t>(first.back().first); }

    /// Calls work(at) for each problem of the batch, on as many threads as their rows are worth.
    template <class Work>
    void eachOfBatch(Work&& work) const {
        const std::size_t cores = std::max(1u, std::thread::hardware_concurrency());
        const std::size_t threads = std::min(cores, 1 + rows() / kGrain);
        Workers(static_cast<int>(threads)).eachRange(batch.size(), 1 + batch.size() / (4 * threads), work);
    }

    /// Rounds the rows of the batch to single precision and sends them to the card. They are written to where the card
    /// fetches them from, and fetched once, into its own memory.
    void upload(std::span<const QpProblem> problems, bool paper) {
        const auto bytes = static_cast<GLsizeiptr>(kColumns * rows() * sizeof(float));
        staging.reserve(GL_COPY_READ_BUFFER, static_cast<std::size_t>(bytes), GL_STREAM_DRAW);
        columns.reserve(GL_COPY_WRITE_BUFFER, static_cast<std::size_t>(bytes), GL_STREAM_COPY);
        auto* packed = static_cast<float*>(
            glMapBufferRange(GL_COPY_READ_BUFFER, 0, bytes, GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT));
        if (!packed) throw std::runtime_error(kNoMemory);
        known.resize(batch.size());
        // Each thread rounds its share of the problems, column by column.
        eachOfBatch([&](std::size_t from, std::size_t to) {
            int most = 0;
            for (std::size_t at = from; at < to; ++at) most = std::max(most, problems[batch[at]].rows->size());
            UnitRows unit(most);
            for (std::size_t at = from; at < to; ++at) {
                const QpProblem& problem = problems[batch[at]];
                const RowSet& raw = *problem.rows;
                float* column = packed + kColumns * static_cast<std::size_t>(first[at].first);
                const bool valid = unit.assign(problem);
                known[at] = !valid ? Known::Invalid : unit.unsatisfiable ? Known::Unsatisfiable : Known::Satisfiable;
                const auto put = [&](auto&& eight) {
                    for (int i = 0; i < unit.size; i += 8) {
                        float single[8];
                        simd::store(single, valid ? simd::max(simd::min(simd::toFloat(eight(i)), simd::splat(kLargest)),
                                                              simd::splat(-kLargest))
                                                  : simd::splat(0.f));
                        column = std::copy_n(single, std::min(8, unit.size - i), column);
                    }
                };
                const auto putColumn = [&](const double* values) {
                    put([=](int i) { return simd::load(values + i); });
                };
                for (int k = 0; k < 6; ++k)
                    if (paper)
                        put([&](int i) { return simd::load(raw.column(k) + i) / unit.root[k]; });
                    else
                        putColumn(unit.column[k].data());
                if (paper)
                    put([&](int i) {
                        simd::Double8 d = -simd::load(raw.gap() + i);
                        for (int k = 0; k < 6; ++k) d -= problem.wanted[k] * simd::load(raw.column(k) + i);
                        return d;
                    });
                else
                    putColumn(unit.offset.data());
                putColumn(unit.inverse.data());
            }
        });
        glUnmapBuffer(GL_COPY_READ_BUFFER);
        glCopyBufferSubData(GL_COPY_READ_BUFFER, GL_COPY_WRITE_BUFFER, 0, 0, bytes);
    }

    void checkCard() const {
        const bool lost = glGetGraphicsResetStatus && epoxy_has_gl_extension("GL_KHR_robustness") &&
                          glGetGraphicsResetStatus() != GL_NO_ERROR;
        if (const GLenum error = glGetError(); lost || error != GL_NO_ERROR)
            throw std::runtime_error(!lost && error == GL_OUT_OF_MEMORY
                                         ? kNoMemory
                                         : "the card's OpenGL context was lost: start the program again");
    }

    /// Solves the batch. `start`: when its upload began; set to when the solve ended.
    void dispatch(const SolverSettings& settings, std::uint64_t& start) {
        const std::size_t count = batch.size();
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
        y.resize(rows());
        ended.assign(count, {.iterations = 0, .how = kGoesOn, .carried = paper ? 0.f : 1.f});
        const auto bind = [](engine::Buffer& buffer, GLuint at) {
            glBindBufferBase(GL_SHADER_STORAGE_BUFFER, at, buffer.id());
        };
        bind(columns, 0);
        firsts.write<Problem>(GL_SHADER_STORAGE_BUFFER, first, GL_STREAM_DRAW), bind(firsts, 1);
        forces.reserve(GL_SHADER_STORAGE_BUFFER, rows() * sizeof(float), GL_STREAM_READ), bind(forces, 2);
        ends.write<End>(GL_SHADER_STORAGE_BUFFER, ended, GL_STREAM_READ), bind(ends, 3);
        states.reserve(GL_SHADER_STORAGE_BUFFER, rows() * sizeof(State), GL_STREAM_COPY), bind(states, 4);
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
        // Doubles the dispatches between two queries until every problem is done: few queries, few wasted dispatches.
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
    }

    /// The answer to a problem of the batch from the card's forces.
    void answer(const QpProblem& problem, const SolverSettings& settings, std::size_t at) {
        if (known[at] == Known::Invalid) return;
        SolveResult& r = results[batch[at]];
        std::vector<Multiplier>& pushing = multipliers[batch[at]];
        r.iterations = ended[at].iterations;
        Vec6 force = Vec6::Zero();
        const int m = first[at + 1].first - first[at].first;
        pushing.reserve(static_cast<std::size_t>(m));
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
        if (!settings.paperForm && r.status == SolveStatus::Solved && known[at] == Known::Unsatisfiable)
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
    gpu.multipliers.resize(std::max(gpu.multipliers.size(), problems.size()));
    for (auto& pushing : gpu.multipliers) pushing.clear();
    std::uint64_t start = gpu.clock.now();
    gpu.batch.clear();
    gpu.first = {{}};
    const auto flush = [&] {
        if (gpu.batch.empty()) return;
        gpu.upload(problems, settings.paperForm);
        gpu.dispatch(settings, start);
        gpu.eachOfBatch([&](std::size_t from, std::size_t to) {
            for (std::size_t at = from; at < to; ++at) gpu.answer(problems[gpu.batch[at]], settings, at);
        });
        gpu.batch.clear();
        gpu.first = {{}};
        gpu.times.download += gpu.since(start);
    };
    for (std::size_t p = 0; p < problems.size(); ++p) {
        const std::size_t rows = problems[p].rows ? static_cast<std::size_t>(problems[p].rows->size()) : 0;
        if (rows > kMaxRows) continue;
        if (rows == 0) {
            if (!UnitRows(0).assign(problems[p])) continue;
            gpu.results[p].status = SolveStatus::Solved;
            gpu.results[p].x = problems[p].wanted;
            continue;
        }
        if (gpu.batch.size() == kGroups || gpu.rows() + rows > gpu.mostRows) flush();
        gpu.batch.push_back(p);
        gpu.first.push_back({static_cast<int>(gpu.rows() + rows), 0});
    }
    flush();
    return gpu.results;
}

}  // namespace touchstone::sandbox
