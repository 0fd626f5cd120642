#include "haptics/reference/mesh_reference.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "haptics/qp/solver.hpp"
#include "haptics/reference/contact_surface.hpp"

namespace touchstone {
namespace {

constexpr int kRows = 1 << 14;  // maximum number of contacts of a solve; with more, the margin is halved
constexpr int kHalvings = 40;   // of a move that would bring the meshes too near; after them the iteration ends
constexpr double kValley = 50;  // distance from a valley's edge, in shells, within which both its faces make rows

TriangleBvh bvhOf(const ContactSurface& surface) {
    std::vector<Triangle> triangles;
    for (int f = 0; f < int(surface.faces.size()); ++f) triangles.push_back(surface.triangle(f));
    return TriangleBvh(std::move(triangles));
}

struct Obstacle {
    explicit Obstacle(const MeshObstacle& from)
        : surface(makeContactSurface(from.mesh)), bvh(bvhOf(surface)), X_OW(from.X_WO.inverse()), R_WO(from.X_WO.R()) {}
    ContactSurface surface;
    TriangleBvh bvh;
    Pose X_OW;
    Mat3 R_WO;
};

/// Pairs of features of the tool (first) and an obstacle (second) that may be near each other, each pair once.
struct Pairs {
    using List = std::vector<std::pair<int, int>>;
    List faces, vertexFace, faceVertex, edgeEdge;
};

void keepOnce(Pairs::List& list) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
}

std::uint64_t identity(int obstacle, const Feature& tool, const Feature& other) {
    const int kinds = 3 * int(tool.kind) + int(other.kind);
    return std::uint64_t(obstacle) << 56 | std::uint64_t(kinds) << 52 | std::uint64_t(tool.index) << 26 |
           std::uint64_t(other.index);
}

struct Contact {
    std::uint64_t id;
    Vec6 row;
    double distance;
};

}  // namespace

struct MeshReference::Impl {
    Impl(const TriangleMesh& mesh, const Vec3& reference, const MeshReferenceOptions& chosen)
        : tool(makeContactSurface(mesh)), toolBvh(bvhOf(tool)), p_TC(reference), options(chosen) {
        for (const Vec3& v : tool.vertices) reach = std::max(reach, (v - p_TC).norm());
    }

    ContactSurface tool;
    TriangleBvh toolBvh;
    Vec3 p_TC;
    MeshReferenceOptions options;
    double reach = 0;
    std::vector<Obstacle> obstacles;

    Pose nodePose(const Pose& q) const { return {q.p - q.q * p_TC, q.q}; }
    double lengthOf(const Vec6& x) const { return x.head<3>().norm() + reach * x.tail<3>().norm(); }
    /// Whether one body lies inside another. One point of each is tested, so the surfaces must not touch.
    bool contains(const Pose& q) const {
        return std::any_of(obstacles.begin(), obstacles.end(), [&](const Obstacle& obstacle) {
            const Pose X_OT = obstacle.X_OW * nodePose(q);
            return obstacle.bvh.windingNumber(X_OT * tool.vertices.front()) > 0.5 ||
                   toolBvh.windingNumber(X_OT.inverse() * obstacle.surface.vertices.front()) > 0.5;
        });
    }
    Pairs pairsNear(const Obstacle& obstacle, const Pose& X_OT, double distance) const;
};

Pairs MeshReference::Impl::pairsNear(const Obstacle& obstacle, const Pose& X_OT, double distance) const {
    Pairs pairs;
    for (int f = 0; f < int(tool.faces.size()); ++f) {
        Box box;
        for (const int v : tool.faces[f].vertices) box.add(X_OT * tool.vertices[v]);
        box.lo.array() -= distance;
        box.hi.array() += distance;
        obstacle.bvh.overlapping(box, [&](int g) {
            const Box other = obstacle.surface.box(g);
            if ((other.lo.array() <= box.hi.array()).all() && (other.hi.array() >= box.lo.array()).all())
                pairs.faces.emplace_back(f, g);
        });
    }
    for (const auto& [f, g] : pairs.faces)
        for (int i = 0; i < 3; ++i) {
            pairs.vertexFace.emplace_back(tool.faces[f].vertices[i], g);
            pairs.faceVertex.emplace_back(f, obstacle.surface.faces[g].vertices[i]);
            for (int k = 0; k < 3; ++k)
                pairs.edgeEdge.emplace_back(tool.faces[f].edges[i], obstacle.surface.faces[g].edges[k]);
        }
    for (Pairs::List* list : {&pairs.vertexFace, &pairs.faceVertex, &pairs.edgeEdge}) keepOnce(*list);
    return pairs;
}

