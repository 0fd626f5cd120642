// Mates found from surfaces that are written down here; those of STEP files are tried with the program.
#include <algorithm>
#include <catch2/catch.hpp>
#include <glm/gtc/quaternion.hpp>
#include <tuple>

#include "haptics/sandbox/scene/mates.hpp"
#include "tests/sandbox/scene/cad_solids.hpp"

namespace touchstone {
namespace {

using sandbox::MateConstraints;
using sandbox::MatePart;
using sandbox::MateProposal;

constexpr double kNm = 1e-9;  // m: rounding of places of some cm

std::optional<MateProposal> mate(const CadSolid& tool, const CadSolid& obstacle,
                                 const glm::dmat4& toolPlace = glm::dmat4(1),
                                 const glm::dmat4& obstaclePlace = glm::dmat4(1), const MateConstraints& given = {}) {
    const MatePart parts[]{{"tool", &tool.shape, toolPlace}, {"block", &obstacle.shape, obstaclePlace}};
    return sandbox::proposeMate({parts, 1}, {parts + 1, 1}, given);
}

bool says(const std::vector<std::string>& lines, const std::string& part) {
    return std::ranges::any_of(lines, [&](const std::string& line) { return line.find(part) != std::string::npos; });
}

glm::dvec3 moved(const MateProposal& proposal, const glm::dvec3& p) {
    return proposal.pose.translation + proposal.pose.rotation * p;
}

/// A shaft below a shoulder at z = 0, 20 mm long.
CadSolid shaft(double diameter) {
    CadSolid made;
    const double r = diameter / 2;
    return made.cylinder(r, -20, 0, false)
        .ring(0, r, -20, false)
        .ring(r, 1.5 * r, 0, false)
        .cylinder(1.5 * r, 0, 8, false)
        .ring(0, 1.5 * r, 8, true);
}

/// A cylinder of 60 mm below z = 0 with a hole; of a blind one the floor lies `deep` below.
CadSolid holed(double diameter, double deep = 0) {
    CadSolid made;
    const double r = diameter / 2;
    made.ring(r, 30, 0, true).cylinder(30, -30, 0, false);
    if (deep > 0) return made.cylinder(r, -deep, 0, true).ring(0, r, -deep, true).ring(0, 30, -30, false);
    return made.cylinder(r, -30, 0, true).ring(r, 30, -30, false);
}

TEST_CASE("mates: a shaft modeled in its hole stays there", "[mates]") {
    const auto found = mate(shaft(20), holed(20.01));
    REQUIRE(found);
    CHECK(found->modeled);
    CHECK(found->out == glm::dvec3(0, 0, 1));
    CHECK(found->fold == 0);
    CHECK(found->lead == 0);
    CHECK(found->clearance == Approx(0.005e-3).margin(kNm));
    CHECK(says(found->reasons, "the shaft of 20.000 mm goes into the hole of 20.010 mm of \"block\", 20.000 mm deep"));
    CHECK(says(found->reasons, "its shoulder meets a face of \"block\""));
    CHECK(found->doubts.empty());
}

TEST_CASE("mates: a shaft modeled elsewhere goes into its hole up to the shoulder", "[mates]") {
    // Turned, aside, upside down and far away: the shoulder always ends in the plane z = 0 of the block.
    for (const glm::dmat4& place :
         {placement({100, 20, 30}), placement({0, 0, 200}, {180, 0, 0}), placement({-50, 300, 2}, {40, -70, 10})})
        for (const glm::dmat4& block : {glm::dmat4(1), placement({7, -9, 400}, {0, 90, 15})}) {
            const auto found = mate(shaft(20), holed(20.01), place, block);
            REQUIRE(found);
            CHECK_FALSE(found->modeled);
            const glm::dvec3 out(block * glm::dvec4(0, 0, 1, 0));
            const glm::dvec3 shoulder = moved(*found, glm::dvec3(place * glm::dvec4(0, 0, 0, 1)));
            const glm::dvec3 tip = moved(*found, glm::dvec3(place * glm::dvec4(0, 0, -0.02, 1)));
            // The hole goes through, and both of its ends look alike.
            const glm::dvec3 end =
                glm::dot(found->out, out) > 0 ? glm::dvec3(block[3]) : glm::dvec3(block * glm::dvec4(0, 0, -0.03, 1));
            CHECK(glm::length(glm::cross(found->out, out)) < 1e-12);
            CHECK(glm::length(shoulder - end) < kNm);
            CHECK(glm::length(shoulder - tip - 0.02 * found->out) < kNm);
        }
}

TEST_CASE("mates: the tool stops at the floor of a blind hole", "[mates]") {
    const auto found = mate(shaft(12), holed(12.02, 15), placement({0, 0, 80}));
    REQUIRE(found);
    CHECK(glm::length(moved(*found, {0, 0, 0.06}) - glm::dvec3(0, 0, -0.015)) < kNm);
    CHECK(says(found->reasons, "its end meets a face"));
}

TEST_CASE("mates: of several holes the one that fits closest is taken, of equal ones the nearest", "[mates]") {
    CadSolid plate;
    plate.ring(0, 100, 0, true);
    for (const auto& [r, x] : {std::pair(10.5, 0.0), std::pair(10.01, 40.0), std::pair(10.01, 80.0)})
        plate.cylinder(r, -20, 0, true, x);
    const auto found = mate(shaft(20), plate, placement({75, 0, 50}));
    REQUIRE(found);
    CHECK(found->point.x == Approx(0.080));
}

TEST_CASE("mates: a hole of the tool goes over a shaft of the obstacle", "[mates]") {
    CadSolid sleeve, pin;
    sleeve.cylinder(10.02, 0, 15, true).cylinder(14, 0, 15, false).ring(10.02, 14, 0, false).ring(10.02, 14, 15, true);
    pin.cylinder(10, 0, 40, false).ring(0, 10, 40, true).ring(10, 50, 0, true);
    const auto found = mate(sleeve, pin, placement({100, 0, 0}));
    REQUIRE(found);
    CHECK(says(found->reasons, "the hole of 20.040 mm goes over the shaft of 20.000 mm"));
    CHECK(glm::length(moved(*found, {0.1, 0, 0})) < kNm);  // its lower end on the plate
}

TEST_CASE("mates: a cone stops in its seat", "[mates]") {
    CadSolid screw, plate;  // countersunk by 90°; the head is flush with the plate
    screw.cylinder(4, -20, -4, false).cone(4, -4, 8, 0, false).ring(0, 8, 0, true).ring(0, 4, -20, false);
    plate.cylinder(4.1, -30, -3.9, true).cone(4.1, -3.9, 8, 0, true).ring(8, 40, 0, true).ring(4.1, 40, -30, false);
    const auto found = mate(screw, plate, placement({0, 0, 60}));
    REQUIRE(found);
    CHECK(says(found->reasons, "its cone meets that of \"block\""));
    CHECK(glm::length(moved(*found, {0, 0, 0.06})) < kNm);
}

/// Adds keys to a shaft, or their slots to a hole: planes at both sides of each.
void addKeys(CadSolid& solid, int count, double half, bool hollow, double turn = 0) {
    for (int i = 0; i < count; ++i)
        for (const double side : {-90.0, 90.0})
            solid.flat(turn + 360.0 * i / count + side + (hollow ? 180 : 0), hollow ? -half : half, 3, -20, 0);
}

TEST_CASE("mates: keys say the turn and the fold", "[mates]") {
    for (const int keys : {1, 2, 6}) {
        CAPTURE(keys);
        CadSolid tool = shaft(20), hub = holed(20.02);
        // A plane at both sides of a key has its middle off the axis, so that one key has one orientation.
        for (int i = 0; i < keys; ++i) {
            tool.flat(360.0 * i / keys, 11, 4, -20, 0);
            hub.flat(360.0 * i / keys + 190, -11.01, 4, -30, 0);
        }
        addKeys(tool, keys, 2, false);
        addKeys(hub, keys, 2.01, true, 10);
        const auto found = mate(tool, hub, placement({0, 0, 90}));
        REQUIRE(found);
        CHECK(found->fold == keys);
        CHECK(found->doubts.empty());
        const glm::dvec3 key = found->pose.rotation * glm::dvec3(1, 0, 0);
        const double angle = std::remainder(glm::degrees(std::atan2(key.y, key.x)) - 10, 360.0 / keys);
        CHECK(angle == Approx(0).margin(1e-6));
    }
}

TEST_CASE("mates: parts without a round face meet by their sides", "[mates]") {
    CadSolid peg, block;
    for (const auto& [degrees, apart, wide] :
         {std::tuple(0, 14.0, 20.0), {90, 20.0, 14.0}, {180, 14.0, 20.0}, {270, 20.0, 14.0}}) {
        peg.flat(degrees, apart / 2, wide, -25, 0);
        block.flat(degrees + 180, -apart / 2 - 0.05, wide + 0.1, -25, 0).flat(degrees, 40, 80, -25, 0);
    }
    peg.rectangle(14, 20, -25, false);
    block.rectangle(80, 80, -25, true);  // the floor
    const auto found = mate(peg, block, placement({100, 30, 40}, {20, 0, 50}));
    REQUIRE(found);
    CHECK(found->fold == 2);
    CHECK(found->clearance == Approx(0.05e-3).margin(kNm));
    CHECK(says(found->reasons, "sides 14.000 mm apart go between those 14.100 mm apart of \"block\""));
    CHECK(says(found->reasons, "4 faces along the axis meet theirs in 2 turns"));
    const glm::dvec3 tip(placement({100, 30, 40}, {20, 0, 50}) * glm::dvec4(0, 0, -0.025, 1));
    CHECK(glm::length(moved(*found, tip) - glm::dvec3(0, 0, -0.025)) < kNm);
}

TEST_CASE("mates: a hole's end that has a chamfer is preferred", "[mates]") {
    CadSolid plate;
    plate.ring(10.01, 30, 0, true)
        .cylinder(10.01, -29, 0, true)
        .cone(10.01, -30, 11.01, -29, true)
        .ring(11.01, 30, -30, false);
    plate.shape.faces[2].axis = {0, 0, -1};  // it widens downward
    plate.shape.faces[2].radius = 11.01e-3;
    plate.shape.faces[2].from = -1e-3;
    plate.shape.faces[2].to = 0;
    const auto found = mate(shaft(20), plate, placement({0, 0, 60}));
    REQUIRE(found);
    CHECK(found->out == glm::dvec3(0, 0, -1));
}

TEST_CASE("mates: threads of one lead mate, left and right do not", "[mates]") {
    CadSolid bolt, nut, left;
    bolt.thread(7.9, 6.8, 2, 0, 24, false).ring(0, 6.8, 24, true).ring(6.8, 12, 0, true);
    nut.thread(8, 6.9, 2, 0, 8, true).ring(8, 12, 8, true).ring(8, 12, 0, false);
    left.thread(8, 6.9, -2, 0, 8, true).ring(8, 12, 8, true).ring(8, 12, 0, false);
    const auto found = mate(nut, bolt, placement({50, 0, 0}, {90, 0, 0}));
    REQUIRE(found);
    CHECK(found->lead == Approx(0.002));
    CHECK(
        says(found->reasons, "the tool and \"block\" have a right-handed thread of 2.000 mm per turn, 8.000 mm deep"));
    CHECK_FALSE(mate(left, bolt));
    // A mirrored nut has a left-handed thread.
    CHECK_FALSE(mate(nut, bolt, glm::scale(glm::dmat4(1), {-1, 1, 1})));
    CHECK(mate(left, bolt, glm::scale(glm::dmat4(1), {-1, 1, 1})));
}

TEST_CASE("mates: what is given is not searched", "[mates]") {
    MateConstraints given;
    given.out = glm::dvec3(0, 0, -1);
    const auto below = mate(shaft(20), holed(20.01), placement({0, 0, 50}), glm::dmat4(1), given);
    REQUIRE(below);
    CHECK(below->out == glm::dvec3(0, 0, -1));
    given = {MateConstraints::Tool::AtGoal, {}, 0};
    CHECK_FALSE(mate(shaft(20), holed(20.01), placement({0, 0, 50}), glm::dmat4(1), given));
    given.tool = MateConstraints::Tool::OnAxis;
    CHECK_FALSE(mate(shaft(20), holed(20.01), placement({1, 0, 50}), glm::dmat4(1), given));
    const auto slid = mate(shaft(20), holed(20.01), placement({0, 0, 50}), glm::dmat4(1), given);
    REQUIRE(slid);
    CHECK(glm::length(slid->pose.translation - glm::dvec3(0, 0, -0.05)) < kNm);
    // A thread that is drawn as a cylinder in a hole of its core.
    CHECK_FALSE(mate(shaft(5), holed(4.2), placement({0, 0, 50})));
    given = {MateConstraints::Tool::Anywhere, {}, 0.8e-3};
    const auto screwed = mate(shaft(5), holed(4.2), placement({0, 0, 50}), glm::dmat4(1), given);
    REQUIRE(screwed);
    CHECK(screwed->lead == 0.8e-3);
    CHECK(says(screwed->doubts, "is drawn thicker than its hole"));
}

TEST_CASE("mates: what does not fit has none", "[mates]") {
    CHECK_FALSE(mate(shaft(20), holed(19.8)));  // thicker
    CHECK_FALSE(mate(shaft(20), holed(23)));    // loose
    CHECK_FALSE(mate(shaft(20), shaft(20)));    // no hole
    CHECK_FALSE(mate(CadSolid(), holed(20)));   // nothing
    CHECK_FALSE(mate(shaft(20).cylinder(4, 0, 1, true), CadSolid()));
}

}  // namespace
}  // namespace touchstone
