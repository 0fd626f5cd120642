#include "haptics/device/workspace.hpp"

#include <algorithm>
#include <cmath>

#include "haptics/device/control.hpp"
#include "haptics/threads/ramp.hpp"
#include "haptics/threads/triple_buffer.hpp"

namespace touchstone {
namespace {

constexpr double kFadeOutMs = 50, kFadeInMs = 100;  // fades of the force when the clutch is pressed and released
constexpr double kGlide = 0.05;                     // speed of the tool to a new offset, mm/ms

class MappedControl final : public DeviceControl {
  public:
    explicit MappedControl(std::shared_ptr<DeviceControl> raw) : raw_(std::move(raw)) {}
    DeviceStatus status() const override { return raw_ ? raw_->status() : DeviceStatus{}; }
    void reconnect() override {
        if (raw_) raw_->reconnect();
    }
    void selfInitialize() override {
        if (raw_) raw_->selfInitialize();
    }
    Maps maps() const override { return Maps::All; }
    Workspace workspace() const override { return newest_; }
    void setWorkspace(const Workspace& workspace) override {
        newest_ = workspace;
        buffer_.write(workspace);
    }

    TripleBuffer<Workspace>& buffer() { return buffer_; }

  private:
    const std::shared_ptr<DeviceControl> raw_;
    Workspace newest_;  // used only by the window's thread
    TripleBuffer<Workspace> buffer_;
};

class MappedDevice final : public Device {
  public:
    MappedDevice(std::unique_ptr<Device> raw, const Pose& X_WT_start)
        : raw_(std::move(raw)),
          control_(std::make_shared<MappedControl>(raw_->control())),
          X_WT_start_(X_WT_start),
          X_WT_(X_WT_start) {}

    DeviceReading read(double t, double dt) noexcept override {
        takeWorkspace();
        begun_ = true;
        DeviceReading reading = raw_->read(t, dt);
        if (t <= 0) {
            engage(X_WT_start_);
            glided_ = Vec3::Zero();
            share_.jump(1);
        }
        const bool sound = reading.X_WT_device.isValid(), usable = reading.valid && !reading.fault && sound;
        const bool clutched = usable && (reading.buttons & workspace_.clutch);
        if (clutched != clutched_)
            share_.to(clutched ? 0 : 1, static_cast<int>(std::lround((clutched ? kFadeOutMs : kFadeInMs) / dt)));
        clutched_ = clutched;
        share_.next();
        if (usable) {
            if (lost_ || clutched) {
                X_DS_held_ = reading.X_WT_device;
                X_WT_held_ = X_WT_;
            }
            X_WT_ = mapped(reading.X_WT_device);
            glide(dt);
        }
        // After the clutch or a lost reading, the next usable reading takes the tool up again, without a jump.
        lost_ = !usable || clutched;
        // Pass on a fresh but invalid pose, so that the tick can flag it.
        if (sound || !reading.valid) reading.X_WT_device = X_WT_;
        return reading;
    }

    void write(const Wrench& wrench_o) noexcept override {
        const Quat q_DW = workspace_.q_WD.conjugate();
        const double force = share_.value() / workspace_.scale, torque = force / workspace_.scale;
        raw_->write({force * (q_DW * wrench_o.force), torque * (q_DW * wrench_o.torque)});
    }

    void releaseForces() noexcept override { raw_->releaseForces(); }
    void engage(const Pose& X_WT) noexcept override {
        raw_->engage(X_WT);
        X_WT_ = X_WT;
        lost_ = true;
    }
    DeviceLimits limits() const noexcept override { return limitsInScene(raw_->limits(), control_->workspace().scale); }
    std::optional<DeviceDynamics> dynamics() const noexcept override { return raw_->dynamics(); }
    bool drive(double rate, const std::function<bool()>& tick) noexcept override { return raw_->drive(rate, tick); }
    std::shared_ptr<DeviceControl> control() const override { return control_; }

  private:
    void takeWorkspace() noexcept {
        if (!control_->buffer().update()) return;
        const double scale = workspace_.scale;
        workspace_ = control_->buffer().get();
        if (begun_) workspace_.scale = scale;  // the limits of the safety stage were computed for this scale
        lost_ = true;
    }

    Pose mapped(const Pose& X_DS) const noexcept {
        const Quat& q_WD = workspace_.q_WD;
        const Quat turn = q_WD * X_DS.q * X_DS_held_.q.conjugate() * q_WD.conjugate();
        return {X_WT_held_.p + workspace_.scale * (q_WD * (X_DS.p - X_DS_held_.p)), (turn * X_WT_held_.q).normalized()};
    }

    void glide(double dt) noexcept {
        if (clutched_) return;
        const Vec3 left = workspace_.offset - glided_;
        const double distance = left.norm();
        if (!(distance > 0)) return;
        const Vec3 step = left * std::min(1.0, kGlide * dt / distance);
        glided_ += step;
        X_WT_held_.p += step;
        X_WT_.p += step;
    }

    const std::unique_ptr<Device> raw_;
    const std::shared_ptr<MappedControl> control_;
    const Pose X_WT_start_;
    Workspace workspace_;
    Pose X_WT_;                   // the last pose that was returned
    Pose X_DS_held_, X_WT_held_;  // poses of hand and tool when the tool was taken up
    Vec3 glided_ = Vec3::Zero();
    bool lost_ = true;  // the next usable reading takes the tool up
    bool clutched_ = false, begun_ = false;
    Ramp share_{1};
};

}  // namespace

std::string checkWorkspace(const Workspace& workspace) {
    if (!(workspace.scale >= kSmallestScale && workspace.scale <= kLargestScale))
        return "the workspace's scale must be from 0.01 to 100 mm of the tool per mm of the hand";
    if (!workspace.offset.allFinite() || workspace.offset.norm() > 1e6)
        return "the workspace's offset must be three finite numbers in mm, with a length of at most 1 km";
    if (!(std::abs(workspace.q_WD.norm() - 1) < 1e-6))
        return "the workspace's axes must be a quaternion of unit length";
    return {};
}

double torsionInScene(double torsion, double scale) { return torsion * scale * scale; }

DeviceLimits limitsInScene(DeviceLimits limits, double scale) {
    limits.peakForce *= scale;
    limits.continuousForce *= scale;
    limits.peakTorque *= scale * scale;
    limits.continuousTorque *= scale * scale;
    limits.slewForce *= scale;
    limits.slewTorque *= scale * scale;
    return limits;
}

const char* name(DeviceStatus::State state) {
    switch (state) {
        case DeviceStatus::State::Running:
            return "running";
        case DeviceStatus::State::Fault:
            return "fault";
        case DeviceStatus::State::Lost:
            return "lost";
        case DeviceStatus::State::Connecting:
            return "connecting";
    }
    return "unknown";
}

std::string troubleOf(const DeviceStatus& status) {
    return status.state == DeviceStatus::State::Running ? "" : status.text;
}

std::unique_ptr<Device> makeMapped(std::unique_ptr<Device> raw, const Pose& X_WT_start) {
    return std::make_unique<MappedDevice>(std::move(raw), X_WT_start);
}

}  // namespace touchstone
