#include "haptics/sandbox/gpu/gpu_solver.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <latch>
#include <stdexcept>
#include <thread>
#include <vector>

#include "haptics/qp/pqp.hpp"
#include "haptics/qp/random_contacts.hpp"
#include "haptics/sandbox/gpu/gpu_pqp.hpp"

namespace touchstone::sandbox {
namespace {

using Clock = std::chrono::steady_clock;
using Microseconds = std::chrono::duration<double, std::micro>;

/// The thread that owns the card. It is never ended: a driver's own threads may be gone when statics are destroyed.
class Card {
  public:
    static Card& get() {
        static Card& card = *new Card;
        return card;
    }

    const RoundTrip& roundTrip() const { return trip_; }

    /// False if the card has no answer in time. `multipliers` has room for GpuPqp::kMaxRows. Real time.
    bool solve(const QpProblem& problem, const SolverSettings& settings, SolveResult& result,
               std::vector<Multiplier>& multipliers) noexcept {
        if (!trip_.trouble.empty() || lost_.load(std::memory_order_relaxed)) return false;
        const Clock::time_point start = Clock::now();
        const auto late = [&] {
            return lost_.load(std::memory_order_relaxed) ||
                   Microseconds(Clock::now() - start).count() > settings.longestWait;
        };
        for (State free = State::Free; !state_.compare_exchange_weak(free, State::Taken); free = State::Free)
            if (late()) return false;
        rows_.clear();
        for (int i = 0; i < problem.rows->size(); ++i)
            rows_.push(problem.rows->row(i), problem.rows->gap()[i], problem.rows->id(i));
        asked_ = {problem.stiffness, problem.wanted, &rows_};
        settings_ = settings;
        state_.store(State::Asked);
        state_.notify_one();
        // The caller's own time passes while it waits: so it counts in the thread CPU time of a tick.
        while (state_.load() == State::Asked)
            if (State asked = State::Asked; late() && state_.compare_exchange_strong(asked, State::LeftAlone))
                return false;
        const bool answered = answered_;
        if (answered) {
            result = answer_;
            multipliers.assign(answer_.multipliers.begin(), answer_.multipliers.end());
            result.multipliers = multipliers;
        }
        state_.store(State::Free);
        return answered;
    }

  private:
    enum class State { Free, Taken, Asked, LeftAlone, Answered };

    Card() {
        std::thread([this] { run(); }).detach();
        started_.wait();
    }

    void run() {
        try {
            if (std::thread::hardware_concurrency() < 2)
                throw std::runtime_error("it needs a second processor, which waits for the card");
            GpuPqp gpu;
            measure(gpu);
            started_.count_down();
            for (;;) answerNext(gpu);
        } catch (const std::exception& e) {
            if (!started_.try_wait()) {
                trip_.trouble = e.what();
                started_.count_down();
                return;
            }
        }
        lost_.store(true);
        answered_ = false;
        giveBack();
    }

    void answerNext(GpuPqp& gpu) {
        State state = state_.load();
        if (state != State::Asked && state != State::LeftAlone) return state_.wait(state);
        answer_ = gpu.solve(std::span(&asked_, 1), settings_).front();
        answered_ = true;
        giveBack();
    }

    /// To who asked, or to nobody.
    void giveBack() {
        State state = State::Asked;
        if (!state_.compare_exchange_strong(state, State::Answered) && state == State::LeftAlone)
            state_.store(State::Free);
    }

    /// With as many rows as those with which calibrateWork() measures the processor.
    void measure(GpuPqp& gpu) {
        constexpr int kRuns = 5, kRows = 300, kUpdates = 100;
        std::mt19937_64 random(1);
        const Contacts contacts = randomContacts(random, ContactKind::Pinch, kRows);
        const QpProblem problem = contacts.problem();
        const auto best = [&](int updates) {
            double us = 1e30;
            for (int run = 0; run < kRuns; ++run) {
                gpu.solve(std::span(&problem, 1), {.tolerance = 1e-300, .maxIterations = updates});
                us = std::min(us, gpu.times().total());
            }
            return us;
        };
        trip_.us = best(0);
        trip_.updateUs = std::max(1e-3, (best(kUpdates) - trip_.us) / kUpdates);
    }

    RoundTrip trip_;
    std::latch started_{1};
    std::atomic<State> state_ = State::Free;
    std::atomic<bool> lost_ = false;
    // Owned by whoever has taken the card; from Asked on by its thread, until Answered.
    RowSet rows_{GpuPqp::kMaxRows};
    QpProblem asked_;
    SolverSettings settings_;
    SolveResult answer_;
    bool answered_ = false;
};

class GpuSolver final : public Solver {
  public:
    explicit GpuSolver(int capacity) : processor_(makePqp(capacity)) { multipliers_.reserve(GpuPqp::kMaxRows); }

    SolveResult solve(const QpProblem& problem, const SolverSettings& settings) noexcept override {
        SolveResult result;
        if (problem.rows && problem.rows->size() <= GpuPqp::kMaxRows &&
            Card::get().solve(problem, settings, result, multipliers_))
            return result;
        result = processor_->solve(problem, settings);
        result.byProcessor = true;
        return result;
    }
    void reset() noexcept override { processor_->reset(); }

  private:
    std::unique_ptr<Solver> processor_;
    std::vector<Multiplier> multipliers_;
};

}  // namespace

void addGpuSolver() {
    addSolver({"pqp-gpu",
               "The same updates on the graphics card, in single precision. In a window only where the way to the card "
               "and back fits a tick.",
               false, [](int capacity) -> std::unique_ptr<Solver> { return std::make_unique<GpuSolver>(capacity); },
               []() -> const RoundTrip& { return Card::get().roundTrip(); }});
}

}  // namespace touchstone::sandbox
