#include <catch2/catch.hpp>

#include <glm/gtc/matrix_transform.hpp>
#include <random>

#include "haptics/sandbox/scene/role.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::units_tests {

TEST_CASE("units: a meter is a thousand millimeters in both directions", "[sandbox]") {
    CHECK(sandbox::toMm({0.001, -2, 0.5}) == Vec3(1, -2000, 500));
    CHECK(sandbox::toMeters(Vec3(1, -2000, 500)) == glm::dvec3(0.001, -2, 0.5));
    CHECK(sandbox::toMeters(25.0) == 0.025);
}

TEST_CASE("units: a pose and its matrix map a point to the same place", "[sandbox]") {
    const unsigned seed = 7;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 100; ++i) {
        Pose pose{100 * Vec3(uniform(random), uniform(random), uniform(random)),
                  Quat(uniform(random), uniform(random), uniform(random), uniform(random)).normalized()};
        const Vec3 x(30 * uniform(random), 20, -7);
        const glm::dmat4 matrix = sandbox::toMatrix(pose);
        const glm::dvec3 meters = glm::dvec3(matrix * glm::dvec4(sandbox::toMeters(x), 1));
        // Rounding of a few products of numbers near 100.
        CHECK((sandbox::toMm(meters) - pose * x).norm() < 1e-11);
        const Pose back = sandbox::toPose(matrix);
        CHECK((back.p - pose.p).norm() < 1e-11);
        CHECK(std::abs(back.q.dot(pose.q)) == Approx(1).epsilon(1e-12));
    }
}

TEST_CASE("units: a matrix in the unit of a file has zeros where a quarter turn has them", "[sandbox]") {
    const double quarter = std::acos(0.0);  // whose cosine is 6e-17
    const Pose turned{Vec3(25.4, 0, 1e-14), Quat(Eigen::AngleAxisd(quarter, Vec3::UnitZ()))};
    sandbox::FileFrame inch;
    inch.unit = 0.0254;
    const auto rows = sandbox::matrixInFile(inch, turned);
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j) {
            constexpr double kWanted[4][4]{{0, -1, 0, 1}, {1, 0, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
            CHECK(rows[i][j] == Approx(kWanted[i][j]).margin(0));
        }
}

TEST_CASE("units: a pose contains no scale or mirroring", "[sandbox]") {
    glm::dmat4 matrix = glm::translate(glm::dmat4(1), {0.1, 0.2, 0.3});
    matrix = glm::rotate(matrix, 1.0, {0, 0, 1});
    const Pose pose = sandbox::toPose(glm::scale(matrix, {-2, 3, 0.5}));
    CHECK((pose.p - Vec3(100, 200, 300)).norm() < 1e-12);
    CHECK((pose.q * Vec3::UnitX() - Vec3(std::cos(1.0), std::sin(1.0), 0)).norm() < 1e-12);
}

}  // namespace touchstone::units_tests
