// The features at which the bundled parts can touch first.
#include <catch2/catch.hpp>
#include <map>

#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/surface/surface_features.hpp"

namespace touchstone::surface_tests {

TEST_CASE("surface: most vertices of machined parts and half of the bunny's can never touch first") {
    // Share of the vertices that remain. Turned and milled parts have them where their edges end.
    const std::map<std::string, double> most{{"spline", 0.03}, {"gears", 0.1}, {"lock", 0.1}, {"bunnies", 0.5}};
    const std::string name = GENERATE("spline", "gears", "lock", "bunnies");
    CAPTURE(name);
    const sandbox::HapticScene scene =
        sandbox::openScene(TOUCHSTONE_BINARY_DIR "/scenes/" + name + ".glb",
                           {.treeCache = TOUCHSTONE_BINARY_DIR "/trees", .progress = {}});
    const RepairedMesh body = repairMesh(sandbox::bakedTriangles(scene.scene, scene.roles.tool));
    REQUIRE(body.closed());
    const SurfaceFeatures f = surfaceFeatures(body);
    const SurfaceFeatures::Dropped& d = f.dropped;
    // Every edge of the closed surface, and every vertex, is either kept or counted.
    CHECK(2 * (f.edges.size() + d.flatEdges + d.concaveEdges) + d.buriedEdges == 3 * f.faces.size());
    CHECK(f.vertices.size() + d.unsupportedVertices + d.buriedVertices == f.points.size());
    CHECK(double(f.vertices.size()) < most.at(name) * double(f.points.size()));
    if (name == "spline") CHECK(f.vertices.size() == 208);  // of 7,378
}

}  // namespace touchstone::surface_tests
