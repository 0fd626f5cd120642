#include "haptics/sandbox/picture/tree_picture.hpp"

#include <Eigen/Geometry>

#include "engine/view/gl_context.hpp"
#include "engine/view/image_file.hpp"
#include "haptics/sandbox/picture/scene_overlays.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

/// Scales bodies of any size to one meter about the origin, which suits the camera and its depth range.
struct Frame {
    Vec3 middle = Vec3::Zero();
    double scale = 1;

    explicit Frame(const TriangleMesh& mesh) {
        Eigen::AlignedBox3d box;
        for (const auto& triangle : mesh.triangles)
            for (const std::uint32_t v : triangle) box.extend(mesh.vertices[v]);
        middle = box.center();
        if (box.diagonal().norm() > 0) scale = 1 / box.diagonal().norm();
    }
    glm::vec3 operator()(const Vec3& p) const { return glm::vec3(toGlm(Vec3(scale * (p - middle)))); }
};

}  // namespace

void renderTree(const SphereTree& tree, const TriangleMesh& mesh, const std::filesystem::path& file, int width,
                int height) {
    const Frame at(mesh);
    engine::MeshData surface;
    for (const Vec3& p : mesh.vertices) surface.positions.push_back(at(p));
    for (const auto& t : mesh.triangles) surface.indices.insert(surface.indices.end(), t.begin(), t.end());
    surface.normals = smoothNormals(surface);
    // The mesh is drawn slightly inside, so that it does not show where a leaf only just reaches the surface, through
    // rounding or the facets of a drawn sphere.
    constexpr float kBelow = 1e-3f;
    for (std::size_t i = 0; i < surface.positions.size(); ++i) surface.positions[i] -= kBelow * surface.normals[i];

    const engine::HeadlessContext context;
    engine::Renderer renderer;
    engine::Frame frame;
    frame.grid.visible = false;
    frame.camera.yaw = 0.35f;
    frame.camera.pitch = 0.2f;
    for (int i = 0; i < tree.leafCount(); ++i) {
        const Sphere s = tree.leaf(i);
        frame.spheres.push_back({.center = at(Vec3(s.x, s.y, s.z)),
                                 .radius = static_cast<float>(at.scale * s.r),
                                 .color = sphereColor(true, 0, i)});
    }
    // The view fits the mesh, not the leaves, so that all trees of one mesh are shown at the same scale.
    fitPoints(frame.camera, surface.positions, static_cast<float>(width) / static_cast<float>(height));
    engine::DrawItem item;
    item.mesh = renderer.upload(surface);
    item.material = {.name = "mesh", .baseColor = {0.25f, 0.02f, 0.5f, 1}, .metallic = 0, .roughness = 0.8f};
    frame.items.push_back(std::move(item));
    engine::writePng(file, engine::renderToImage(renderer, frame, width, height));
}

}  // namespace touchstone::sandbox
