#pragma once
// Draws a frame: lit meshes, ghosts, sphere instances, arrows, lines, labels, grid. Lengths in meters, y is up.
// Material colors are linear as in glTF; all other colors are sRGB.
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/mesh_data.hpp"
#include "engine/view/camera.hpp"

namespace touchstone::engine {

/// A shared handle of geometry on the GPU. The context must be current when the last copy is destroyed. A default
/// handle is empty and draws nothing.
struct GpuMesh {
    struct Buffers;
    std::shared_ptr<const Buffers> buffers;

    explicit operator bool() const { return buffers != nullptr; }
    friend bool operator==(const GpuMesh&, const GpuMesh&) = default;
};

/// A texture on the GPU, shared like GpuMesh.
struct GpuTexture {
    struct Storage;
    std::shared_ptr<const Storage> storage;

    explicit operator bool() const { return storage != nullptr; }
    friend bool operator==(const GpuTexture&, const GpuTexture&) = default;
};

struct DrawItem {
    GpuMesh mesh;
    glm::mat4 model{1};  ///< model to world; may mirror (negative determinant)
    Material material;   ///< its texture indices are ignored; the textures below are used
    GpuTexture texture;  ///< base color
    float alpha = 1;     ///< below 1: a translucent ghost
    GpuTexture metallicRoughness = {}, normal = {}, emissive = {};
    int body = 0;  ///< items of one number together bound a solid, and a section fills its cut; 0: not filled
    friend bool operator==(const DrawItem&, const DrawItem&) = default;
};

/// A straight line with round ends; a == b gives a dot whose diameter is the width.
struct Line {
    glm::vec3 a, b;
    glm::vec4 color{1};
    float width = 2;  ///< in pixels before Frame::pixelScale
    friend bool operator==(const Line&, const Line&) = default;
};

struct Arrow {
    glm::vec3 from, to;
    float radius = 0.001f;  ///< of the shaft, meters
    glm::vec4 color{1};
    friend bool operator==(const Arrow&, const Arrow&) = default;
};

struct Sphere {
    glm::vec3 center;
    float radius = 0;
    glm::vec4 color{1};  ///< alpha below 1: translucent
    friend bool operator==(const Sphere&, const Sphere&) = default;
};

/// A text on top of everything else, slightly to the right of a point.
struct Label {
    glm::vec3 at;
    std::string text;  ///< UTF-8, Latin-1
    glm::vec4 color{1};
    friend bool operator==(const Label&, const Label&) = default;
};

struct Grid {
    bool visible = true;
    float height = 0;  ///< y of its plane
    friend bool operator==(const Grid&, const Grid&) = default;
};

struct Background {
    glm::vec3 top{0.185f, 0.205f, 0.235f}, bottom{0.055f, 0.06f, 0.07f};
    friend bool operator==(const Background&, const Background&) = default;
};

/// How finely a frame is drawn. Less than Full is for drivers that draw without a graphics card: Plain takes them a
/// fifth of the time, Draft a tenth.
enum class Detail {
    Full,   ///< with multisampling
    Plain,  ///< one sample for each pixel
    Draft,  ///< a quarter of the pixels, one sample for each, without shadows
};

/// Content of one picture, as plain data that the caller fills for each frame.
struct Frame {
    OrbitCamera camera;
    std::vector<DrawItem> items;
    std::vector<Sphere> spheres;
    std::vector<Arrow> arrows;
    std::vector<Line> lines;
    std::vector<Label> labels;
    Grid grid;
    Background background;
    bool shadows = true;               ///< opaque items cast shadows from the key light
    float pixelScale = 1;              ///< factor on widths in pixels, from Window::scale()
    float hiddenOpacity = 0.45f;       ///< opacity of arrows and lines behind other geometry
    std::optional<glm::vec4> section;  ///< plane (n, d): items and spheres are cut away where n·p + d < 0
    Detail detail = Detail::Full;
    friend bool operator==(const Frame&, const Frame&) = default;
};

/// Draw calls and triangles of the last frame.
struct DrawCost {
    int calls = 0;
    std::size_t triangles = 0;
};

/// Pixels of the target framebuffer, from its lower-left corner.
struct Viewport {
    int x = 0, y = 0, width = 0, height = 0;
    friend bool operator==(const Viewport&, const Viewport&) = default;
};

/// Draws frames in the context that was current at its construction, with 4x multisampling if available.
/// Throws std::runtime_error naming file and line if a shader does not compile.
class Renderer {
  public:
    explicit Renderer(int samples = 4);
    ~Renderer();
    Renderer(const Renderer&) = delete;
    Renderer& operator=(const Renderer&) = delete;

    GpuMesh upload(const MeshData& mesh);
    /// `srgb`: the image holds sRGB colors; else its values are used unchanged.
    GpuTexture upload(const Image& image, bool srgb = true);

    /// Draws into a framebuffer object, or the window (0). An empty viewport draws nothing.
    void draw(const Frame& frame, const Viewport& viewport, unsigned framebuffer = 0);
    /// Shows the last frame that draw() drew again, at the cost of a copy.
    void showAgain(const Viewport& viewport, unsigned framebuffer = 0);
    const DrawCost& cost() const;

  private:
    friend Image renderToImage(Renderer& renderer, const Frame& frame, int width, int height);
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Renders a frame to an sRGB image in memory, with or without a window. Pre: width, height > 0.
Image renderToImage(Renderer& renderer, const Frame& frame, int width, int height);

}  // namespace touchstone::engine
