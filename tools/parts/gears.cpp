#include "tools/parts/gears.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tools/parts/angles.hpp"
#include "tools/parts/shapes.hpp"
#include "tools/parts/solid.hpp"

namespace touchstone::app {
namespace {

/// A prism from low to high around a hole (may be empty), with a chamfer at the upper end.
engine::MeshData prism(const Outline& outer, const Outline& hole, double low, double high, double chamfer,
                       double spacing) {
    const Outline top = offset(outer, -chamfer);
    Solid solid;
    const Section outside[] = {{low, outer}, {high - chamfer, outer}, {high, top}};
    addWall(solid, std::span(outside).first(chamfer > 0 ? 3 : 2), spacing);
    const Section within[] = {{high, hole}, {low, hole}};
    addWall(solid, within, spacing);
    addEnd(solid, high, triangulate(top, hole, spacing), true);
    addEnd(solid, low, triangulate(outer, hole, spacing), false);
    return finished(solid);
}

}  // namespace

Outline gearProfile(const GearPair& fit, int teeth) {
    if (teeth < 4 || fit.module <= 0 || fit.clearance < 0)
        throw std::invalid_argument("a gear needs four teeth or more, a positive module and no negative clearance");
    const double pitch = fit.module * teeth / 2, base = pitch * std::cos(fit.pressureAngle);
    const double tip = pitch + fit.module, root = pitch - 1.25 * fit.module;
    const auto involute = [](double angle) { return std::tan(angle) - angle; };
    // Half of the tooth as an angle. Turning an involute by s / base moves it s along its normal.
    const auto half = [&](double r) {
        return kPi / (2 * teeth) + involute(fit.pressureAngle) - involute(std::acos(base / std::max(r, base))) -
               fit.clearance / 2 / base;
    };
    if (half(tip) <= 0) throw std::invalid_argument("the teeth come to a point; use more teeth or less clearance");
    if (half(root) >= kPi / teeth) throw std::invalid_argument("the teeth leave no root between them; use more teeth");

    Outline outline;
    const double foot = std::max(root, base);
    const int pieces = static_cast<int>(std::ceil((tip - foot) / fit.spacing * 2));
    const int first = foot > root ? 0 : 1;  // the arc of the root includes its ends
    const auto at = [&](double r, double angle) { outline.push_back({r * std::cos(angle), r * std::sin(angle)}); };
    for (int tooth = 0; tooth < teeth; ++tooth) {
        const double middle = 2 * kPi * tooth / teeth;
        for (int i = first; i < pieces; ++i) {
            const double r = std::lerp(foot, tip, double(i) / pieces);
            at(r, middle - half(r));
        }
        addArc(outline, tip, middle - half(tip), middle + half(tip), kChordError, fit.spacing);
        for (int i = pieces - 1; i >= first; --i) {
            const double r = std::lerp(foot, tip, double(i) / pieces);
            at(r, middle + half(r));
        }
        addArc(outline, root, middle + half(root), middle + 2 * kPi / teeth - half(root), kChordError, fit.spacing);
    }
    return subdivided(outline, fit.spacing);
}

engine::MeshData looseGear(const GearPair& fit) {
    const Outline bore = circle(fit.bore / 2, kChordError, fit.spacing);
    return prism(gearProfile(fit, fit.looseTeeth), bore, -fit.width / 2, fit.width / 2, 0, fit.spacing);
}

engine::MeshData fixedGear(const GearPair& fit) {
    return prism(gearProfile(fit, fit.fixedTeeth), {}, 0, fit.width, 0, fit.spacing);
}

engine::MeshData gearPost(const GearPair& fit) {
    const Outline round = circle(fit.bore / 2 - fit.clearance, kChordError, fit.spacing);
    return prism(round, {}, 0, 1.5 * fit.width + fit.chamfer, fit.chamfer, fit.spacing);
}

double meshAngle(const GearPair& fit) { return fit.looseTeeth % 2 ? 0 : kPi / fit.looseTeeth; }

}  // namespace touchstone::app
