// Assemblies as the bytes that the reader of CAD files writes.
#include "engine/scene/cad_parts.hpp"

#include <catch2/catch.hpp>

namespace touchstone::cad_parts_tests {

using namespace touchstone::engine;

namespace {

std::vector<CadAssembly> twoFiles() {
    CadShape shape;
    shape.faces.resize(2);
    shape.faces[0] = {.surface = CadSurface::Cylinder, .hollow = true, .radius = 0.005, .triangles = 1, .facets = 81};
    shape.faces[1].triangles = 1;
    shape.vertices = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 1.0 / 3}};
    shape.triangles = {{0, 1, 2}, {3, 2, 1}};
    CadAssembly first{.name = "fit", .schema = "AP242", .unit = "in", .metersPerUnit = 0.0254};
    first.shapes = {shape};
    first.parts = {{.name = "hub"}, {.name = "shaft", .path = "fit/shaft", .color = glm::vec3(1, 0.5f, 0)}};
    first.parts[1].placement[3] = {1, 2, 3, 1};
    first.notes = {"a sentence"};
    return {first, {}};
}

}  // namespace

TEST_CASE("cad parts: bytes give the same assemblies", "[cad]") {
    const auto read = cadFromBytes(cadBytes(twoFiles()));
    REQUIRE(read);
    REQUIRE(read->size() == 2);
    const CadAssembly& first = (*read)[0];
    CHECK(first.name == "fit");
    CHECK(first.schema == "AP242");
    CHECK(first.unit == "in");
    CHECK(first.metersPerUnit == 0.0254);
    REQUIRE(first.shapes.size() == 1);
    CHECK(first.shapes[0].faces[0].surface == CadSurface::Cylinder);
    CHECK(first.shapes[0].faces[0].hollow);
    CHECK(first.shapes[0].faces[0].facets == 81);
    CHECK(first.shapes[0].vertices == twoFiles()[0].shapes[0].vertices);
    CHECK(first.shapes[0].triangles == twoFiles()[0].shapes[0].triangles);
    REQUIRE(first.parts.size() == 2);
    CHECK_FALSE(first.parts[0].color);
    CHECK(first.parts[1].path == "fit/shaft");
    CHECK(first.parts[1].color == glm::vec3(1, 0.5f, 0));
    CHECK(first.parts[1].placement == twoFiles()[0].parts[1].placement);
    CHECK(first.notes == twoFiles()[0].notes);
}

TEST_CASE("cad parts: truncated bytes and wrong indices give nothing", "[cad]") {
    const std::string whole = cadBytes(twoFiles());
    for (std::size_t size = 0; size < whole.size(); ++size) {
        INFO(size);
        CHECK_FALSE(cadFromBytes(std::string_view(whole).substr(0, size)));
    }
    CHECK_FALSE(cadFromBytes(whole + "x"));
    auto wrong = twoFiles();
    wrong[0].parts[0].shape = 1;
    CHECK_FALSE(cadFromBytes(cadBytes(wrong)));
    wrong = twoFiles();
    wrong[0].shapes[0].triangles[1][2] = 4;
    CHECK_FALSE(cadFromBytes(cadBytes(wrong)));
    wrong = twoFiles();
    wrong[0].shapes[0].faces[1].triangles = 2;
    CHECK_FALSE(cadFromBytes(cadBytes(wrong)));
}

}  // namespace touchstone::cad_parts_tests
