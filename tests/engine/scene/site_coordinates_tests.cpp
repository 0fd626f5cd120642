// Parts in site coordinates: formats x units x distances x precisions.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "engine/scene/mesh_file.hpp"
#include "tests/engine/scene/gltf_fixture.hpp"

namespace touchstone::site_coordinates_tests {

using namespace touchstone::engine;
using namespace touchstone::engine::test;

namespace {

// A peg of 10.05 x 10 x 40.003 mm, in mm from its corner.
const glm::dvec3 kSize(10.05, 10, 40.003);
const std::vector<std::array<int, 3>> kFaces{{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                             {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};

std::vector<glm::dvec3> corners(const glm::dvec3& at, double unit) {
    std::vector<glm::dvec3> all;
    for (int i = 0; i < 8; ++i) all.push_back((at + glm::dvec3(i & 1, i >> 1 & 1, i >> 2 & 1) * kSize) / unit);
    return all;
}

std::string numbers(const glm::dvec3& p, const char* format) {
    std::string text;
    for (int k = 0; k < 3; ++k) {
        char number[64];
        std::snprintf(number, sizeof number, format, p[k]);
        text += std::string(" ") + number;
    }
    return text;
}

std::string obj(const std::vector<glm::dvec3>& v, const char* format) {
    std::string text;
    for (const glm::dvec3& p : v) text += "v" + numbers(p, format) + "\n";
    for (const auto& f : kFaces)
        text +=
            "f " + std::to_string(f[0] + 1) + " " + std::to_string(f[1] + 1) + " " + std::to_string(f[2] + 1) + "\n";
    return text;
}

std::string stl(const std::vector<glm::dvec3>& v, const char* format) {
    std::string text = "solid peg\n";
    for (const auto& f : kFaces) {
        text += "facet normal 0 0 1\nouter loop\n";
        for (const int i : f) text += "vertex" + numbers(v[std::size_t(i)], format) + "\n";
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid peg\n";
}

std::string plyHeader(const char* format, const char* type) {
    std::string text = std::string("ply\nformat ") + format + " 1.0\nelement vertex 8\n";
    for (const char* axis : {"x", "y", "z"}) text += std::string("property ") + type + " " + axis + "\n";
    return text + "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string ply(const std::vector<glm::dvec3>& v, const char* format) {
    std::string text = plyHeader("ascii", "double");
    for (const glm::dvec3& p : v) text += numbers(p, format).substr(1) + "\n";
    for (const auto& f : kFaces)
        text += "3 " + std::to_string(f[0]) + " " + std::to_string(f[1]) + " " + std::to_string(f[2]) + "\n";
    return text;
}

template <class T>
void append(std::string& bytes, T value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof value);
}

template <class Real>
std::string binaryPly(const std::vector<glm::dvec3>& v) {
    std::string bytes = plyHeader("binary_little_endian", sizeof(Real) == 8 ? "double" : "float");
    for (const glm::dvec3& p : v)
        for (int k = 0; k < 3; ++k) append(bytes, Real(p[k]));
    for (const auto& f : kFaces) {
        append(bytes, std::uint8_t(3));
        for (const int i : f) append(bytes, std::int32_t(i));
    }
    return bytes;
}

std::string binaryStl(const std::vector<glm::dvec3>& v) {
    std::string bytes(80, ' ');
    append(bytes, std::uint32_t(kFaces.size()));
    for (const auto& f : kFaces) {
        for (int k = 0; k < 3; ++k) append(bytes, 0.f);
        for (const int i : f)
            for (int k = 0; k < 3; ++k) append(bytes, float(v[std::size_t(i)][k]));
        append(bytes, std::uint16_t(0));
    }
    return bytes;
}

TEST_CASE("mesh file: a part keeps its size wherever it lies, or the file is named as too coarse", "[mesh]") {
    const TemporaryFolder folder;
    const double diagonal = glm::length(kSize);
    int held = 0, named = 0;
    for (const double unit : {1.0, 10.0, 1000.0, 25.4})  // mm
        for (const double away : {0.0, 1e3, 4e5, 4e6})   // mm
            for (const int precision : {0, 1, 2, 3})
                for (const int format : {0, 1, 2, 3, 4, 5}) {
                    const glm::dvec3 at = away / 4e5 * glm::dvec3(412345.678, 1234.5, -98765.432);
                    const std::vector<glm::dvec3> v = corners(at, unit);
                    const char* digits = std::array{"%.17g", "%.9f", "%.6g", "%.9g"}[std::size_t(precision)];
                    const bool isText = format < 3;
                    if (!isText && precision > 0) continue;
                    const std::string name =
                        std::array{"a.obj", "a.stl", "a.ply", "b.ply", "c.ply", "d.stl"}[std::size_t(format)];
                    const std::string content = format == 0   ? obj(v, digits)
                                                : format == 1 ? stl(v, digits)
                                                : format == 2 ? ply(v, digits)
                                                : format == 3 ? binaryPly<double>(v)
                                                : format == 4 ? binaryPly<float>(v)
                                                              : binaryStl(v);
                    writeFile(folder / name, content);
                    INFO(name << ", unit " << unit << " mm, " << away << " mm away, " << digits);
                    const MeshFile read = readMeshFile(folder / name, unit / 1000);
                    glm::dvec3 low(1e30), high(-1e30);
                    for (const glm::dvec3 p : read.mesh.positions) {
                        low = glm::min(low, p);
                        high = glm::max(high, p);
                    }
                    const double error = glm::length((high - low) * 1000.0 - kSize);
                    const glm::dvec3 corner = (low + read.origin) * 1000.0;
                    // Both places of each axis are rounded: a part that is not named is right to 6e-5 of its size.
                    if (read.notes.empty()) {
                        CHECK(error <= 2 * std::sqrt(3.0) * 3e-5 * diagonal);
                        CHECK(glm::length(corner - at) <= std::sqrt(3.0) * 3e-5 * diagonal);
                    } else {
                        CHECK(read.notes[0].find("file units from the origin") != std::string::npos);
                        CHECK(away > 0);
                    }
                    // What the file holds exactly is only rounded to floats near the part, and again to meters.
                    if ((isText && precision == 0) || format == 3) {
                        CHECK(read.notes.empty());
                        CHECK(error <= 4 * 0x1p-24 * 100);
                    }
                    if (error > 1e-4 * diagonal && away > 0) CHECK_FALSE(read.notes.empty());
                    if (away == 0) CHECK(read.origin == glm::dvec3(0));
                    ++(read.notes.empty() ? held : named);
                }
    CHECK(held > 100);
    CHECK(named > 20);
}

TEST_CASE("mesh file: a text that was written from floats is as coarse as they are", "[mesh]") {
    const TemporaryFolder folder;
    std::vector<glm::dvec3> v = corners({412345.678, 1234.5, -98765.432}, 1);
    for (glm::dvec3& p : v) p = glm::dvec3(glm::vec3(p));
    for (const char* digits : {"%.6f", "%.9g"}) {
        writeFile(folder / "a.obj", obj(v, digits));
        CHECK(readMeshFile(folder / "a.obj", 0.001).notes.size() == 1);
    }
    // Whole millimeters are floats as well, and nothing is lost.
    v = corners({412345, 1234, -98765}, 1);
    for (glm::dvec3& p : v) p = glm::round(p);
    writeFile(folder / "a.obj", obj(v, "%.6f"));
    CHECK(readMeshFile(folder / "a.obj", 0.001).notes.empty());
}

}  // namespace
}  // namespace touchstone::site_coordinates_tests
