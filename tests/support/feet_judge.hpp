#pragma once
// Judges whether what carries the tool is there: the rows that carry force, by the points of their features alone.
#include <span>
#include <vector>

#include "haptics/collision/contact_list.hpp"
#include "haptics/loop/step.hpp"
#include "haptics/surface/feature_pair_finder.hpp"
#include "tests/support/test_meshes.hpp"

namespace touchstone::test {

class FeetJudge {
  public:
    /// Feet that lie outside by at most this, mm, stand on their feature.
    static constexpr double kStands = 1e-4;

    /// A row that carries force and stands on nothing.
    struct Miss {
        std::uint64_t id = 0;
        double beyond = 0;  ///< greatest distance of a foot from its feature, mm
    };

    explicit FeetJudge(const World& world) : world_(&world) {}

    /// The pairs of meshes that carry force at the end of a tick.
    static std::vector<std::uint64_t> carriers(const TickRecord& record, const TickState& state) {
        const auto touching = record.touching.span();
        std::vector<std::uint64_t> ids(touching.begin(), touching.end());
        for (const ContactForce& contact : frictionContacts(state)) ids.push_back(contact.id);
        return ids;
    }

    /// The row with force at the end of a tick that stands farthest beside its features, if by more than kStands
    /// and with no other pair of features that has the same feet and the same normal.
    Miss worst(const TickRecord& record, const TickState& state) const {
        Miss worst;
        for (const std::uint64_t id : carriers(record, state)) {
            const Stand stand = standOf(record.X_WT, state.obstacles(), id);
            if (stand.beyond > std::max(kStands, worst.beyond) && !hasTwin(record.X_WT, state.obstacles(), stand))
                worst = {id, stand.beyond};
        }
        return worst;
    }

  private:
    /// Where the row of a pair stands, scene frame, mm. The feet of two edges are the nearest points of their lines.
    struct Stand {
        Vec3 onTool, onObstacle;
        Vec3 normal;
        double beyond = 0;
    };
    /// Feet are the same up to this distance, mm, and normals up to this angle, rad: as far as feet may be outside, and
    /// what turns a force of 1 N by 1 mN.
    static constexpr double kSameFoot = kStands, kSameNormal = 1e-3;
    /// Features that far from a foot are no neighbors, mm.
    static constexpr double kNeighborhood = 0.01;

    static Stand ofVertex(const Vec3& vertex, const Triangle& face) {
        const Vec3 n = (face[1] - face[0]).cross(face[2] - face[0]).normalized();
        const Vec3 foot = vertex - n * n.dot(vertex - face[0]);
        return {vertex, foot, n, bruteDistance(foot, face)};
    }

    static Stand ofEdges(const std::array<Vec3, 2>& mine, const std::array<Vec3, 2>& other) {
        const Vec3 u = mine[1] - mine[0], v = other[1] - other[0], w = mine[0] - other[0], cross = u.cross(v);
        const double s = v.cross(w).dot(cross) / cross.squaredNorm(), t = u.cross(w).dot(cross) / cross.squaredNorm();
        const auto outside = [](double at, double length) { return length * std::max({0.0, -at, at - 1}); };
        Stand stand{mine[0] + s * u, other[0] + t * v, cross.normalized(),
                    std::max(outside(s, u.norm()), outside(t, v.norm()))};
        if (stand.normal.dot(stand.onTool - stand.onObstacle) < 0) stand.normal = -stand.normal;
        return stand;
    }

    static Triangle moved(const Pose& X, const Triangle& t) { return {X * t[0], X * t[1], X * t[2]}; }
    static std::array<Vec3, 2> edge(const SurfaceFeatures& part, int index, const Pose& X) {
        const auto& [a, b] = part.edges[std::size_t(index)].points;
        return {X * part.points[std::size_t(a)], X * part.points[std::size_t(b)]};
    }
    static Vec3 vertex(const SurfaceFeatures& part, int index, const Pose& X) {
        return X * part.points[std::size_t(part.vertices[std::size_t(index)].point)];
    }

    Stand standOf(const Pose& X_WT, std::span<const Pose> X_WO, std::uint64_t id) const {
        const SurfaceFeatures &tool = world_->tool.surface->features,
                              &obstacle = world_->obstacles[std::size_t(obstacleOf(id))].part.surface->features;
        const Pose& X = X_WO[std::size_t(obstacleOf(id))];
        const int ours = featureOf(toolLeafOf(id)), other = obstacleLeafOf(id);
        switch (kindOf(toolLeafOf(id))) {
            case PairKind::VertexFace:
                return ofVertex(vertex(tool, ours, X_WT), moved(X, obstacle.triangle(other)));
            case PairKind::FaceVertex:
                return flipped(ofVertex(vertex(obstacle, other, X), moved(X_WT, tool.triangle(ours))));
            default:
                return ofEdges(edge(tool, ours, X_WT), edge(obstacle, other, X));
        }
    }
    static Stand flipped(const Stand& s) { return {s.onObstacle, s.onTool, -s.normal, s.beyond}; }

    /// The features of a part within the neighborhood of a point.
    struct Near {
        std::vector<int> faces, edges, vertices;
        Near(const SurfaceFeatures& part, const Pose& X, const Vec3& p_W) {
            const Vec3 p = X.inverse() * p_W;
            for (int i = 0; i < int(part.faces.size()); ++i)
                if (bruteDistance(p, part.triangle(i)) < kNeighborhood) faces.push_back(i);
            for (int i = 0; i < int(part.edges.size()); ++i) {
                const auto [a, b] = edge(part, i, {});
                const double at = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
                if ((a + at * (b - a) - p).norm() < kNeighborhood) edges.push_back(i);
            }
            for (int i = 0; i < int(part.vertices.size()); ++i)
                if ((vertex(part, i, {}) - p).norm() < kNeighborhood) vertices.push_back(i);
        }
    };

    /// Whether another pair of features, of any obstacle, stands on the same feet with the same normal.
    bool hasTwin(const Pose& X_WT, std::span<const Pose> X_WO, const Stand& stand) const {
        const auto same = [&](const Stand& other) {
            return other.beyond <= kStands && (other.onTool - stand.onTool).norm() <= kSameFoot &&
                   (other.onObstacle - stand.onObstacle).norm() <= kSameFoot &&
                   other.normal.cross(stand.normal).norm() <= kSameNormal && other.normal.dot(stand.normal) > 0;
        };
        const SurfaceFeatures& tool = world_->tool.surface->features;
        const Near ours(tool, X_WT, stand.onTool);
        for (std::size_t k = 0; k < world_->obstacles.size(); ++k) {
            if (!world_->obstacles[k].part.surface) continue;
            const SurfaceFeatures& obstacle = world_->obstacles[k].part.surface->features;
            const Near others(obstacle, X_WO[k], stand.onObstacle);
            for (const int v : ours.vertices)
                for (const int f : others.faces)
                    if (same(ofVertex(vertex(tool, v, X_WT), moved(X_WO[k], obstacle.triangle(f))))) return true;
            for (const int f : ours.faces)
                for (const int v : others.vertices)
                    if (same(flipped(ofVertex(vertex(obstacle, v, X_WO[k]), moved(X_WT, tool.triangle(f))))))
                        return true;
            for (const int e : ours.edges)
                for (const int o : others.edges)
                    if (same(ofEdges(edge(tool, e, X_WT), edge(obstacle, o, X_WO[k])))) return true;
        }
        return false;
    }

    const World* world_;
};

}  // namespace touchstone::test
