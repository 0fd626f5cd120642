#pragma once
// Shared by the source files of the renderer.
#include <algorithm>

#include "engine/view/gl_objects.hpp"
#include "engine/view/labels.hpp"
#include "engine/view/renderer.hpp"
#include "engine/view/shadow_map.hpp"

namespace touchstone::engine {

inline constexpr GLuint kColorAttribute = 3;  // of mesh.vert
inline constexpr int kShadowUnit = 4;         // texture unit after those of a material

/// Direction to the key light in the studio of lighting.glsl.
inline const glm::vec3 kKeyDirection = glm::normalize(glm::vec3(-0.45f, 0.74f, 0.5f));

struct GpuMesh::Buffers {
    VertexArray array;
    Buffer positions, normals, texcoords, colors, indices;
    GLsizei indexCount = 0;
    bool hasTexcoords = false, hasColors = false;
    bool seeThrough = false;  // by the alpha of its colors
    bool flat = false;
    Ball ball;  ///< bounding ball of the bounding box
};

struct GpuTexture::Storage {
    Texture texture;
};

/// Instanced drawing: a shape is drawn once per element of a vector streamed to the GPU.
struct Instances {
    VertexArray array;
    Buffer stream;

    template <class T>
    void draw(std::span<const T> instances, GLsizei vertices, DrawCost& cost, GLenum mode = GL_TRIANGLE_STRIP) {
        glBindVertexArray(array.id());
        stream.write(GL_ARRAY_BUFFER, instances, GL_STREAM_DRAW);
        glDrawArraysInstanced(mode, 0, vertices, static_cast<GLsizei>(instances.size()));
        ++cost.calls;
        cost.triangles += instances.size() * static_cast<std::size_t>(mode == GL_TRIANGLES ? vertices / 3 : 2);
    }
};

/// Content of a shadow map, to detect when it must be redrawn.
struct ShadowScene {
    struct Caster {
        std::shared_ptr<const GpuMesh::Buffers> mesh;
        glm::mat4 model{1};
        bool closed = false;
        friend bool operator==(const Caster&, const Caster&) = default;
    };
    std::vector<Caster> casters;
    std::optional<glm::vec4> section;
    glm::vec3 toward{0};  ///< direction to the light
    friend bool operator==(const ShadowScene&, const ShadowScene&) = default;
};

struct Blend {
    Blend() { glEnable(GL_BLEND); }
    ~Blend() { glDisable(GL_BLEND); }
};

struct Renderer::Impl {
    explicit Impl(int samples);

    void draw(const Frame& frame, int width, int height);

    void begin(const ShaderProgram& program) const;
    void drawShadows();
    void drawShadowMap();
    void drawBackground(const Background& background);
    void drawMesh(const ShaderProgram& program, const DrawItem& item);
    void cullWhereClosed(const DrawItem& item) const;
    void drawItem(const DrawItem& item);
    void drawOpaqueItems();
    void drawCaps();
    void drawQuad(GLenum mode = GL_TRIANGLE_STRIP, GLsizei vertices = 4);
    void drawGhosts();
    void drawSpheres(std::span<const Sphere> spheres, bool translucent);
    void drawGrid();
    void drawArrows(float opacity);
    void drawLines(float opacity);
    void drawLabels();

    /// Where the frame is drawn, or the last one was.
    RenderTarget& target() { return drawn == Detail::Full ? fullTarget : plainTarget; }
    RenderTarget fullTarget, plainTarget{0};
    Detail drawn = Detail::Full;
    ShadowMap shadowMap{2048};
    ShaderProgram background{"background.vert", "background.frag"}, mesh{"mesh.vert", "mesh.frag"},
        sphere{"sphere.vert", "sphere.frag"}, arrow{"arrow.vert", "arrow.frag"}, line{"line.vert", "line.frag"},
        grid{"grid.vert", "grid.frag"}, shadow{"shadow.vert", "shadow.frag"}, cap{"cap.vert", "cap.frag"},
        label{"label.vert", "label.frag"};
    VertexArray nothing;  // empty: some shaders compute their vertices themselves
    Instances spheres, arrows, lines, glyphs;
    std::unique_ptr<LabelFont> font;  // created with the first label
    Buffer arrowVertices;
    GLsizei arrowVertexCount = 0;

    // State of the frame being drawn:
    const Frame* frame = nullptr;
    glm::mat4 viewProjection{1};
    glm::mat3 rig{1};
    glm::vec3 eye{0};
    glm::vec2 size{1};
    float pixelScale = 1;  // of the target
    DrawCost cost;

    ShadowScene shadowed;  // content of the shadow map, kept between frames
    LightView light;
};

}  // namespace touchstone::engine
