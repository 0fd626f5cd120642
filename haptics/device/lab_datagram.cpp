#include "haptics/device/lab_datagram.hpp"

#include <bit>
#include <cstring>

namespace touchstone {
namespace {

constexpr char kPoseMagic[5] = "TSLP", kWrenchMagic[5] = "TSLW";
constexpr std::uint16_t kFaultFlag = 1;

/// Writes fields one after the other, independent of the machine's byte order.
class FieldWriter {
  public:
    explicit FieldWriter(std::span<std::uint8_t> bytes) : bytes_(bytes) {}
    template <class T>
    FieldWriter& put(T value) {
        for (std::size_t i = 0; i < sizeof value; ++i) bytes_[at_++] = static_cast<std::uint8_t>(value >> (8 * i));
        return *this;
    }
    FieldWriter& put(double value) { return put(std::bit_cast<std::uint64_t>(value)); }
    FieldWriter& magic(const char* text) {
        std::memcpy(&bytes_[at_], text, 4);
        at_ += 4;
        return *this;
    }
    FieldWriter& put(const Vec3& v) { return put(v.x()).put(v.y()).put(v.z()); }

  private:
    std::span<std::uint8_t> bytes_;
    std::size_t at_ = 0;
};

class FieldReader {
  public:
    explicit FieldReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
    template <class T>
    T take() {
        T value = 0;
        for (std::size_t i = 0; i < sizeof value; ++i) value |= static_cast<T>(T{bytes_[at_++]} << (8 * i));
        return value;
    }
    double number() { return std::bit_cast<double>(take<std::uint64_t>()); }
    Vec3 vector() {
        const double x = number(), y = number(), z = number();
        return {x, y, z};
    }

  private:
    std::span<const std::uint8_t> bytes_;
    std::size_t at_ = 6;  // after magic and version
};

bool beginsWell(std::span<const std::uint8_t> bytes, std::size_t size, std::size_t expected, const char* magic,
                LabRejected& why) {
    // A datagram of another size may be of another version, which is the better message.
    if (bytes.size() < 6 || size < 6)
        why = LabRejected::Size;
    else if (std::memcmp(bytes.data(), magic, 4) != 0)
        why = LabRejected::Magic;
    else if ((bytes[4] | bytes[5] << 8) != kLabVersion)
        why = LabRejected::Version;
    else if (size != expected || bytes.size() < expected)
        why = LabRejected::Size;
    else
        return true;
    return false;
}

}  // namespace

const char* words(LabRejected why) {
    switch (why) {
        case LabRejected::Size:
            return "of the wrong size";
        case LabRejected::Magic:
            return "that is not a pose of this protocol";
        case LabRejected::Version:
            return "of another version of the protocol";
        case LabRejected::Pose:
            return "with an invalid pose";
        case LabRejected::Foreign:
            return "from another sender";
        case LabRejected::Session:
            return "of another session";
        case LabRejected::Old:
            return "old or repeated";
    }
    return "unknown";
}

bool readLabPose(std::span<const std::uint8_t> bytes, std::size_t size, LabPose& pose, LabRejected& why) noexcept {
    if (!beginsWell(bytes, size, kLabPoseBytes, kPoseMagic, why)) return false;
    FieldReader fields(bytes);
    pose.fault = (fields.take<std::uint16_t>() & kFaultFlag) != 0;
    pose.session = fields.take<std::uint32_t>();
    pose.buttons = fields.take<std::uint32_t>();
    pose.sequence = fields.take<std::uint64_t>();
    pose.time = fields.take<std::uint64_t>();
    pose.X_DS.p = fields.vector();
    const Vec3 xyz = fields.vector();
    pose.X_DS.q = Quat(fields.number(), xyz.x(), xyz.y(), xyz.z());
    why = LabRejected::Pose;
    if (!pose.X_DS.isValid()) return false;
    pose.X_DS.q.normalize();
    return true;
}

bool readLabWrench(std::span<const std::uint8_t> bytes, std::size_t size, LabWrench& wrench,
                   LabRejected& why) noexcept {
    if (!beginsWell(bytes, size, kLabWrenchBytes, kWrenchMagic, why)) return false;
    FieldReader fields(bytes);
    wrench.state = static_cast<LabState>(fields.take<std::uint16_t>());
    wrench.session = fields.take<std::uint32_t>();
    fields.take<std::uint32_t>();
    wrench.sequence = fields.take<std::uint64_t>();
    wrench.time = fields.take<std::uint64_t>();
    wrench.wrench.force = fields.vector();
    wrench.wrench.torque = fields.vector();
    return true;
}

std::array<std::uint8_t, kLabPoseBytes> labBytes(const LabPose& pose) noexcept {
    std::array<std::uint8_t, kLabPoseBytes> bytes{};
    FieldWriter(bytes)
        .magic(kPoseMagic)
        .put(kLabVersion)
        .put(static_cast<std::uint16_t>(pose.fault ? kFaultFlag : 0))
        .put(pose.session)
        .put(pose.buttons)
        .put(pose.sequence)
        .put(pose.time)
        .put(pose.X_DS.p)
        .put(Vec3(pose.X_DS.q.vec()))
        .put(pose.X_DS.q.w());
    return bytes;
}

std::array<std::uint8_t, kLabWrenchBytes> labBytes(const LabWrench& wrench) noexcept {
    std::array<std::uint8_t, kLabWrenchBytes> bytes{};
    FieldWriter(bytes)
        .magic(kWrenchMagic)
        .put(kLabVersion)
        .put(static_cast<std::uint16_t>(wrench.state))
        .put(wrench.session)
        .put(std::uint32_t{0})
        .put(wrench.sequence)
        .put(wrench.time)
        .put(wrench.wrench.force)
        .put(wrench.wrench.torque);
    return bytes;
}

}  // namespace touchstone
