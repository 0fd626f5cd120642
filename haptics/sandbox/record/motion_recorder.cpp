#include "haptics/sandbox/record/motion_recorder.hpp"

#include <algorithm>

namespace touchstone::sandbox {
namespace {

constexpr std::size_t kMostSince = 250;  // samples between two keys: bounds the work of a sample

bool near(const Pose& a, const Pose& b) {
    return (a.p - b.p).norm() <= kMotionErrorMm && logRotation(a.q * b.q.conjugate()).norm() <= kMotionErrorRad;
}

}  // namespace

/// Whether the line from the last key to `end` is near all samples between them.
bool MotionThinner::follows(const MotionKey& end) const {
    const MotionKey& begin = keys_.back();
    return std::all_of(since_.begin(), since_.end(), [&](const MotionKey& sample) {
        const double s = (sample.t - begin.t) / (end.t - begin.t);
        return near({begin.X_WT.p + s * (end.X_WT.p - begin.X_WT.p), begin.X_WT.q.slerp(s, end.X_WT.q)}, sample.X_WT);
    });
}

void MotionThinner::add(double t, const Pose& X_WT) {
    const MotionKey sample{t, X_WT};
    if (keys_.empty()) {
        keys_.push_back(sample);
        return;
    }
    // At rest, the newest sample stands for all.
    if (since_.size() > 1 && since_.back().X_WT == X_WT && since_[since_.size() - 2].X_WT == X_WT) {
        since_.back().t = t;
        return;
    }
    if (!since_.empty() && (since_.size() >= kMostSince || !follows(sample))) {
        keys_.push_back(since_.back());
        since_.clear();
    }
    since_.push_back(sample);
}

std::vector<MotionKey> MotionThinner::keys() const {
    std::vector<MotionKey> all = keys_;
    if (!since_.empty()) all.push_back(since_.back());
    return all;
}

void MotionRecorder::append(double dt, const Pose& X_WT) {
    t_ += dt;
    thinner_.add(t_, X_WT);
    last_ = X_WT;
}

void MotionRecorder::join(const Pose& X_WT) {
    if (near(last_, X_WT)) return;
    append(std::max({1.0, (X_WT.p - last_.p).norm() / kJoinMmPerMs,
                     logRotation(X_WT.q * last_.q.conjugate()).norm() / kJoinRadPerMs}),
           X_WT);
}

void MotionRecorder::add(const RecordedTick& tick) {
    if (waits_ && !tick.start) return;
    waits_ = false;
    const Pose &X_WT_device = tick.record.X_WT_device, &X_WT = tick.record.X_WT;
    if (tick.start || tick.session != session_) joins_ = true;
    session_ = tick.session;
    if ((tick.record.flags & (kPaused | kBadInput)) || !X_WT_device.isValid()) {
        joins_ = true;
        return;
    }
    const double dt = 1000 / tick.settings.rate;
    if (!begun_) {
        begun_ = true;
        joins_ = false;
        first_ = X_WT_device;
        append(0, X_WT);
        join(X_WT_device);
        return;
    }
    if (!moved_ && near(first_, X_WT_device)) {
        if (t_ < kLeadMs) append(dt, X_WT_device);
        return;
    }
    moved_ = true;
    if (joins_) join(X_WT_device);
    joins_ = false;
    append(dt, X_WT_device);
}

}  // namespace touchstone::sandbox
