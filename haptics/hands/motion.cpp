#include "haptics/hands/motion.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "haptics/files/output_file.hpp"
#include "haptics/math/numbers.hpp"

namespace touchstone {
namespace {

constexpr std::string_view kHeader = "t_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz";
constexpr int kColumns = 8;
constexpr double kUnitTolerance = 1e-3;  // maximum deviation of a quaternion's length from 1
// Coordinates are only required to be finite, because the tick flags invalid poses (kBadInput). Times are limited to
// about eleven days, because a longer motion must be a mistake.
constexpr double kLargest = std::numeric_limits<double>::max(), kLongestMs = 1e9;
// A quaternion with a smaller deviation than this is not normalized, so that written values are read back bit for bit.
constexpr double kUnitExact = 1e-12;

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kSpace = " \t\r";
    const auto begin = text.find_first_not_of(kSpace);
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

/// Parses a row into a key. Returns an empty string, or what is wrong with the row.
std::string readRow(std::string_view line, MotionKey& key) {
    std::array<double, kColumns> v{};
    for (int column = 0; column < kColumns; ++column) {
        const auto comma = line.find(',');
        const bool last = column == kColumns - 1;
        if ((comma == std::string_view::npos) != last)
            return "a row needs " + std::to_string(kColumns) + " numbers, as in " + std::string(kHeader);
        const std::string_view field = trimmed(line.substr(0, comma));
        const auto number = readNumber(field, -kLargest, kLargest);
        if (!number) return "'" + std::string(field) + "' is not a finite number";
        v[column] = *number;
        if (!last) line.remove_prefix(comma + 1);
    }
    if (!isWithin(v[0], -kLongestMs, kLongestMs)) return "t_ms must be " + rangeWords(-kLongestMs, kLongestMs, "ms");
    key.t = v[0];
    key.X_WT.p = {v[1], v[2], v[3]};
    key.X_WT.q = Quat(v[4], v[5], v[6], v[7]);
    const double error = std::abs(key.X_WT.q.norm() - 1);
    if (!(error <= kUnitTolerance)) return "the quaternion qw,qx,qy,qz is not of unit length";
    if (error > kUnitExact) key.X_WT.q.normalize();
    return {};
}

}  // namespace

RecordedMotion::RecordedMotion(std::vector<MotionKey> keys) : keys_(std::move(keys)) {
    assert(!keys_.empty());
    assert(std::adjacent_find(keys_.begin(), keys_.end(),
                              [](const MotionKey& a, const MotionKey& b) { return !(a.t < b.t); }) == keys_.end());
}

Pose RecordedMotion::at(double t) const noexcept {
    const auto after =
        std::upper_bound(keys_.begin(), keys_.end(), t, [](double x, const MotionKey& k) { return x < k.t; });
    if (after == keys_.begin()) return keys_.front().X_WT;
    const MotionKey& a = *(after - 1);
    // At the time of a key, return its pose unchanged.
    if (after == keys_.end() || t == a.t) return a.X_WT;
    const double s = (t - a.t) / (after->t - a.t);
    return {a.X_WT.p + s * (after->X_WT.p - a.X_WT.p), a.X_WT.q.slerp(s, after->X_WT.q).normalized()};
}

RecordedMotion readMotion(const std::filesystem::path& file) {
    const auto fail = [&](int line, const std::string& what) {
        return std::runtime_error(file.string() + ":" + std::to_string(line) + ": " + what);
    };
    std::error_code error;
    if (std::filesystem::exists(file, error) && !std::filesystem::is_regular_file(file, error))
        throw std::runtime_error("cannot read the motion '" + file.string() +
                                 "': it is not a regular file; name a CSV file");
    std::ifstream in(file, std::ios::binary);
    if (!in)
        throw std::runtime_error("cannot read the motion '" + file.string() + "': check the path and its permissions");

    std::string line;
    if (!std::getline(in, line) || trimmed(line) != kHeader)
        throw fail(1, "a motion begins with the line " + std::string(kHeader));

    std::vector<MotionKey> keys;
    int blankAt = 0;
    for (int number = 2; std::getline(in, line); ++number) {
        const std::string_view row = trimmed(line);
        // Blank lines are accepted only at the end: in the middle, a blank line is more likely a lost row.
        if (row.empty()) {
            if (!blankAt) blankAt = number;
            continue;
        }
        if (blankAt) throw fail(blankAt, "blank line between rows: remove it");
        MotionKey key;
        if (const std::string wrong = readRow(row, key); !wrong.empty()) throw fail(number, wrong);
        if (!keys.empty() && !(key.t > keys.back().t))
            throw fail(number, "t_ms must be larger in each row than in the one before");
        keys.push_back(key);
    }
    if (in.bad()) throw std::runtime_error("cannot read the motion '" + file.string() + "' to its end");
    if (keys.empty()) throw fail(2, "a motion needs at least one row");
    return RecordedMotion(std::move(keys));
}

void writeMotion(const std::filesystem::path& file, std::span<const MotionKey> keys) {
    OutputFile out(file, "the motion");
    out.write(std::string(kHeader) + '\n');
    for (const MotionKey& key : keys) {
        const Vec3& p = key.X_WT.p;
        const Quat& q = key.X_WT.q;
        std::string row;
        for (const double v : {key.t, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()}) {
            char text[32];
            if (!row.empty()) row += ',';
            row.append(text, std::to_chars(text, std::end(text), v).ptr);
        }
        out.write(row + '\n');
    }
    out.close();
}

}  // namespace touchstone
