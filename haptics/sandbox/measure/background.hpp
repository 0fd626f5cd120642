#pragma once
// A measurement on its own thread.
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

namespace touchstone::sandbox {

/// Told how far the measurement is, 0 to 1; false: it should end.
using MeasureProgress = std::function<bool(double)>;

/// Runs one measurement at a time. Only one thread at a time may call it. Its functions do not wait, except that
/// cancelling waits until the measurement next reports its progress.
template <class Result>
class Background {
  public:
    /// Nothing if it was cancelled. A std::exception becomes the refusal.
    using Work = std::function<std::optional<Result>(const MeasureProgress&)>;

    /// Cancels a measurement that is running.
    void start(Work work) {
        cancel();
        refusal_.clear();
        job_ = std::make_unique<Job>();
        job_->thread = std::jthread([job = job_.get(), work = std::move(work)](const std::stop_token& stop) {
            try {
                job->result = work([&](double fraction) {
                    job->progress = fraction;
                    return !stop.stop_requested();
                });
            } catch (const std::exception& e) {
                job->refusal = e.what();
            }
            job->done = true;
        });
    }
    void cancel() { job_.reset(); }
    /// Call once a frame: takes the result over when it is ready.
    void poll() {
        if (!job_ || !job_->done) return;
        job_->thread.join();
        refusal_ = job_->refusal;
        if (job_->result) result_ = std::move(job_->result);
        job_.reset();
    }
    bool running() const { return job_ != nullptr; }
    double progress() const { return job_ ? job_->progress.load() : 0; }
    /// Result of the last completed measurement; null before the first.
    const Result* result() const { return result_ ? &*result_ : nullptr; }
    /// One sentence: why the last measurement has no result; empty if it has one.
    const std::string& refusal() const { return refusal_; }
    void forget() {
        cancel();
        result_.reset();
        refusal_.clear();
    }

  private:
    struct Job {
        std::atomic<double> progress = 0;
        std::atomic<bool> done = false;
        std::optional<Result> result;  // once done
        std::string refusal;
        std::jthread thread;  // last: joined before what it writes goes
    };
    std::unique_ptr<Job> job_;
    std::optional<Result> result_;
    std::string refusal_;
};

}  // namespace touchstone::sandbox
