#pragma once
// Samples a surface: points, each with the largest ball that touches the surface there from inside.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "haptics/builder/solid_depth.hpp"
#include "haptics/builder/workers.hpp"

namespace touchstone {

/// A center and its depth. The sphere of radius depth + e about the center protrudes at most e out of the body.
struct Ball {
    Vec3 center = Vec3::Zero();
    double depth = 0;
};

/// How much a ball of a given depth grows if the smallest balls grow by `growth`. Equal growth gives the least
/// protrusion, but then few large balls cover a flat, and a finger that slides over it feels each of them. Balls deeper
/// than `flat` times the growth therefore grow less, by the inverse square of their depth. They may always grow by
/// `smooth` (a length), which is too little to be felt.
struct GrowthLaw {
    double flat = HUGE_VAL;
    double smooth = 0;

    double operator()(double depth, double growth) const {
        const double thick = growth > 0 ? depth / (flat * growth) : 0;
        return thick > 1 ? std::max(growth / (thick * thick), std::min(growth, smooth)) : growth;
    }
};

struct SurfaceSamples {
    std::vector<Vec3> points;
    std::vector<Ball> balls;  ///< balls[i] belongs to points[i]: |center - point| - depth <= protrusion / 4
};

/// The largest ball that touches the surface at p, with center p + r·inward. The surface may penetrate the ball by
/// `slack`; without it, each facet edge of a rounded part would shrink the balls beside it. `guess` > 0 is the first
/// radius. Source: Ma, Bae and Choi, 3D medial axis point approximation using nearest neighbors (2012), with the slack
/// added.
Ball touchingBall(const SolidDepth& solid, const Vec3& p, const Vec3& inward, double slack, double guess);

/// Distributes points whose spacing is `spacing` times the radius of the patch that a ball covers if it protrudes by
/// `protrusion`: sqrt(2 e d + e^2) for the growth e and the depth d. This radius is small beside sharp edges and large
/// on thick flats. Returns at most about `limit` points: the spacing is enlarged until they fit. Lengths in the frame
/// of RepairedMesh. Deterministic; the random seed shifts the points.
SurfaceSamples sampleSurface(const RepairedMesh& mesh, const SolidDepth& solid, double protrusion, double spacing,
                             std::size_t limit, GrowthLaw law, std::uint64_t seed, const Workers& workers);

}  // namespace touchstone
