#pragma once
// What a light far away sees: a depth texture that shaders compare with.
#include "engine/view/gl_objects.hpp"

namespace touchstone::engine {

/// A ball that a light is to see, in the world.
struct Ball {
    glm::vec3 center{0};
    float radius = 0;
};

/// View and projection of parallel light from a direction (unit, towards the light) that just holds all balls, and how
/// long a texel of a map of `size` texels is in the world.
struct LightView {
    glm::mat4 viewProjection{1};
    float texel = 0;

    LightView() = default;
    LightView(glm::vec3 towards, std::span<const Ball> balls, int size);
};

/// A square depth map, compared with linear filtering; what lies beside it is lit.
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
