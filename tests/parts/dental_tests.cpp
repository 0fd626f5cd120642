#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/parts/mesh_checks.hpp"
#include "tools/parts/dental.hpp"
#include "tools/parts/scenes.hpp"

namespace touchstone::app::dental_tests {
namespace {

constexpr double kStored = 1e-5;  // mm: positions are stored as float, in meters

PocketFit pocket(double depth) {
    PocketFit fit;
    fit.depth = depth;
    fit.width = 1.4;
    return fit;
}

/// Some triangle reaches from below to above this height.
bool crossesHeight(const engine::MeshData& mesh, double y) {
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
        double low = 1e300, high = -1e300;
        for (std::size_t i = t; i < t + 3; ++i) {
            low = std::min(low, corner(mesh, i).y);
            high = std::max(high, corner(mesh, i).y);
        }
        if (low < y && y < high) return true;
    }
    return false;
}

}  // namespace

TEST_CASE("dental: tooth and gum are closed", "[parts]") {
    CHECK(isClosed(tooth()));
    CHECK(volume(tooth()) > 0);
    for (const double depth : {1.0, 2.0, 5.5, 8.0}) {
        const engine::MeshData mesh = gum(pocket(depth));
        INFO(depth << " mm");
        CHECK(isClosed(mesh));
        CHECK(volume(mesh) > 0);
    }
}

TEST_CASE("dental: the pocket has the given depth and width, the gap elsewhere those of the sulcus", "[parts]") {
    for (const double depth : {2.0, 5.5}) {
        const PocketFit fit = pocket(depth);
        const engine::MeshData mesh = gum(fit), crown = tooth();
        double margin = -1e300, sulcus = 0, bottomInner = 1e300, bottomOuter = -1e300;
        for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
            const glm::dvec3 p = corner(mesh, i);
            margin = std::max(margin, p.y);
            if (std::abs(p.z) > 1e-3) continue;
            if (std::abs(p.y + depth) < kStored && p.x > 0 && distanceTo(crown, p) < fit.bottomWidth + kStored) {
                bottomInner = std::min(bottomInner, p.x);
                bottomOuter = std::max(bottomOuter, p.x);
            }
            // Beside the tooth, where the gap ends on the other side.
            if (p.x < 0 && std::abs(p.y + fit.sulcus) < kStored) sulcus = p.y;
        }
        INFO(depth << " mm");
        CHECK(margin == Approx(0).margin(kStored));
        CHECK(sulcus == Approx(-fit.sulcus).margin(kStored));
        REQUIRE(bottomOuter > bottomInner);
        // From 0.05 inside the tooth over the whole width, which is measured horizontally: the root leans inwards.
        CHECK(bottomOuter - bottomInner == Approx(fit.bottomWidth + 0.05).margin(kStored));
        const double across = distanceTo(crown, {bottomOuter, -depth, 0});
        CHECK(across <= fit.bottomWidth);
        CHECK(across >= 0.98 * fit.bottomWidth);
    }
}

TEST_CASE("dental: the probe is closed, with black marks at each mm and three black bands", "[parts]") {
    const auto [metal, black] = periodontalProbe();
    engine::MeshData whole = metal;
    for (const std::uint32_t i : black.indices)
        whole.indices.push_back(i + static_cast<std::uint32_t>(metal.positions.size()));
    whole.positions.insert(whole.positions.end(), black.positions.begin(), black.positions.end());
    CHECK(isClosed(whole));
    for (int mm = 0; mm < 16; ++mm) {
        const bool band = mm == 4 || mm == 9 || mm == 14;
        INFO(mm << " mm");
        CHECK(crossesHeight(black, mm) == (mm > 0));
        CHECK(crossesHeight(black, mm + 0.5) == band);
        CHECK(crossesHeight(metal, mm + 0.5) == !band);
    }
}

TEST_CASE("dental: goal and gauge are at the pocket, and the hand moves beyond its bottom for 0.3 N", "[parts]") {
    SceneOptions options;
    options.pocket = pocket(5.5);
    options.pocket.stiffness = 300;
    const engine::Scene scene = makeDental(options);
    const auto marking = [&](std::size_t node) {
        return scene.registry.get<engine::NodeMarking>(scene.nodes.at(node)).extras->at("touchstone");
    };
    const auto height = [&](std::size_t node) {
        return 1000 * scene.registry.get<engine::LocalTransform>(scene.nodes.at(node)).translation.y;
    };
    CHECK(marking(0).at("stiffness_N_per_m") == 300);
    CHECK(marking(3).at("role") == "goal");
    CHECK(height(3) == Approx(-5.5));
    CHECK(marking(4).at("role") == "gauge");
    CHECK(height(4) == Approx(0).margin(1e-12));
    double lowest = 0;
    for (const auto& value : scene.animations.at(0).channels.at(0).values) lowest = std::min(lowest, 1000 * value.y);
    CHECK(lowest == Approx(-5.5 - 0.3 / 0.3));
}

TEST_CASE("dental: dimensions without a pocket for the probe are refused in one sentence", "[parts]") {
    PocketFit fit;
    fit.depth = 0.8;  // the gap around is 1 mm
    CHECK_THROWS_WITH(gum(fit), Catch::Contains("sulcus"));
    fit = {};
    fit.bottomWidth = 0.5;
    CHECK_THROWS_WITH(gum(fit), Catch::Contains("wider than the probe's tip"));
    fit = pocket(5.5);
    fit.width = 0.65;
    CHECK_THROWS_WITH(gum(fit), Catch::Contains("wider or less deep"));
    fit = {};
    fit.stiffness = 0;
    CHECK_THROWS_WITH(gum(fit), Catch::Contains("stiffness"));
}

}  // namespace touchstone::app::dental_tests
