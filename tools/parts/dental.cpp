#include "tools/parts/dental.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "tools/parts/angles.hpp"
#include "tools/parts/planar.hpp"
#include "tools/parts/scene_kit.hpp"
#include "tools/parts/scenes.hpp"
#include "tools/parts/solid.hpp"

namespace touchstone::app {
namespace {

using nlohmann::json;

constexpr double kDegree = kTau / 360;

/// Points around an axis, counter-clockwise seen from its end; all at the same place at an apex.
using Ring = std::vector<glm::dvec3>;

/// The surface through rings of equal point counts, facing as in addWall().
void loft(Solid& solid, const Ring& from, const Ring& to) {
    for (std::size_t i = 0, n = from.size(); i < n; ++i) {
        const std::size_t j = (i + 1) % n;
        solid.add(from[i], from[j], to[j]);
        solid.add(from[i], to[j], to[i]);
    }
}

// The tooth: horizontal sections are ellipses, longer along z.
constexpr int kAround = 96;
constexpr double kLengthwise = 1.2;  // ratio of the half axes along z and x

/// Half axis along x (.x) against height (.y), from the root's end to the middle of the crown, at most 0.3 mm apart.
const std::vector<glm::dvec2>& toothProfile() {
    static const std::vector<glm::dvec2> profile = [] {
        constexpr glm::dvec2 kPoints[]{{-0.7, -11.8}, {0, -12}, {0.7, -11.8}, {1.5, -10.8}, {2.2, -8.5}, {2.75, -5.5},
                                       {3.0, -3},     {3.2, 0}, {3.4, 1.7},   {3.5, 3.5},   {3.3, 5.5},  {2.7, 6.9},
                                       {1.9, 7.3},    {1, 6.9}, {0, 6.7},     {-1, 6.9}};
        std::vector<glm::dvec2> points{kPoints[1]};
        for (std::size_t i = 1; i + 2 < std::size(kPoints); ++i) {  // a Catmull-Rom spline
            const glm::dvec2 &a = kPoints[i - 1], &b = kPoints[i], &c = kPoints[i + 1], &d = kPoints[i + 2];
            const int pieces = static_cast<int>(std::ceil(glm::distance(b, c) / 0.25));
            for (int k = 1; k <= pieces; ++k) {
                const double t = double(k) / pieces;
                points.push_back(0.5 * (2.0 * b + t * (c - a) + t * t * (2.0 * a - 5.0 * b + 4.0 * c - d) +
                                        t * t * t * (3.0 * (b - c) + d - a)));
            }
        }
        points.back().x = 0;
        return points;
    }();
    return profile;
}

/// Half axis along x at a height between the root's end and the crown's edge.
double toothRadius(double y) {
    const std::vector<glm::dvec2>& profile = toothProfile();
    const auto above = std::ranges::find_if(profile, [&](const glm::dvec2& p) { return p.y >= y; });
    const glm::dvec2 a = *(above - 1), b = *above;
    return glm::mix(a.x, b.x, (y - a.y) / (b.y - a.y));
}

glm::dvec3 onTooth(double radius, double y, double angle) {
    return {radius * std::cos(angle), y, -kLengthwise * radius * std::sin(angle)};
}

/// The horizontal normal of the tooth's section.
glm::dvec3 outward(double angle) {
    return glm::normalize(glm::dvec3(kLengthwise * std::cos(angle), 0, -std::sin(angle)));
}

/// The point at a distance from the tooth in a horizontal plane.
glm::dvec3 besideTooth(double away, double y, double angle) {
    return onTooth(toothRadius(y), y, angle) + away * outward(angle);
}

double depthAt(const PocketFit& fit, double angle) {
    constexpr double kBegins = 50 * kDegree, kFull = 25 * kDegree;
    const double off = std::abs(std::remainder(angle, kTau));
    const double t = std::clamp((kBegins - off) / (kBegins - kFull), 0.0, 1.0);
    return glm::mix(fit.sulcus, fit.depth, t * t * (3 - 2 * t));
}

// The probe, by the arc length s along its axis.
constexpr double kMarked = 15;

double probeRadius(double s) { return glm::mix(kTipRadius, 0.5, (s - kTipRadius) / (kMarked - kTipRadius)); }

bool isBlack(double s) {
    if (s < 0.5 || s > kMarked + 0.1) return false;
    return std::abs(s - std::round(s)) < 0.1 || static_cast<int>(s) % 5 == 4;
}

struct Station {
    double s, radius;
};

std::vector<Station> probeStations() {
    std::vector<Station> stations;
    constexpr int kTip = 6;
    for (int i = 0; i <= kTip; ++i) {
        const double angle = kTau / 4 * i / kTip;
        stations.push_back({kTipRadius * (1 - std::cos(angle)), kTipRadius * std::sin(angle)});
    }
    for (int mm = 1; mm <= kMarked; ++mm)
        for (const double s : {mm - 0.1, mm + 0.1}) stations.push_back({s, probeRadius(s)});
    for (double s = 16; s < 26; s += 0.5) stations.push_back({s, probeRadius(s) + 0.015 * (s - 16)});
    for (const Station& handle : {Station{26, 0.9},
                                  {26.5, 1.1},
                                  {27.2, 1.6},
                                  {28, 1.8},
                                  {32, 1.8},
                                  {36, 1.8},
                                  {36.6, 1.6},
                                  {36.9, 1.1},
                                  {37, 0}})
        stations.push_back(handle);
    return stations;
}

/// Around the probe's axis, which bends in the xy plane.
Ring probeRing(const Station& station) {
    constexpr double kBendFrom = 17, kBendRadius = 8, kBend = 45 * kDegree;
    const double turned = std::clamp((station.s - kBendFrom) / kBendRadius, 0.0, kBend);
    const double before = std::min(station.s, kBendFrom);
    const double after = std::max(0.0, station.s - kBendFrom - kBendRadius * kBend);
    const glm::dvec3 along(std::sin(turned), std::cos(turned), 0), across(along.y, -along.x, 0);
    const glm::dvec3 center =
        glm::dvec3(0, before, 0) + kBendRadius * glm::dvec3(1 - std::cos(turned), std::sin(turned), 0) + after * along;
    constexpr int kSides = 32;
    Ring ring;
    for (int i = 0; i < kSides; ++i) {
        const double angle = kTau * i / kSides;
        ring.push_back(center + station.radius * (std::cos(angle) * across - std::sin(angle) * glm::dvec3(0, 0, 1)));
    }
    return ring;
}

/// The distance of the probe's axis from the tooth's axis at the bottom of the pocket.
double atBottom(const PocketFit& fit) { return toothRadius(-fit.depth) + fit.bottomWidth / 2; }

/// The angle by which the probe leans out in the pocket so that its flank clears root and crown, rad.
double leaning(const PocketFit& fit) {
    constexpr double kRoom = 0.03;
    double most = 0;
    for (double up = 1; up < fit.depth + 6; up += 0.1)
        most = std::max(most, (toothRadius(up - fit.depth) + probeRadius(up) + kRoom - atBottom(fit)) / up);
    return std::atan(most);
}

void check(const PocketFit& fit) {
    require(fit.sulcus > 0.5 && fit.depth >= fit.sulcus && fit.depth <= 8,
            "the sulcus must be over 0.5 mm deep, and the pocket as deep or deeper, up to 8 mm");
    require(
        fit.bottomWidth > 2 * kTipRadius && fit.width >= fit.bottomWidth && fit.width <= 2,
        "the pocket must be wider than the probe's tip, 0.5 mm, no narrower at the margin than at its bottom, and at "
        "most 2 mm wide");
    const double lean = std::tan(leaning(fit));
    for (double up = 0; up < fit.depth; up += 0.1) {
        const double away = atBottom(fit) + lean * up - toothRadius(up - fit.depth);
        require(away + probeRadius(up) < glm::mix(fit.bottomWidth, fit.width, up / fit.depth),
                "the probe cannot pass the crown to the bottom of this pocket: make it wider or less deep");
    }
    require(fit.stiffness > 0, "the stiffness must be positive");
}

}  // namespace

engine::MeshData tooth() {
    Solid solid;
    const auto ring = [](const glm::dvec2& p) {
        const double cusps = 0.6 * std::clamp((p.y - 5.5) / 1.8, 0.0, 1.0) * std::min(p.x / 1.9, 1.0);
        Ring points;
        for (int i = 0; i < kAround; ++i) {
            const double angle = kTau * i / kAround, sine = std::sin(angle);
            points.push_back(onTooth(p.x, p.y + cusps * sine * sine, angle));
        }
        return points;
    };
    const std::vector<glm::dvec2>& profile = toothProfile();
    for (std::size_t i = 0; i + 1 < profile.size(); ++i) loft(solid, ring(profile[i]), ring(profile[i + 1]));
    return finished(solid);
}

engine::MeshData gum(const PocketFit& fit) {
    check(fit);
    constexpr double kThick = 3.5, kCrest = 0.4, kInside = -0.05, kSpacing = 0.3;
    const double low = -std::max(fit.depth + 1.5, 4.5);
    // The section at an angle, as distance from the tooth and height: from below the tooth out and up, over the margin,
    // down the wall of the gap, along its bottom and down inside the tooth. The number of points is constant.
    const auto section = [&](double angle) {
        const double depth = depthAt(fit, angle);
        std::vector<glm::dvec2> points;
        const auto to = [&](const glm::dvec2& end, double longest) {
            const glm::dvec2 start = points.back();
            const int pieces = static_cast<int>(std::ceil(longest / kSpacing));
            for (int i = 1; i <= pieces; ++i) points.push_back(glm::mix(start, end, double(i) / pieces));
        };
        points.push_back({kInside, low});
        to({kThick, low}, kThick);
        to({kThick, -2}, -low - 2);
        const auto crest = [&](double degrees) {
            const double a = degrees * kDegree;
            return glm::dvec2(fit.width + kCrest * (1 + std::cos(a)), kCrest * (std::sin(a) - 1));
        };
        to(crest(45), kThick - fit.width);
        for (double degrees = 60; degrees <= 180; degrees += 15) points.push_back(crest(degrees));
        to({fit.bottomWidth, -depth}, fit.depth);
        to({kInside, -depth}, fit.bottomWidth);
        to({kInside, low}, -low - fit.sulcus);
        points.pop_back();
        return points;
    };
    std::vector<Ring> rings;
    for (int i = 0; i < kAround; ++i) {
        const double angle = kTau * i / kAround;
        const std::vector<glm::dvec2> points = section(angle);
        rings.resize(points.size());
        for (std::size_t k = 0; k < points.size(); ++k)
            rings[k].push_back(besideTooth(points[k].x, points[k].y, angle));
    }
    Solid solid;
    for (std::size_t k = 0; k < rings.size(); ++k) loft(solid, rings[k], rings[(k + 1) % rings.size()]);
    return finished(solid);
}

std::array<engine::MeshData, 2> periodontalProbe() {
    const std::vector<Station> stations = probeStations();
    Solid metal, black;
    for (std::size_t i = 0; i + 1 < stations.size(); ++i)
        loft(isBlack((stations[i].s + stations[i + 1].s) / 2) ? black : metal, probeRing(stations[i]),
             probeRing(stations[i + 1]));
    return {finished(metal), finished(black)};
}

engine::Scene makeDental(const SceneOptions& options) {
    const PocketFit& fit = options.pocket;
    const bool inflamed = fit.depth >= 4;  // mm: a deeper gap counts as a pocket
    engine::MeshData gumMesh = gum(fit);

    // The probe's tip beside the tooth, the probe leaning out; `away` is the distance of its axis.
    const auto at = [](double away, double y, double angle, double lean) {
        const glm::dvec3 out = outward(angle);
        return ToolPose{besideTooth(away, y, angle), glm::angleAxis(std::atan2(-out.z, out.x), glm::dvec3(0, 1, 0)) *
                                                         glm::angleAxis(-lean, glm::dvec3(0, 0, 1))};
    };
    const double lean = leaning(fit), beginning = -90 * kDegree, steep = 25 * kDegree;
    const double pushed = 300 / fit.stiffness;  // mm, for 0.3 N: slightly more than the usual probing force
    const double middle = fit.bottomWidth / 2;
    const auto sway = [](double t, double seconds, int times) { return std::sin(times * kTau * t / seconds); };

    const ToolPose start = at(3, 6, beginning, steep);
    Demonstration motion(start);
    motion.hold(0.2);
    motion.moveTo(at(0.1, 5, beginning, steep), 0.4);
    motion.follow(1, [&](double t) {  // down the crown and into the gap
        return at(glm::mix(0.1, middle - 0.1, t), glm::mix(5.0, -fit.sulcus - 0.1, t), beginning,
                  glm::mix(steep, lean, t));
    });
    const double walk = 2.5;
    motion.follow(walk, [&](double t) {
        const double lift = 0.35 * (1 - std::cos(10 * kTau * t / walk));
        return at(middle - 0.1, -fit.sulcus - 0.1 + lift, glm::mix(beginning, 0.0, t / walk), lean);
    });
    const double bottom = -fit.depth - pushed, down = (fit.depth + pushed) / 8;
    motion.follow(down, [&](double t) {
        return at(glm::mix(middle - 0.1, middle, t / down), glm::mix(-fit.sulcus - 0.1, bottom, t / down), 0, lean);
    });
    motion.hold(0.6);
    motion.follow(1, [&](double t) { return at(middle, bottom, 12 * kDegree * sway(t, 1, 2), lean); });
    motion.hold(0.2);
    motion.follow(0.6, [&](double t) { return at(middle, glm::mix(bottom, 1.0, t / 0.6), 0, lean); });
    motion.moveTo(at(5, 6, 0, steep), 0.5);
    motion.hold(0.2);

    engine::Scene scene;
    scene.name = "dental";
    *scene.extras = {{"touchstone", {{"settings", {{"margin", 0.1}, {"trust", 0.1}, {"slack", 0.1}}}}}};
    constexpr double kProbeError = 0.01, kWallError = 0.02;   // mm
    const double tilted = kTipRadius * (1 - std::cos(lean));  // the tip's lowest point is beside the axis
    const auto marked = [&](json marking, double error) {
        if (options.leaves) return marking;
        marking.erase("leaves");
        marking["max_error_mm"] = error;
        return marking;
    };
    json tool = toolMarking(options.leaves, {{"reached", true},
                                             {"min_depth_mm", fit.depth - kProbeError - kWallError - tilted},
                                             {"max_depth_mm", fit.depth + 0.001},
                                             {"min_contact_fraction", 0.45},
                                             {"max_final_lag_mm", 0.01}});
    tool["stiffness_N_per_m"] = fit.stiffness;
    auto [metal, black] = periodontalProbe();
    const engine::Entity probe =
        addBody(scene, "probe", start, shared(std::move(metal)), silver(), marked(std::move(tool), kProbeError));
    addMesh(scene, probe, shared(std::move(black)), addMaterial(scene, {"marks", {0.02f, 0.02f, 0.02f, 1}, 0, 0.6f}));
    addBody(scene, "tooth", {}, shared(tooth()), {"enamel", {0.88f, 0.83f, 0.70f, 1}, 0, 0.35f},
            marked(obstacleMarking(options.leaves), kWallError));
    const engine::Material pink{"gum", {0.80f, 0.42f, 0.40f, 1}, 0, 0.5f},
        red{"inflamed gum", {0.62f, 0.12f, 0.13f, 1}, 0, 0.4f};
    addBody(scene, "gum", {}, shared(std::move(gumMesh)), inflamed ? red : pink,
            marked(obstacleMarking(options.leaves), kWallError));
    addBody(scene, "pocket", at(middle, -fit.depth, 0, lean), nullptr, {},
            {{"role", "goal"}, {"goal", {{"tolerance_m", 0.0002}, {"tolerance_rad", 0.1}, {"hold_s", 0.5}}}});
    addBody(scene, "probing depth", {besideTooth(middle, 0, 0)}, nullptr, {}, {{"role", "gauge"}});
    scene.animations.push_back(motion.animation(probe));
    return scene;
}

}  // namespace touchstone::app
