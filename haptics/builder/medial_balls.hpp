#pragma once
// Points spread over a surface, each with the largest ball that touches the surface there from inside.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "haptics/builder/solid_depth.hpp"
#include "haptics/builder/workers.hpp"

namespace touchstone {

/// A centre and its depth: the sphere of radius depth + e about it reaches at most e out of the body.
struct Ball {
    Vec3 center = Vec3::Zero();
    double depth = 0;
};

/// How far balls grow where the smallest grow by `growth`. If all grow alike, the protrusion is least; but then a flat
/// takes few large balls, and a finger that slides over it feels each one. So those deeper than `flat` growths can be
/// told to grow less, by the square; but as far as `smooth` they may, which is too little to be felt.
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

/// The ball that touches the surface at p, its centre p + r·inward, up to a slack: the surface may enter it by so much,
/// without which every facet edge of a rounded part would shrink the balls beside it. `guess` > 0 is where r starts.
/// Source: Ma, Bae and Choi, 3D medial axis point approximation using nearest neighbors (2012), with that slack.
Ball touchingBall(const SolidDepth& solid, const Vec3& p, const Vec3& inward, double slack, double guess);

/// Spreads points so that their spacing is `spacing` times the radius of the patch that a ball covers where it
/// protrudes by `protrusion`: sqrt(2 e d + e^2), small beside sharp edges and wide on thick flats. At most about
/// `limit` points: beyond that the spacing grows. Units: the frame of RepairedMesh. Deterministic; another seed shifts
/// the points.
SurfaceSamples sampleSurface(const RepairedMesh& mesh, const SolidDepth& solid, double protrusion, double spacing,
                             std::size_t limit, GrowthLaw law, std::uint64_t seed, const Workers& workers);

}  // namespace touchstone