namespace {

/// The feature pairs of tool and obstacles near a pose, which are kept while the tool stays near it, and their
/// distances and contacts at other poses.
class NearPairs {
  public:
    NearPairs(const MeshReference::Impl& impl, double margin) : impl_(impl), margin_(margin), placed_(impl.tool) {}

    /// Smallest distance with the tool's C at q, at most the margin; 0 if triangles touch.
    double measure(const Pose& q) { return measure(q, nullptr); }
    /// The same; also returns all pairs within the margin that are local minima of the distance, in order of identity.
    double contacts(const Pose& q, std::vector<Contact>& found);

  private:
    double measure(const Pose& q, std::vector<Contact>* found);
    double measure(int obstacle, const Pose& q, std::vector<Contact>* found);

    const MeshReference::Impl& impl_;
    double margin_;
    Pose builtAt_;
    std::vector<Pairs> pairs_;  // of each obstacle; complete for the margin within `margin` of travel from builtAt_
    ContactSurface placed_;     // the tool in an obstacle's frame
};

double NearPairs::measure(const Pose& q, std::vector<Contact>* found) {
    const Vec6 traveled = incrementBetween(builtAt_, q);
    if (pairs_.empty() || impl_.lengthOf(traveled) > margin_) {
        pairs_.clear();
        for (const Obstacle& obstacle : impl_.obstacles)
            pairs_.push_back(impl_.pairsNear(obstacle, obstacle.X_OW * impl_.nodePose(q), 2 * margin_));
        builtAt_ = q;
    }
    double least = margin_;
    for (int k = 0; k < int(impl_.obstacles.size()) && least > 0; ++k) least = std::min(least, measure(k, q, found));
    return least;
}

double NearPairs::contacts(const Pose& q, std::vector<Contact>& found) {
    found.clear();
    const double least = measure(q, &found);
    // A nearest point on an edge is found twice, from both faces of the edge.
    std::sort(found.begin(), found.end(), [](const Contact& a, const Contact& b) { return a.id < b.id; });
    found.erase(
        std::unique(found.begin(), found.end(), [](const Contact& a, const Contact& b) { return a.id == b.id; }),
        found.end());
    return least;
}

double NearPairs::measure(int index, const Pose& q, std::vector<Contact>* found) {
    const Obstacle& obstacle = impl_.obstacles[index];
    const ContactSurface& other = obstacle.surface;
    const Pose X_OT = obstacle.X_OW * impl_.nodePose(q);
    const Vec3 p_OC = X_OT * impl_.p_TC;
    for (std::size_t v = 0; v < placed_.vertices.size(); ++v) placed_.vertices[v] = X_OT * impl_.tool.vertices[v];

    // A pair counts as a contact if it is a local minimum of the distance: both features stand out toward each other.
    double least = margin_;
    const auto add = [&](const Vec3& onTool, const Feature& toolFeature, const Feature& otherFeature,
                         const Vec3& normal, double distance) {
        Vec6 row;
        row << obstacle.R_WO * normal, obstacle.R_WO * (onTool - p_OC).cross(normal);
        found->push_back({identity(index, toolFeature, otherFeature), row, distance});
    };
    const auto measurePair = [&](const Vec3& onTool, const Feature& toolFeature, const Vec3& onOther,
                                 const Feature& otherFeature) {
        const double distance = (onTool - onOther).norm();
        least = std::min(least, distance);
        if (!found || distance > margin_ || distance == 0) return;
        const Vec3 normal = (onTool - onOther) / distance;
        if (standsOut(placed_, toolFeature, onTool, -normal) && standsOut(other, otherFeature, onOther, normal))
            add(onTool, toolFeature, otherFeature, normal, distance);
    };
    // In a valley both planes become rows: the nearest point lies on only one face, and a vertex that is pulled into
    // the valley would move back and forth. Near a ridge no part of the surface rises above the plane of a face, so no
    // row is added. If a valley bends, a tool that is clear may be behind one of its planes; such a row must not push
    // the tool away, only keep it from going further.
    const double zone = kValley * impl_.options.shell;
    const auto ahead = [&](double distance) { return std::max(distance, impl_.options.shell); };
    const auto valley = [&](const ContactSurface& surface, int face, const Feature& on, const Vec3& at,
                            const Vec3& vertex) {
        return found && on.kind != Feature::Kind::Face && (vertex - at).norm() < zone &&
               surface.normal(face).dot(vertex - at) > 0 && !standsOut(surface, on, at, surface.normal(face));
    };

    const Pairs& pairs = pairs_[index];
    // Vertices of the tool against faces of the obstacle.
    for (const auto& [v, g] : pairs.vertexFace) {
        Feature on;
        const Vec3 nearest = closestPoint(other, g, placed_.vertices[v], on);
        const Vec3& vertex = placed_.vertices[v];
        measurePair(vertex, {Feature::Kind::Vertex, v}, nearest, on);
        if (!valley(other, g, on, nearest, vertex)) continue;
        const Vec3 normal = other.normal(g);
        if (standsOut(placed_, {Feature::Kind::Vertex, v}, vertex, -normal))
            add(vertex, {Feature::Kind::Vertex, v}, {Feature::Kind::Face, g}, normal,
                ahead(normal.dot(vertex - nearest)));
    }
    // Faces of the tool against vertices of the obstacle.
    for (const auto& [f, v] : pairs.faceVertex) {
        Feature on;
        const Vec3 nearest = closestPoint(placed_, f, other.vertices[v], on);
        const Vec3& vertex = other.vertices[v];
        measurePair(nearest, on, vertex, {Feature::Kind::Vertex, v});
        if (!valley(placed_, f, on, nearest, vertex)) continue;
        const Vec3 normal = -placed_.normal(f);
        if (standsOut(other, {Feature::Kind::Vertex, v}, vertex, normal))
            add(nearest, {Feature::Kind::Face, f}, {Feature::Kind::Vertex, v}, normal,
                ahead(normal.dot(nearest - vertex)));
    }
    // Edges against edges, at the nearest points of their lines.
    for (const auto& [e, d] : pairs.edgeEdge) {
        const auto& a = placed_.edges[e].vertices;
        const auto& b = other.edges[d].vertices;
        const Vec3 &a0 = placed_.vertices[a[0]], &a1 = placed_.vertices[a[1]], &b0 = other.vertices[b[0]],
                   &b1 = other.vertices[b[1]];
        double s, t;
        if (!crossing(a0, a1, b0, b1, s, t)) continue;
        const Vec3 onTool = a0 + s * (a1 - a0), onOther = b0 + t * (b1 - b0);
        const double beyondTool = std::max({0.0, -s, s - 1}) * (a1 - a0).norm(),
                     beyondOther = std::max({0.0, -t, t - 1}) * (b1 - b0).norm();
        if (beyondTool == 0 && beyondOther == 0) {
            measurePair(onTool, {Feature::Kind::Edge, e}, onOther, {Feature::Kind::Edge, d});
            continue;
        }
        // If the edges of a chain rise on both sides of a vertex, an edge across it rests on two of them: a valley
        // again.
        const double distance = (onTool - onOther).norm();
        if (!found || std::max({beyondTool, beyondOther, distance}) > zone || distance == 0) continue;
        const Vec3 normal = (onTool - onOther) / distance;
        const int endTool = a[s > 0.5], endOther = b[t > 0.5];
        const Vec3 &toolEnd = placed_.vertices[endTool], &otherEnd = other.vertices[endOther];
        if (standsOut(placed_, {Feature::Kind::Edge, e}, toolEnd, -normal) &&
            standsOut(other, {Feature::Kind::Edge, d}, otherEnd, normal) &&
            !(beyondTool > 0 && standsOut(placed_, {Feature::Kind::Vertex, endTool}, toolEnd, -normal)) &&
            !(beyondOther > 0 && standsOut(other, {Feature::Kind::Vertex, endOther}, otherEnd, normal)))
            add(onTool, {Feature::Kind::Edge, e}, {Feature::Kind::Edge, d}, normal, ahead(distance));
    }
    // Faces that pierce each other touch, whatever their features are apart.
    if (least == 0) return 0;
    for (const auto& [f, g] : pairs.faces) {
        const Box a = placed_.box(f), b = other.box(g);
        if (!((a.lo.array() <= b.hi.array()).all() && (a.hi.array() >= b.lo.array()).all())) continue;
        const Triangle tool = placed_.triangle(f), face = other.triangle(g);
        for (int k = 0; k < 3; ++k)
            if (pierces(tool[k], tool[(k + 1) % 3], face) || pierces(face[k], face[(k + 1) % 3], tool)) return 0;
    }
    return least;
}

}  // namespace

