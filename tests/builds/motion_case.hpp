#pragma once
// The parts and the motion of a scene as plain numbers, which a program without a reader of scenes can step.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/loop/world.hpp"
#include "haptics/math/hash.hpp"
#include "haptics/surface/surface.hpp"

namespace touchstone::builds {

/// A part of a world. Its sphere tree is the file NAME.spheres beside the case, NAME being its number; 0 is the tool.
struct MotionPart {
    TriangleMesh mesh;  ///< mm, in the node's frame
    bool byMesh = false, bySpheres = false, prefersSpheres = false, rubs = false;
    Material material;  ///< if it rubs
    Pose X_WO;          ///< of the tool: where it starts
};

struct MotionCase {
    std::vector<MotionPart> parts;
    std::vector<std::string> settings;  ///< KEY=VALUE
    std::vector<Pose> device;           ///< pose of each tick
};

/// Reads or writes, so that both have one order. Numbers keep their bits.
template <class Stream>
class CaseStream {
  public:
    CaseStream(const std::filesystem::path& file, std::ios::openmode mode) : stream_(file, mode | std::ios::binary) {
        if (!stream_) throw std::runtime_error("cannot open '" + file.string() + "'");
    }

    template <class Case>
    void pass(Case& all) {
        size(all.parts);
        for (auto& part : all.parts) {
            size(part.mesh.vertices);
            for (auto& vertex : part.mesh.vertices)
                for (int i = 0; i < 3; ++i) number(vertex[i]);
            size(part.mesh.triangles);
            for (auto& triangle : part.mesh.triangles)
                for (auto& corner : triangle) number(corner);
            number(part.mesh.grid), number(part.byMesh), number(part.bySpheres), number(part.prefersSpheres);
            number(part.rubs), number(part.material.rule);
            number(part.material.friction.atRest), number(part.material.friction.sliding);
            pose(part.X_WO);
        }
        size(all.settings);
        for (auto& setting : all.settings) {
            size(setting);
            for (auto& letter : setting) number(letter);
        }
        size(all.device);
        for (auto& at : all.device) pose(at);
        if (!stream_) throw std::runtime_error("a motion file is incomplete");
    }

  private:
    static constexpr bool kReads = std::is_same_v<Stream, std::ifstream>;

    template <class Number>
    void number(Number& value) {
        if constexpr (kReads)
            stream_.read(reinterpret_cast<char*>(&value), sizeof value);
        else
            stream_.write(reinterpret_cast<const char*>(&value), sizeof value);
    }
    template <class List>
    void size(List& list) {
        std::uint64_t count = list.size();
        number(count);
        if constexpr (kReads) list.resize(count);
    }
    template <class AnyPose>
    void pose(AnyPose& X) {
        for (int i = 0; i < 3; ++i) number(X.p[i]);
        for (int i = 0; i < 4; ++i) number(X.q.coeffs()[i]);
    }

    Stream stream_;
};

inline void writeCase(const std::filesystem::path& file, const MotionCase& all) {
    CaseStream<std::ofstream>(file, std::ios::out).pass(all);
}

inline MotionCase readCase(const std::filesystem::path& file) {
    MotionCase all;
    CaseStream<std::ifstream>(file, std::ios::in).pass(all);
    return all;
}

/// Hash of what the ticks read from the parts: the features of their meshes and the leaves of their trees.
inline std::uint64_t worldHash(const World& world) {
    Hash hash;
    const auto add = [&](const Part& part) {
        const Surface* const surface = part.surface.get();
        const SphereTree* const tree = part.spheres.get();
        if (surface) {
            for (const Vec3& point : surface->features.points) hash.add(point.data(), 3 * sizeof(double));
            for (const auto& face : surface->features.faces) hash.add(face.normal.data(), 3 * sizeof(double));
            for (const auto& edge : surface->features.edges) hash.add(edge.points);
            for (const auto& direction : surface->spokes) hash.add(direction.data(), 3 * sizeof(float));
        }
        if (tree)
            for (int i = 0; i < tree->leafCount(); ++i) hash.add(tree->leaf(i).center().data(), 3 * sizeof(double));
    };
    add(world.tool);
    for (const Obstacle& obstacle : world.obstacles) add(obstacle.part);
    return hash.value();
}

inline Settings settingsOf(const MotionCase& all) {
    Settings settings;
    for (const std::string& line : all.settings) {
        const std::size_t equals = line.find('=');
        const std::string error = setSetting(settings, line.substr(0, equals), line.substr(equals + 1));
        if (!error.empty()) throw std::runtime_error(error);
    }
    return settings;
}

}  // namespace touchstone::builds
