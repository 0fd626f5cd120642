#pragma once
// Draws a frame: lit meshes, ghosts, sphere instances, arrows, lines, labels, grid. Lengths in metres, y is up.
// Materials are linear as in glTF; all other colours are sRGB, as one picks them from the screen.
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/mesh_data.hpp"
#include "engine/view/camera.hpp"

namespace touchstone::engine {

/// Geometry on the GPU. A cheap handle: copies share it, and the last one frees it while the context is current.
/// A default one is empty and draws nothing.
struct GpuMesh {
    struct Buffers;
    std::shared_ptr<const Buffers> buffers;

    explicit operator bool() const { return buffers != nullptr; }
};

/// A texture on the GPU, shared like GpuMesh.
struct GpuTexture {
    struct Storage;
    std::shared_ptr<const Storage> storage;

    explicit operator bool() const { return storage != nullptr; }
};

struct DrawItem {
    GpuMesh mesh;
    glm::mat4 model{1};  ///< to world; may mirror (negative determinant)
    Material material;   ///< its texture indices are not looked at: the textures below are what is drawn
    GpuTexture texture;  ///< of the base colour
    float alpha = 1;     ///< below 1: a ghost, through which all else is seen
    GpuTexture metallicRoughness = {}, normal = {}, emissive = {};
    int body = 0;  ///< items of one number bound a solid together, whose cut a section fills; 0: not filled
};

/// A straight line with round ends; a == b gives a dot of this width.
struct Line {
    glm::vec3 a, b;
    glm::vec4 color{1};
    float width = 2;  ///< in pixels before Frame::pixelScale
};

struct Arrow {
    glm::vec3 from, to;
    float radius = 0.001f;  ///< of the shaft, metres
    glm::vec4 color{1};
};

struct Sphere {
    glm::vec3 center;
    float radius = 0;
    glm::vec4 color{1};  ///< alpha below 1 is drawn translucent
};

/// A text over all else, a little to the right of a point.
struct Label {
    glm::vec3 at;
    std::string text;  ///< UTF-8, Latin-1
    glm::vec4 color{1};
};

struct Grid {
    bool visible = true;
    float height = 0;  ///< y of its plane
};

struct Background {
    glm::vec3 top{0.185f, 0.205f, 0.235f}, bottom{0.055f, 0.06f, 0.07f};
};

/// All that one picture shows; plain data, filled by the caller each time.
struct Frame {
    OrbitCamera camera;
    std::vector<DrawItem> items;
    std::vector<Sphere> spheres;
    std::vector<Arrow> arrows;
    std::vector<Line> lines;
    std::vector<Label> labels;
    Grid grid;
    Background background;
    bool shadows = true;               ///< of the opaque items, by the key light
    float pixelScale = 1;              ///< Window::scale(), for widths in pixels
    float hiddenOpacity = 0.45f;       ///< how strongly arrows and lines show through what stands before them
    std::optional<glm::vec4> section;  ///< plane (n, d): items and spheres are cut away where n·p + d < 0
};

/// What the last frame asked of the driver.
struct DrawCost {
    int calls = 0;
    std::size_t triangles = 0;
};

/// Pixels of the target framebuffer, from its lower-left corner.
struct Viewport {
    int x = 0, y = 0, width = 0, height = 0;
};

/// Draws frames with the context that was current when it was made; 4x multisampled where the driver has it.
/// Throws std::runtime_error naming file and line if a shader does not compile.
class Renderer {
  public:
    explicit Renderer(int samples = 4);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    GpuMesh upload(const MeshData& mesh);
    /// A picture in sRGB, or numbers to be taken as they stand.
    GpuTexture upload(const Image& image, bool srgb = true);

    /// Draws into a framebuffer object, or the window (0). An empty viewport draws nothing.
    void draw(const Frame& frame, const Viewport& viewport, unsigned framebuffer = 0);
    const DrawCost& cost() const;

  private:
    friend Image renderToImage(Renderer& renderer, const Frame& frame, int width, int height);
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The same picture in memory, sRGB, with or without a window.
Image renderToImage(Renderer& renderer, const Frame& frame, int width, int height);

}  // namespace touchstone::engine
