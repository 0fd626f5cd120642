// The paper's scheme as written: leaf pairs that intersect at the device's pose, constraints (8) linearized at the last
// graphic pose (10)-(13), Euler angles (6), the QP (14) and the update (20). The only safeguards are bounds on rows and
// work.
#include <algorithm>
#include <cmath>

#include "haptics/loop/distances.hpp"
#include "haptics/loop/overlaps.hpp"
#include "haptics/loop/setting_table.hpp"

namespace touchstone {
namespace {

/// q = (x, y, z, γ, β, α) of (2): C and the angles of R = Rz(α) Ry(β) Rx(γ), the rotation of matrix (6), whose entry
/// (1,2) lacks a term -sα·cγ in print.
Vec6 configuration(const Pose& pose) {
    const Mat3 R = pose.R();
    Vec6 q;
    q << pose.p, std::atan2(R(2, 1), R(2, 2)), std::asin(std::clamp(-R(2, 0), -1.0, 1.0)), std::atan2(R(1, 0), R(0, 0));
    return q;
}

Quat rotationZ(double a) { return Quat(Eigen::AngleAxisd(a, Vec3::UnitZ())); }
Quat rotationY(double a) { return Quat(Eigen::AngleAxisd(a, Vec3::UnitY())); }
Quat rotationX(double a) { return Quat(Eigen::AngleAxisd(a, Vec3::UnitX())); }

Pose poseOf(const Vec6& q) { return {q.head<3>(), (rotationZ(q[5]) * rotationY(q[4]) * rotationX(q[3])).normalized()}; }

/// Finds the deepest pairs that intersect at `device`, at most `maxPairs`, in order of identity. Returns the number of
/// all pairs that intersect.
int deepestPairs(TickState::Impl& s, const Pose& device, int maxPairs) {
    using Pair = TickState::Impl::DeepPair;
    const auto deeper = [](const Pair& a, const Pair& b) { return a.gap != b.gap ? a.gap < b.gap : a.id < b.id; };
    int pairs = 0;
    s.deepest.clear();
    // A heap with the shallowest kept pair on top.
    const auto keep = [&](const Pair& pair) {
        if (int(s.deepest.size()) == maxPairs) {
            if (!deeper(pair, s.deepest.front())) return;
            std::pop_heap(s.deepest.begin(), s.deepest.end(), deeper);
            s.deepest.pop_back();
        }
        s.deepest.push_back(pair);
        std::push_heap(s.deepest.begin(), s.deepest.end(), deeper);
    };
    forOverlaps(s, device, [&](int obstacle, int toolLeaf, int obstacleLeaf, double gap) {
        ++pairs;
        keep({gap, contactId(obstacle, toolLeaf, obstacleLeaf)});
    });
    std::sort(s.deepest.begin(), s.deepest.end(), [](const Pair& a, const Pair& b) { return a.id < b.id; });
    return pairs;
}

/// Rows J Δq >= d of (12), (13), written as J x >= -g with x = Δq = q_g - q_h.
void linearize(TickState::Impl& s, const Vec6& q_g, const Vec6& q_h) {
    const Quat Rz = rotationZ(q_g[5]), Rzy = Rz * rotationY(q_g[4]), R = Rzy * rotationX(q_g[3]);
    const Vec3 axis[3] = {Rzy * Vec3::UnitX(), Rz * Vec3::UnitY(), Vec3::UnitZ()};
    s.rows.clear();
    for (const auto& pair : s.deepest) {
        const int k = obstacleOf(pair.id);
        const Sphere t = s.world->tool.spheres->leaf(toolLeafOf(pair.id));
        const Sphere o = s.world->obstacles[k].part.spheres->leaf(obstacleLeafOf(pair.id));
        const Vec3 r = R * (Vec3(t.x, t.y, t.z) - s.p_TC);
        const Vec3 d = q_g.head<3>() + r - s.X_WO[k] * Vec3(o.x, o.y, o.z);
        const double radii = double(t.r) + double(o.r);
        const double C = d.squaredNorm() - radii * radii;  // (8)
        Vec6 J;                                            // (11)
        J << 2 * d, 2 * d.dot(axis[0].cross(r)), 2 * d.dot(axis[1].cross(r)), 2 * d.dot(axis[2].cross(r));
        const double bound = J.dot(q_g) - C - J.dot(q_h);  // (13)
        s.rows.push(J, -bound, pair.id);
    }
}

/// The largest constraint violation, mm. The rows are gradients of squared distances, so each is divided by the length
/// of its normal.
double violation(const RowSet& rows, const Vec6& x) {
    double worst = 0;
    for (int i = 0; i < rows.size(); ++i) {
        const Vec6 J = rows.row(i);
        const double length = J.head<3>().norm();
        if (length > 0) worst = std::max(worst, -(J.dot(x) + rows.gap()[i]) / length);
    }
    return worst;
}

}  // namespace

bool paperTick(Tick& tick, const Pose& device, Wrench& wrench) {
    TickState::Impl& s = tick.state;
    TickRecord& record = tick.record;
    const Settings& set = tick.settings;
    const Vec6 q_h = configuration(device), q_g = configuration(s.graphic);

    std::uint64_t start = tick.now();
    record.pairs = deepestPairs(s, device, std::min(set.paperRows, kPaperRowCapacity));
    linearize(s, q_g, q_h);
    tick.addTime(record.collisionUs, start);
    record.rows = s.rows.size();
    record.rowsTruncated = record.pairs - record.rows;
    if (record.rowsTruncated) record.flags |= kRowsTruncated;
    record.linearizations = 1;

    Vec6 dq = Vec6::Zero();
    s.contacts.clear();
    if (record.rows) {
        const QpProblem problem{tick.stiffness(), Vec6::Zero(), &s.rows};
        const SolverSettings limits = solverSettings(set);
        start = tick.now();
        SolveResult result = named(s.renderers, set.solver)->solve(problem, limits);
        tick.addTime(record.solveUs, start);
        result.kkt.primal_mm = violation(s.rows, result.x);
        tick.note(result);
        if (result.status == SolveStatus::Invalid) return false;
        dq = result.x;
        if (set.shadow != kNoSolver) tick.runShadow(problem, result.x);
        if (findSolver(set.solver)->exact)
            s.rememberContacts(s.rows, result);
        else if (tick.audit)
            s.rememberContacts(s.rows, s.reference->solve(problem, limits));
    }
    s.graphic = record.rows ? poseOf(q_h + dq) : device;  // (20)
    record.hover = s.hoverAt(s.graphic);
    // Measured for an audit only: the paper's scheme itself does not need it.
    if (tick.audit) record.penetration = std::max(0.0, -trueClearance(*s.world, s.nodePose(s.graphic), 0, s.X_WO));
    wrench = tick.coupling(dq);
    return true;
}

}  // namespace touchstone
