#pragma once
// A pose over time: what demonstrations and recordings are to a device.
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "haptics/device/device.hpp"

namespace touchstone {

/// A motion of the tool node in the scene frame. Immutable; shared between threads.
class Motion {
  public:
    virtual ~Motion() = default;
    /// Pose at `t` ms since the start; the first and last pose hold outside [0, duration()].
    /// Real time: no allocation, lock or throw.
    virtual Pose at(double t) const noexcept = 0;
    virtual double duration() const noexcept = 0;  ///< ms
};

/// One of a scene's motions.
struct NamedMotion {
    std::string name;
    std::shared_ptr<const Motion> motion;
};

struct MotionKey {
    double t = 0;  ///< ms
    Pose X_WT;
};

/// Keys with linear interpolation of position and slerp of orientation (the shorter way) between them.
class RecordedMotion final : public Motion {
  public:
    /// Pre: at least one key, t strictly increasing, all finite.
    explicit RecordedMotion(std::vector<MotionKey> keys);
    Pose at(double t) const noexcept override;  ///< O(log keys)
    double duration() const noexcept override { return keys_.back().t; }
    std::span<const MotionKey> keys() const { return keys_; }

  private:
    std::vector<MotionKey> keys_;
};

/// Reads CSV: the header `t_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz`, then a key a row. Quaternions within 1e-3 of unit length
/// are normalised. Throws std::runtime_error with one sentence naming file and line.
RecordedMotion readMotion(const std::filesystem::path& file);
/// Writes what readMotion() reads back to the same bits. Throws std::runtime_error when the file cannot be written.
void writeMotion(const std::filesystem::path& file, std::span<const MotionKey> keys);

/// A device that follows a motion and ignores the wrench: demonstrations and replays.
class MotionDevice final : public Device {
  public:
    explicit MotionDevice(std::shared_ptr<const Motion> motion) : motion_(std::move(motion)) {}
    DeviceReading read(double t, double) noexcept override {
        return {.X_WT_device = motion_->at(t), .valid = true, .finished = t >= motion_->duration()};
    }
    void write(const Wrench&) noexcept override {}
    DeviceLimits limits() const noexcept override { return {.motors = false}; }
    std::optional<double> duration() const noexcept override { return motion_->duration(); }

  private:
    std::shared_ptr<const Motion> motion_;
};

}  // namespace touchstone
