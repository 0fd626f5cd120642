#include "tools/parts/export_faults.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

namespace touchstone::app {
namespace {

using Corners = std::array<glm::dvec3, 3>;

/// Fraction of the least altitude of a triangle by which an inner wall lies below it.
constexpr double kBelow = 0.05;

class Exporter {
  public:
    Exporter(const engine::MeshData& mesh, const ExportFaults& faults) : faults_(faults), random_(faults.seed) {
        for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
            Corners c;
            for (std::size_t k = 0; k < 3; ++k) c[k] = rounded(glm::dvec3(mesh.positions[mesh.indices[i + k]]));
            triangles_.push_back(c);
        }
    }

    engine::MeshData run() {
        const std::size_t whole = triangles_.size();
        // A triangle is split at one side at most, so that its other sides still meet their neighbors.
        for (std::size_t i = 0; i < whole; ++i) {
            if (happens(faults_.junctions))
                split(i, false);
            else if (happens(faults_.slivers))
                split(i, true);
            if (happens(faults_.innerWalls)) addWallBelow(triangles_[i]);
            if (happens(faults_.degenerate)) added_.push_back({triangles_[i][0], triangles_[i][1], triangles_[i][1]});
        }
        triangles_.insert(triangles_.end(), added_.begin(), added_.end());
        if (faults_.everythingTwice) {
            const std::vector<Corners> copy = triangles_;
            triangles_.insert(triangles_.end(), copy.begin(), copy.end());
        }
        engine::MeshData out;
        for (Corners& c : triangles_) {
            if (happens(faults_.flipped)) std::swap(c[1], c[2]);
            for (const glm::dvec3& p : c) {
                out.indices.push_back(std::uint32_t(out.positions.size()));
                out.positions.emplace_back(p);
            }
        }
        out.normals = smoothNormals(out);
        return out;
    }

  private:
    bool happens(double share) { return std::uniform_real_distribution<>(0, 1)(random_) < share; }
    glm::dvec3 rounded(const glm::dvec3& p) const {
        return faults_.grid > 0 ? glm::round(p / faults_.grid) * faults_.grid : p;
    }

    /// Splits a triangle at a point of its first side, which the neighbor does not have; with a sliver between the two.
    void split(std::size_t i, bool sliver) {
        const auto [a, b, c] = triangles_[i];
        const glm::dvec3 v = rounded(glm::mix(a, b, std::uniform_real_distribution<>(0.2, 0.8)(random_)));
        triangles_[i] = {a, v, c};
        added_.push_back({v, b, c});
        if (sliver) added_.push_back({a, b, v});
    }

    void addWallBelow(const Corners& t) {
        const glm::dvec3 twiceArea = glm::cross(t[1] - t[0], t[2] - t[0]);
        const double longest =
            std::max({glm::distance(t[0], t[1]), glm::distance(t[1], t[2]), glm::distance(t[2], t[0])});
        const double altitude = glm::length(twiceArea) / longest;
        if (!(altitude * kBelow > 2 * faults_.grid)) return;
        const glm::dvec3 middle = (t[0] + t[1] + t[2]) / 3.0, down = -kBelow * altitude * glm::normalize(twiceArea);
        Corners wall;
        for (std::size_t k = 0; k < 3; ++k) wall[k] = rounded(glm::mix(t[k], middle, 0.5) + down);
        added_.push_back(wall);
    }

    const ExportFaults& faults_;
    std::mt19937 random_;
    std::vector<Corners> triangles_, added_;
};

}  // namespace

engine::MeshData withFaults(const engine::MeshData& mesh, const ExportFaults& faults) {
    return Exporter(mesh, faults).run();
}

void addFaults(engine::Scene& scene, const ExportFaults& faults) {
    std::map<const engine::MeshData*, std::shared_ptr<const engine::MeshData>> made;
    for (const engine::Entity node : scene.nodes) {
        auto* instance = node ? scene.registry.find<engine::MeshInstance>(node) : nullptr;
        if (!instance) continue;
        for (engine::Primitive& primitive : instance->primitives) {
            auto& mesh = made[primitive.mesh.get()];
            if (!mesh) mesh = std::make_shared<const engine::MeshData>(withFaults(*primitive.mesh, faults));
            primitive.mesh = mesh;
        }
    }
}

}  // namespace touchstone::app
