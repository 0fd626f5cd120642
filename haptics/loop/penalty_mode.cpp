// Penalty forces behind a virtual coupling, as the related work renders contact. Every overlapping pair of leaves
// pushes with penalty_stiffness times its depth, the coupling G pulls the tool to the device, and each tick moves the
// tool to the equilibrium of the two by one linearization. The tool itself has no mass (M. Wan and W. McNeely,
// Quasi-static approximation for 6 degrees-of-freedom haptic rendering, 2003; J. Barbič and D. James, Six-DoF haptic
// rendering of contact between geometrically complex reduced deformable models, 2008). The coupling is that of
// J. Colgate et al. (1995). No tick moves a leaf by more than `trust` (the MaxTravel of W. McNeely et al., 1999).
#include <Eigen/Cholesky>

#include "haptics/loop/distances.hpp"
#include "haptics/loop/overlaps.hpp"

namespace touchstone {

bool penaltyTick(Tick& tick, const Pose& device, Wrench& wrench) {
    TickState::Impl& s = tick.state;
    TickRecord& record = tick.record;
    const Vec6 G = tick.stiffness();
    const double k = tick.settings.penaltyStiffness;

    // Equilibrium of the coupling's force G (h - x) and of each pair's force k (depth - j'x) j.
    std::uint64_t start = tick.now();
    Eigen::Matrix<double, 6, 6> A = G.asDiagonal();
    Vec6 b = G.cwiseProduct(incrementBetween(s.graphic, device));
    const Mat3 R = s.graphic.R();
    forOverlaps(s, s.graphic, [&](int obstacle, int toolLeaf, int obstacleLeaf, double gap) {
        ++record.pairs;
        const Vec3 r = R * (s.world->tool.spheres->leaf(toolLeaf).center() - s.p_TC);
        const Vec3 c_O = s.X_WO[obstacle] * s.world->obstacles[obstacle].part.spheres->leaf(obstacleLeaf).center();
        const Vec3 n = (s.graphic.p + r - c_O).normalized();  // zero if the centers coincide: no direction leads out
        Vec6 j;
        j << n, r.cross(n);
        A.selfadjointView<Eigen::Lower>().rankUpdate(j, k);
        b -= k * gap * j;
    });
    tick.addTime(record.collisionUs, start);
    record.rows = record.pairs;
    record.linearizations = 1;

    start = tick.now();
    Vec6 x = A.selfadjointView<Eigen::Lower>().ldlt().solve(b);
    const double length = s.lengthOf(x);
    const bool capped = length > tick.settings.trust;
    if (capped) {
        x *= tick.settings.trust / length;
        record.flags |= kCapped;
    }
    s.graphic = record.pairs == 0 && !capped ? device : moved(s.graphic, x);
    tick.addTime(record.solveUs, start);

    s.contacts.clear();
    if (tick.audit) record.penetration = std::max(0.0, -trueClearance(*s.world, s.nodePose(s.graphic), 0, s.X_WO));
    wrench = tick.coupling(incrementBetween(device, s.graphic));
    return true;
}

}  // namespace touchstone
