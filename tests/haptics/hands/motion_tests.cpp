#include "haptics/hands/motion.hpp"

#include <unistd.h>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>

namespace touchstone::motion_tests {

using Catch::Matchers::Contains;

namespace {

/// A temporary file, removed with the test.
class TemporaryFile {
  public:
    explicit TemporaryFile(const std::string& text = {})
        : path_(std::filesystem::temp_directory_path() / ("touchstone-motion-" + std::to_string(getpid()) + ".csv")) {
        std::ofstream(path_, std::ios::binary) << text;
    }
    ~TemporaryFile() { std::filesystem::remove(path_); }
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

const std::string kHeader = "t_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz\n";

RecordedMotion read(const std::string& text) { return readMotion(TemporaryFile(text).path()); }

Quat aboutZ(double angle) { return Quat(std::cos(angle / 2), 0, 0, std::sin(angle / 2)); }

}  // namespace

TEST_CASE("motion: moves in straight lines, turns at constant speed, and holds its end poses", "[motion]") {
    const RecordedMotion motion({{0, {{1, 2, 3}, Quat::Identity()}}, {10, {{3, 2, -1}, aboutZ(1)}}});
    CHECK(motion.duration() == 10);
    const Pose middle = motion.at(2.5);
    CHECK((middle.p - Vec3(1.5, 2, 2)).norm() < 1e-15);
    CHECK(middle.q.angularDistance(aboutZ(0.25)) < 1e-7);  // acos near 1 loses half the digits
    for (const double before : {-5.0, 0.0}) CHECK(motion.at(before).p == Vec3(1, 2, 3));
    for (const double after : {10.0, 1e9}) CHECK(motion.at(after).p == Vec3(3, 2, -1));
}

TEST_CASE("motion: a turn takes the shorter path even if the quaternions differ in sign", "[motion]") {
    Quat opposite = aboutZ(0.4);
    opposite.coeffs() *= -1;
    const RecordedMotion motion({{0, {{0, 0, 0}, Quat::Identity()}}, {1, {{0, 0, 0}, opposite}}});
    CHECK(logRotation(motion.at(0.5).q).isApprox(Vec3(0, 0, 0.2), 1e-12));
}

TEST_CASE("motion: a written motion is read back with the same bits", "[motion]") {
    const unsigned seed = std::random_device{}();
    INFO("seed " << seed);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::vector<MotionKey> keys;
    double t = 0;
    for (int i = 0; i < 500; ++i) {
        t += 0.001 + std::abs(normal(random));
        keys.push_back({t,
                        {{normal(random), 1e6 * normal(random), 1e-9 * normal(random)},
                         Quat(normal(random), normal(random), normal(random), normal(random)).normalized()}});
    }
    const TemporaryFile file;
    writeMotion(file.path(), keys);
    const RecordedMotion motion = readMotion(file.path());
    REQUIRE(motion.keys().size() == keys.size());
    for (std::size_t i = 0; i < keys.size(); ++i) {
        REQUIRE(motion.keys()[i].t == keys[i].t);
        REQUIRE(motion.keys()[i].X_WT.p == keys[i].X_WT.p);
        REQUIRE(motion.keys()[i].X_WT.q.coeffs() == keys[i].X_WT.q.coeffs());
        REQUIRE(motion.at(keys[i].t).q.coeffs() == keys[i].X_WT.q.coeffs());
    }
}

TEST_CASE("motion: reads line ends of other systems, spaces, and blank lines at the end", "[motion]") {
    const RecordedMotion motion =
        read("t_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz\r\n0, 1,2 ,3,1,0,0,0\r\n2.5,1e1,-2,3,1,0,0,0\r\n\r\n\r\n");
    REQUIRE(motion.keys().size() == 2);
    CHECK(motion.keys()[1].t == 2.5);
    CHECK(motion.keys()[1].X_WT.p == Vec3(10, -2, 3));
    CHECK(read(kHeader + "0,0,0,0,1,0,0,0").keys().size() == 1);  // no newline at the end
    CHECK(read(kHeader + "0,0,0,0,1.0009,0,0,0\n").keys()[0].X_WT.q.norm() == Approx(1).epsilon(1e-15));
}

TEST_CASE("motion: an unreadable file is refused by name and line", "[motion]") {
    const auto row = [](const std::string& text) { return kHeader + "0,0,0,0,1,0,0,0\n" + text; };
    CHECK_THROWS_WITH(read(""), Contains(":1: a motion begins with the line t_ms,"));
    CHECK_THROWS_WITH(read("0,0,0,0,1,0,0,0\n"), Contains(":1: a motion begins"));
    CHECK_THROWS_WITH(read(kHeader), Contains(":2: a motion needs at least one row"));
    CHECK_THROWS_WITH(read(row("1,0,0,0,1,0,0\n")), Contains(":3: a row needs 8 numbers"));
    CHECK_THROWS_WITH(read(row("1,0,0,0,1,0,0,0,0\n")), Contains(":3: a row needs 8 numbers"));
    CHECK_THROWS_WITH(read(row("1,0,zero,0,1,0,0,0\n")), Contains(":3: 'zero' is not a finite number"));
    CHECK_THROWS_WITH(read(row("1,0,,0,1,0,0,0\n")), Contains(":3: '' is not a finite number"));
    CHECK_THROWS_WITH(read(row("1,0,nan,0,1,0,0,0\n")), Contains(":3: 'nan' is not"));
    CHECK_THROWS_WITH(read(row("1,0,inf,0,1,0,0,0\n")), Contains(":3: 'inf' is not"));
    CHECK_THROWS_WITH(read(row("1,0,1e999,0,1,0,0,0\n")), Contains(":3: '1e999' is not"));
    CHECK_THROWS_WITH(read(row("0,0,0,0,1,0,0,0\n")), Contains(":3: t_ms must be larger"));
    CHECK_THROWS_WITH(read(row("1,0,0,0,1.002,0,0,0\n")), Contains(":3: the quaternion"));
    CHECK_THROWS_WITH(read(row("1,0,0,0,0,0,0,0\n")), Contains(":3: the quaternion"));
    CHECK_THROWS_WITH(read(row("\n1,0,0,0,1,0,0,0\n")), Contains(":3: blank line between rows"));
    CHECK_THROWS_WITH(readMotion("/nowhere/motion.csv"), Contains("'/nowhere/motion.csv'"));
    CHECK_THROWS_WITH(readMotion(std::filesystem::temp_directory_path()), Contains("cannot read the motion"));
    CHECK_THROWS_WITH(writeMotion("/nowhere/motion.csv", {}),
                      Contains("cannot write the motion to '/nowhere/motion.csv': No such file or directory"));
}

}  // namespace touchstone::motion_tests
