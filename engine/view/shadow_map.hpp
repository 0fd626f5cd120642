#pragma once
// The shadow map of a directional light: a depth texture that shaders compare with.
#include "engine/view/gl_objects.hpp"

namespace touchstone::engine {

/// A ball in world coordinates that the shadow map must contain.
struct Ball {
    glm::vec3 center{0};
    float radius = 0;
};

/// View and projection of parallel light that just contain all balls, and the length of a texel in the world.
/// `toward`: unit direction to the light; `size`: texels per side of the map.
struct LightView {
    glm::mat4 viewProjection{1};
    float texel = 0;

    LightView() = default;
    LightView(glm::vec3 toward, std::span<const Ball> balls, int size);
};

/// A square depth map, compared with linear filtering. Points outside the map are lit.
class ShadowMap {
  public:
    explicit ShadowMap(int size);

    /// Binds the map for drawing, cleared, and sets the GL viewport.
    void begin() const;
    void bindTexture(GLenum unit) const;
    int size() const { return size_; }

  private:
    int size_;
    Texture depth_;
    Framebuffer framebuffer_;
};

}  // namespace touchstone::engine