MeshReference::MeshReference(const TriangleMesh& tool, const Vec3& p_TC, const std::vector<MeshObstacle>& obstacles,
                             const MeshReferenceOptions& options) {
    auto impl = std::make_unique<Impl>(tool, p_TC, options);
    for (const MeshObstacle& obstacle : obstacles) impl->obstacles.emplace_back(obstacle);
    impl_ = std::move(impl);
}
MeshReference::~MeshReference() = default;

double MeshReference::clearance(const Pose& X_WT, double atMost) const {
    return NearPairs(*impl_, atMost).measure({X_WT * impl_->p_TC, X_WT.q});
}

MeshReferenceAnswer MeshReference::solve(const MeshReferenceProblem& problem) const {
    const MeshReferenceOptions& options = impl_->options;
    const Pose device{problem.X_WT_device * impl_->p_TC, problem.X_WT_device.q};
    Pose q{problem.X_WT_start * impl_->p_TC, problem.X_WT_start.q};
    Vec6 G;
    G << Vec3::Constant(problem.stiffness), Vec3::Constant(problem.torsion);
    const auto solver = findSolver(kExactSolver)->make(kRows);
    RowSet rows(kRows);
    NearPairs nearPairs(*impl_, options.margin);
    std::vector<Contact> contacts;
    double margin = options.margin;  // halved while there are more contacts than kRows

    MeshReferenceAnswer answer;
    answer.clearance = nearPairs.measure(q);
    if (answer.clearance == 0 || impl_->contains(q))
        throw std::invalid_argument(
            "the meshes touch at the start: choose a start where the tool is clear of the obstacles");
    for (; answer.iterations < options.iterations && !answer.converged; ++answer.iterations) {
        nearPairs.contacts(q, contacts);
        while (int(contacts.size()) > kRows) {
            margin /= 2;
            std::erase_if(contacts, [&](const Contact& c) { return c.distance > margin; });
        }
        rows.clear();
        for (const Contact& c : contacts) rows.push(c.row, c.distance - options.shell, c.id);
        const Vec6 wanted = incrementBetween(q, device);
        const SolveResult result = solver->solve({G, wanted, &rows}, {});
        answer.residual = impl_->lengthOf(result.x);
        answer.contacts = int(result.multipliers.size());
        answer.gap = 0;
        for (const Multiplier& m : result.multipliers) answer.gap = std::max(answer.gap, contacts[m.row].distance);

        // The move is no longer than the margin, so that the tool touches nothing that is not listed. Afterwards the
        // meshes must be at least half a shell apart, since curvature, and features that become local minima only
        // during the move, can bring them nearer than the rows allow.
        const double floor = std::min(answer.clearance, options.shell / 2);
        Vec6 x = result.x * std::min(1.0, 0.9 * margin / std::max(answer.residual, 1e-300));
        Pose after = moved(q, x);
        double clearance = nearPairs.measure(after);
        int halvings = 0;
        for (; clearance < floor && halvings < kHalvings; ++halvings) {
            x /= 2;
            clearance = nearPairs.measure(after = moved(q, x));
        }
        if (halvings == kHalvings) break;
        q = after;
        answer.clearance = clearance;
        answer.converged = answer.residual < options.tolerance && halvings == 0;
    }
    answer.X_WT = impl_->nodePose(q);
    const Vec6 pull = incrementBetween(device, q);
    answer.wrench_C = {problem.stiffness * pull.head<3>(), problem.torsion * pull.tail<3>()};
    return answer;
}

}  // namespace touchstone
