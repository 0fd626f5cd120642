#pragma once
// Meshes and a scene for `touchstone tree`, and its answers.
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <vector>

#include "engine/scene/gltf_write.hpp"
#include "tests/program/program.hpp"

namespace touchstone::test {

using Corners = std::array<glm::vec3, 3>;

/// An ellipsoid of 20 x 30 x 40 about the origin, as triangles.
inline std::vector<Corners> egg(int stacks, int slices) {
    const auto at = [&](int i, int k) {
        const double a = std::numbers::pi * i / stacks, b = 2 * std::numbers::pi * (k % slices) / slices;
        const double ring = i == 0 || i == stacks ? 0 : std::sin(a);  // all points of a pole coincide
        return glm::vec3(10 * ring * std::cos(b), 15 * std::cos(a), -20 * ring * std::sin(b));
    };
    std::vector<Corners> triangles;
    for (int i = 0; i < stacks; ++i)
        for (int k = 0; k < slices; ++k) {
            if (i > 0) triangles.push_back({at(i, k), at(i + 1, k), at(i, k + 1)});
            if (i + 1 < stacks) triangles.push_back({at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)});
        }
    return triangles;
}

inline std::string objOf(const std::vector<Corners>& triangles) {
    std::ostringstream out;
    out.precision(9);
    for (const Corners& corners : triangles)
        for (const glm::vec3& p : corners) out << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
    for (std::size_t i = 1; i <= 3 * triangles.size(); i += 3) out << "f " << i << ' ' << i + 1 << ' ' << i + 2 << '\n';
    return out.str();
}

inline std::string binaryStlOf(const std::vector<Corners>& triangles) {
    std::string out = "solid is how some binary files begin";
    out.resize(80);
    const auto append = [&](const void* data, std::size_t size) { out.append(static_cast<const char*>(data), size); };
    const auto count = static_cast<std::uint32_t>(triangles.size());
    append(&count, 4);
    for (const Corners& corners : triangles) {
        const glm::vec3 normal(0);
        append(&normal, 12);
        append(corners.data(), 36);
        out.append(2, '\0');
    }
    return out;
}

inline std::string asciiStlOf(const std::vector<Corners>& triangles) {
    std::ostringstream out;
    out << "solid egg\n";
    for (const Corners& corners : triangles) {
        out << "facet normal 0 0 0\nouter loop\n";
        for (const glm::vec3& p : corners) out << "vertex " << p.x << ' ' << p.y << ' ' << p.z << '\n';
        out << "endloop\nendfacet\n";
    }
    out << "endsolid egg\n";
    return out.str();
}

class TreeProgram : public Program {
  public:
    /// The path of a file with this content.
    std::string with(const std::string& name, const std::string& content) const {
        std::ofstream(file(name), std::ios::binary) << content;
        return file(name);
    }
    std::string eggFile() const { return with("egg.obj", objOf(egg(12, 24))); }

    /// The objects that `tree ARGS --json` prints.
    std::vector<nlohmann::json> trees(const std::string& args) const {
        const Answer answer = (*this)("tree " + args + " --json");
        INFO(args);
        INFO(answer.err);
        REQUIRE(answer.code == 0);
        std::vector<nlohmann::json> objects;
        std::istringstream lines(answer.out);
        for (std::string line; std::getline(lines, line);) objects.push_back(nlohmann::json::parse(line));
        return objects;
    }
    nlohmann::json tree(const std::string& args) const {
        const std::vector<nlohmann::json> all = trees(args);
        REQUIRE(all.size() == 1);
        return all.front();
    }
};

/// A tool, two obstacles that share a name with a lamp, a goal; in meters.
inline std::string partsScene(const Program& program) {
    engine::Scene scene;
    addBox(scene, "peg", glm::vec3(0.01f), {{"role", "tool"}, {"max_error_mm", 1.0}, {"interior", "solid"}});
    addBox(scene, "wall", glm::vec3(0.02f), {{"role", "obstacle"}, {"leaves", 32}}, {.translation = {0.1, 0, 0}});
    addBox(scene, "wall", glm::vec3(0.04f), {{"role", "obstacle"}, {"leaves", 64}}, {.translation = {-0.1, 0, 0}});
    addBox(scene, "lamp", glm::vec3(0.03f), {{"role", "visual"}}, {.translation = {0, 0.1, 0}});
    addBox(scene, "end", glm::vec3(0.01f), {{"role", "goal"}});
    addNode(scene, "empty");
    updateWorldTransforms(scene);
    engine::writeGltf(scene, program.file("parts.glb"));
    return program.file("parts.glb");
}

}  // namespace touchstone::test
