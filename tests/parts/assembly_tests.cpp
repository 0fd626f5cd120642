#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "tests/parts/mesh_checks.hpp"
#include "tools/parts/bayonet.hpp"
#include "tools/parts/gears.hpp"
#include "tools/parts/hook.hpp"
#include "tools/parts/lock.hpp"
#include "tools/parts/shapes.hpp"
#include "tools/parts/wire.hpp"

namespace touchstone::app::assembly_tests {
namespace {

constexpr double kPi = std::numbers::pi;

struct Meeting {
    double nearest = 1e300;  ///< smallest distance of a vertex of one part from the surface of the other, mm
    bool inside = false;     ///< a vertex of one part is inside the other
};

/// Compares the parts with one of them lifted along y and turned about it, using every `stride`th of its vertices.
Meeting meet(const engine::MeshData& part, double y, double angle, const engine::MeshData& fixed,
             std::size_t stride = 1) {
    Meeting meeting;
    for (std::size_t i = 0; i < part.positions.size(); i += stride) {
        const glm::dvec3 p = 1000.0 * glm::dvec3(part.positions[i]);
        const glm::dvec3 at(p.x * std::cos(angle) + p.z * std::sin(angle), p.y + y,
                            p.z * std::cos(angle) - p.x * std::sin(angle));
        meeting.nearest = std::min(meeting.nearest, distanceTo(fixed, at));
        meeting.inside = meeting.inside || isInside(fixed, at);
    }
    return meeting;
}

}  // namespace

TEST_CASE("wire: closed, with the volume of a bent cylinder with round ends, or of a ring", "[parts]") {
    const glm::dvec3 line[] = {{0, 0, 0}, {0, 10, 0}, {0, 30, 0}};
    const engine::MeshData straight = wire(line, 2, false, 0.5);
    CHECK(isClosed(straight));
    CHECK(volume(straight) == Approx(kPi * 4 * 30 + 4 * kPi / 3 * 8).epsilon(0.03));  // inscribed chords

    auto points = arc({}, {0, 1, 0}, {0, 0, 1}, 13, 0, 2 * kPi, 0.5);
    points.pop_back();
    const engine::MeshData ring = wire(points, 2.5, true, 0.5);
    CHECK(isClosed(ring));
    CHECK(volume(ring) == Approx(2 * kPi * 13 * kPi * 2.5 * 2.5).epsilon(0.02));
}

TEST_CASE("wire: a bend with a radius below the wire's is refused", "[parts]") {
    CHECK_THROWS_WITH(wire(arc({}, {1, 0, 0}, {0, 1, 0}, 2, 0, 3, 0.2), 2.5, false, 1), Catch::Contains("sharply"));
    CHECK_THROWS_WITH(wire({}, 1, false, 1), Catch::Contains("two points"));
}

TEST_CASE("hook and eye: closed, and the hanging hook touches the ring", "[parts]") {
    HookAndEye fit;
    const engine::MeshData tool = hook(fit), ring = eyeRing(fit);
    CHECK(isClosed(tool));
    CHECK(isClosed(ring));
    CHECK(isClosed(eyeStem(fit)));
    // Chords of both wires and both bends.
    CHECK(meet(tool, fit.hung(), 0, ring).nearest == Approx(0).margin(4 * kChordError));
    CHECK(meet(tool, fit.hung() + 1, 0, ring).inside);  // it cannot be pulled further up
    CHECK_FALSE(meet(tool, fit.hung() - 1, 0, ring).inside);
}

TEST_CASE("gears: closed, with the given tooth count and circles", "[parts]") {
    GearPair fit;
    CHECK(isClosed(looseGear(fit)));
    CHECK(isClosed(fixedGear(fit)));
    CHECK(isClosed(gearPost(fit)));
    for (const int teeth : {fit.looseTeeth, fit.fixedTeeth, 60}) {  // 60: the base circle is inside the root circle
        const double pitch = fit.module * teeth / 2;
        int crossings = 0;
        double least = 1e300, most = 0;
        const Outline profile = gearProfile(fit, teeth);
        for (std::size_t i = 0; i < profile.size(); ++i) {
            const double here = glm::length(profile[i]), next = glm::length(profile[(i + 1) % profile.size()]);
            crossings += here < pitch && next >= pitch;
            least = std::min(least, here), most = std::max(most, here);
        }
        INFO(teeth);
        CHECK(crossings == teeth);
        CHECK(most == Approx(pitch + fit.module));
        CHECK(least == Approx(pitch - 1.25 * fit.module).margin(kChordError));
    }
    CHECK_THROWS_WITH(gearProfile(fit, 3), Catch::Contains("four teeth"));
    fit.clearance = 4;
    CHECK_THROWS_WITH(gearProfile(fit, 15), Catch::Contains("point"));
}

TEST_CASE("gears: involute teeth roll at the same clearance in every phase", "[parts]") {
    GearPair fit;
    fit.spacing = 0.1;
    const int loose = GENERATE(15, 16);
    fit.looseTeeth = loose;
    const Outline fixed = gearProfile(fit, fit.fixedTeeth), other = gearProfile(fit, loose);
    for (int phase = 0; phase < 7; ++phase) {
        const double roll = 2 * kPi / fit.fixedTeeth * phase / 7, back = meshAngle(fit) - roll * fit.fixedTeeth / loose;
        const auto turned = [](glm::dvec2 p, double a) {
            return glm::dvec3(p.x * std::cos(a) - p.y * std::sin(a), 0, p.x * std::sin(a) + p.y * std::cos(a));
        };
        double nearest = 1e300;
        for (const glm::dvec2& p : other) {
            const glm::dvec3 at = turned(p, back) + glm::dvec3(fit.distance(), 0, 0);
            for (std::size_t i = 0; i < fixed.size(); ++i)
                nearest = std::min(nearest, distanceToSegment(at, turned(fixed[i], roll),
                                                              turned(fixed[(i + 1) % fixed.size()], roll)));
        }
        INFO("phase " << phase);
        CHECK(nearest == Approx(fit.clearance).margin(0.01));  // points and chords 0.1 mm long
    }
}

TEST_CASE("bayonet: the lugs keep their clearance along the slot, and the pocket holds them", "[parts]") {
    BayonetFit fit;
    fit.spacing = 3;
    const engine::MeshData cap = bayonetCap(fit), holder = bayonetHolder(fit);
    REQUIRE(isClosed(cap));
    REQUIRE(isClosed(holder));
    const double way = -fit.depth + fit.clearance;  // half way between the slot's floor and roof
    const auto clear = [&](double y, double angle) {
        const Meeting meeting = meet(cap, y, angle, holder);
        INFO("height " << y << ", angle " << angle);
        CHECK_FALSE(meeting.inside);
        // Chords of body and bore, which no longer match after a turn.
        CHECK(meeting.nearest == Approx(fit.clearance).margin(2 * kChordError));
    };
    clear(-4, 0);
    clear(way, 0);
    clear(way, -fit.turn / 2);
    clear(way, -fit.turn);
    clear(fit.locked() - fit.clearance, -fit.turn);
    CHECK(meet(cap, fit.locked(), -fit.turn, holder).nearest < 1e-4);
    CHECK(meet(cap, fit.locked() + 0.2, -fit.turn, holder).inside);                  // a pull
    CHECK(meet(cap, fit.locked() - fit.clearance, -fit.turn + 0.1, holder).inside);  // a twist back
    CHECK(meet(cap, -1, 0.4, holder).inside);                                        // beside the slots
}

TEST_CASE("bayonet: impossible dimensions are refused in one sentence", "[parts]") {
    BayonetFit fit;
    fit.rise = 7;
    CHECK_THROWS_WITH(bayonetHolder(fit), Catch::Contains("rim"));
    fit = {};
    fit.lugs = 5;
    CHECK_THROWS_WITH(bayonetHolder(fit), Catch::Contains("run into each other"));
    fit = {};
    fit.turn = 0;
    CHECK_THROWS_WITH(bayonetCap(fit), Catch::Contains("more than 0"));
}

TEST_CASE("lock: the key turns only at home", "[parts]") {
    LockFit fit;
    fit.spacing = 3;
    const engine::MeshData tool = key(fit), body = lock(fit);
    REQUIRE(isClosed(tool));
    REQUIRE(isClosed(body));
    const double free = fit.home() + fit.play() / 2;
    for (const double angle : {0.0, -0.5, -fit.turn}) {
        INFO("turned by " << angle);
        const Meeting meeting = meet(tool, free, angle, body);
        CHECK_FALSE(meeting.inside);
        CHECK(meeting.nearest == Approx(fit.clearance).margin(2 * kChordError));
    }
    for (const double shortOfHome : {1.0, 2.0, 5.0, 9.0}) {
        INFO(shortOfHome << " mm short of home");
        CHECK_FALSE(meet(tool, fit.home() + shortOfHome, 0, body).inside);
        CHECK(meet(tool, fit.home() + shortOfHome, -0.3, body).inside);
    }
    CHECK(meet(tool, free, -fit.turn - 0.1, body).inside);      // beyond the stop
    CHECK(meet(tool, fit.home() + 1, -fit.turn, body).inside);  // pulled out while turned
}

TEST_CASE("lock: impossible dimensions are refused in one sentence", "[parts]") {
    LockFit fit;
    fit.wardReach = 11;
    CHECK_THROWS_WITH(key(fit), Catch::Contains("ward"));
    fit = {};
    fit.wardWidth = 8.5;
    CHECK_THROWS_WITH(lock(fit), Catch::Contains("narrower"));
    fit = {};
    fit.turn = 3;
    CHECK_THROWS_WITH(lock(fit), Catch::Contains("2.5"));
}

}  // namespace touchstone::app::assembly_tests
