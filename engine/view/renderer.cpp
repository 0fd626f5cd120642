#include "engine/view/renderer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/view/arrow_shape.hpp"
#include "engine/view/gl_context.hpp"
#include "engine/view/renderer_impl.hpp"

namespace touchstone::engine {
namespace {

void attribute(GLuint index, GLint size, std::size_t stride, std::size_t offset, GLuint divisor) {
    glEnableVertexAttribArray(index);
    glVertexAttribPointer(index, size, GL_FLOAT, GL_FALSE, static_cast<GLsizei>(stride),
                          reinterpret_cast<const void*>(offset));
    glVertexAttribDivisor(index, divisor);
}

/// Rotation from the world to the studio of lighting.glsl, which turns with the camera about the vertical.
glm::mat3 studioRig(const OrbitCamera& camera) {
    const glm::vec3 right = camera.right(), up{0, 1, 0};
    return glm::transpose(glm::mat3(right, up, glm::cross(right, up)));
}

}  // namespace

Renderer::Impl::Impl(int samples) : fullTarget(samples) {
    glBindVertexArray(spheres.array.id());
    glBindBuffer(GL_ARRAY_BUFFER, spheres.stream.id());
    attribute(0, 3, sizeof(Sphere), offsetof(Sphere, center), 1);
    attribute(1, 1, sizeof(Sphere), offsetof(Sphere, radius), 1);
    attribute(2, 4, sizeof(Sphere), offsetof(Sphere, color), 1);

    glBindVertexArray(lines.array.id());
    glBindBuffer(GL_ARRAY_BUFFER, lines.stream.id());
    attribute(0, 3, sizeof(Line), offsetof(Line, a), 1);
    attribute(1, 3, sizeof(Line), offsetof(Line, b), 1);
    attribute(2, 4, sizeof(Line), offsetof(Line, color), 1);
    attribute(3, 1, sizeof(Line), offsetof(Line, width), 1);

    glBindVertexArray(glyphs.array.id());
    glBindBuffer(GL_ARRAY_BUFFER, glyphs.stream.id());
    attribute(0, 4, sizeof(Glyph), offsetof(Glyph, pixels), 1);
    attribute(1, 4, sizeof(Glyph), offsetof(Glyph, texels), 1);
    attribute(2, 4, sizeof(Glyph), offsetof(Glyph, color), 1);

    const std::vector<ArrowVertex> shape = arrowShape();
    arrowVertexCount = static_cast<GLsizei>(shape.size());
    glBindVertexArray(arrows.array.id());
    arrowVertices.write(GL_ARRAY_BUFFER, std::span(shape), GL_STATIC_DRAW);
    attribute(0, 4, sizeof(ArrowVertex), offsetof(ArrowVertex, profile), 0);
    attribute(1, 4, sizeof(ArrowVertex), offsetof(ArrowVertex, ring), 0);
    glBindBuffer(GL_ARRAY_BUFFER, arrows.stream.id());
    attribute(2, 3, sizeof(Arrow), offsetof(Arrow, from), 1);
    attribute(3, 3, sizeof(Arrow), offsetof(Arrow, to), 1);
    attribute(4, 1, sizeof(Arrow), offsetof(Arrow, radius), 1);
    attribute(5, 4, sizeof(Arrow), offsetof(Arrow, color), 1);
}

void Renderer::Impl::begin(const ShaderProgram& program) const {
    program.use();
    program.set("viewProjection", viewProjection);
    program.set("eye", eye);
    program.set("rig", rig);
    program.set("viewport", size);
    program.set("pixelScale", pixelScale);
    program.set("section", frame->section.value_or(glm::vec4(0, 0, 0, 1)));
    program.set("keyDirection", kKeyDirection);
    const glm::mat4 toMap = glm::translate(glm::mat4(1), glm::vec3(0.5f)) * glm::scale(glm::mat4(1), glm::vec3(0.5f));
    program.set("shadowed", shadowed.casters.empty() ? 0 : 1);
    program.set("shadowMap", kShadowUnit);
    program.set("shadowMatrix", toMap * light.viewProjection);
    program.set("shadowTexel", light.texel);
}

void Renderer::Impl::drawQuad(GLenum mode, GLsizei vertices) {
    glBindVertexArray(nothing.id());
    glDrawArrays(mode, 0, vertices);
    ++cost.calls;
    cost.triangles += static_cast<std::size_t>(vertices - 2);
}

void Renderer::Impl::draw(const Frame& toDraw, int width, int height) {
    frame = &toDraw;
    drawn = frame->detail;
    size = drawn == Detail::Draft ? glm::max(glm::vec2(width / 2, height / 2), 1.0f) : glm::vec2(width, height);
    pixelScale = frame->pixelScale * size.y / static_cast<float>(height);
    viewProjection = frame->camera.projection(size.x / size.y) * frame->camera.view();
    eye = frame->camera.eye();
    rig = studioRig(frame->camera);
    cost = {};

    // ImGui and other code share the context, so all relevant state is set here.
    glDisable(GL_SCISSOR_TEST);
    glDisable(GL_STENCIL_TEST);
    glDisable(GL_BLEND);
    glDisable(GL_CULL_FACE);
    glDisable(GL_FRAMEBUFFER_SRGB);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDepthMask(GL_TRUE);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glPolygonMode(GL_FRONT_AND_BACK, GL_FILL);
    glFrontFace(GL_CCW);
    glStencilMask(0xff);
    glDepthFunc(GL_LESS);

    drawShadows();
    target().begin(static_cast<int>(size.x), static_cast<int>(size.y));
    glClear(GL_DEPTH_BUFFER_BIT);
    drawBackground(frame->background);
    glEnable(GL_DEPTH_TEST);
    drawOpaqueItems();
    if (frame->section) drawCaps();
    drawSpheres(frame->spheres, false);
    drawGrid();

    // Hidden parts of arrows and lines shine faintly through solids.
    if (frame->hiddenOpacity > 0) {
        glDepthFunc(GL_GREATER);
        glDepthMask(GL_FALSE);
        drawArrows(frame->hiddenOpacity);
        drawLines(frame->hiddenOpacity);
        glDepthMask(GL_TRUE);
        glDepthFunc(GL_LESS);
    }
    drawArrows(1);
    drawSpheres(frame->spheres, true);
    drawLines(1);
    drawGhosts();

    glDisable(GL_DEPTH_TEST);
    drawLabels();
    glBindVertexArray(0);
    glUseProgram(0);
    target().resolve();
    frame = nullptr;
}

void Renderer::Impl::drawBackground(const Background& colors) {
    begin(background);
    background.set("top", colors.top);
    background.set("bottom", colors.bottom);
    glDisable(GL_DEPTH_TEST);
    drawQuad(GL_TRIANGLES, 3);
}

void Renderer::Impl::drawSpheres(std::span<const Sphere> all, bool translucent) {
    std::vector<Sphere> chosen;
    std::copy_if(all.begin(), all.end(), std::back_inserter(chosen),
                 [&](const Sphere& s) { return (s.color.a < 1) == translucent; });
    if (chosen.empty()) return;

    begin(sphere);
    sphere.set("cameraUp", frame->camera.up());
    sphere.set("pixelAngle", 2 * std::tan(frame->camera.fovY / 2) / size.y);
    sphere.set("translucent", translucent ? 1 : 0);
    if (translucent) {
        const glm::vec3 forward = frame->camera.forward();
        std::sort(chosen.begin(), chosen.end(), [&](const Sphere& a, const Sphere& b) {
            return glm::dot(a.center, forward) > glm::dot(b.center, forward);
        });
        const Blend blend;
        glDepthMask(GL_FALSE);
        spheres.draw<Sphere>(chosen, 4, cost);
        glDepthMask(GL_TRUE);
    } else {
        // Partial coverage at the outline becomes a share of the samples: smooth edges without sorting.
        glEnable(GL_SAMPLE_ALPHA_TO_COVERAGE);
        spheres.draw<Sphere>(chosen, 4, cost);
        glDisable(GL_SAMPLE_ALPHA_TO_COVERAGE);
    }
}

void Renderer::Impl::drawGrid() {
    if (!frame->grid.visible) return;
    // The spacing of the strong lines follows the camera distance in powers of ten; weak lines fade as they get dense.
    const float decades = std::log10(frame->camera.distance / 2);
    const float spacing = std::pow(10.f, std::floor(decades));
    begin(grid);
    grid.set("gridCenter", glm::vec3(frame->camera.target.x, frame->grid.height, frame->camera.target.z));
    grid.set("gridExtent", 9 * frame->camera.distance);
    grid.set("spacing", spacing);
    grid.set("weakOpacity", 1 - (decades - std::floor(decades)));
    const Blend blend;
    glDepthMask(GL_FALSE);
    drawQuad();
    glDepthMask(GL_TRUE);
}

void Renderer::Impl::drawArrows(float opacity) {
    if (frame->arrows.empty()) return;
    begin(arrow);
    arrow.set("headRadius", kArrowHeadRadius);
    arrow.set("headLength", kArrowHeadLength);
    arrow.set("opacity", opacity);
    const Blend blend;
    glEnable(GL_CULL_FACE);
    arrows.draw<Arrow>(frame->arrows, arrowVertexCount, cost, GL_TRIANGLES);
    glDisable(GL_CULL_FACE);
}

void Renderer::Impl::drawLines(float opacity) {
    if (frame->lines.empty()) return;
    begin(line);
    line.set("opacity", opacity);
    const Blend blend;
    lines.draw<Line>(frame->lines, 4, cost);
}

void Renderer::Impl::drawLabels() {
    if (frame->labels.empty()) return;
    if (!font || font->pixelScale() != pixelScale) font = std::make_unique<LabelFont>(pixelScale);
    std::vector<Glyph> all;
    std::vector<glm::vec4> taken;
    for (const Label& text : frame->labels) {
        const auto at = frame->camera.project(text.at, size);
        if (!at) continue;
        const std::size_t first = all.size();
        font->append(all, text.text, *at + glm::vec2(14 * pixelScale, 0), text.color);
        placeLabel(std::span(all).subspan(first), taken, size);
    }
    if (all.empty()) return;
    begin(label);
    label.set("glyphs", 0);
    font->bindTexture(GL_TEXTURE0);
    const Blend blend;
    glyphs.draw<Glyph>(all, 4, cost);
}

Renderer::Renderer(int samples) : impl_(std::make_unique<Impl>(samples)) {}
Renderer::~Renderer() = default;

GpuMesh Renderer::upload(const MeshData& data) {
    if (data.indices.empty()) return {};
    assert(data.normals.size() == data.positions.size());
    assert(data.colors.empty() || data.colors.size() == data.positions.size());
    assert(data.texcoords.empty() || data.texcoords.size() == data.positions.size());
    auto buffers = std::make_shared<GpuMesh::Buffers>();
    buffers->indexCount = static_cast<GLsizei>(data.indices.size());
    buffers->hasTexcoords = !data.texcoords.empty();
    buffers->hasColors = !data.colors.empty();
    buffers->seeThrough =
        std::any_of(data.colors.begin(), data.colors.end(), [](const glm::vec4& c) { return c.a < 1; });
    buffers->flat = data.flat;
    glm::vec3 low = data.positions.front(), high = low;
    for (const glm::vec3& p : data.positions) {
        low = glm::min(low, p);
        high = glm::max(high, p);
    }
    buffers->ball = {0.5f * (low + high), 0.5f * glm::distance(low, high)};

    glBindVertexArray(buffers->array.id());
    buffers->positions.write(GL_ARRAY_BUFFER, std::span(data.positions), GL_STATIC_DRAW);
    attribute(0, 3, 0, 0, 0);
    buffers->normals.write(GL_ARRAY_BUFFER, std::span(data.normals), GL_STATIC_DRAW);
    attribute(1, 3, 0, 0, 0);
    if (buffers->hasTexcoords) {
        buffers->texcoords.write(GL_ARRAY_BUFFER, std::span(data.texcoords), GL_STATIC_DRAW);
        attribute(2, 2, 0, 0, 0);
    }
    if (buffers->hasColors) {
        buffers->colors.write(GL_ARRAY_BUFFER, std::span(data.colors), GL_STATIC_DRAW);
        attribute(kColorAttribute, 4, 0, 0, 0);
    }
    buffers->indices.write(GL_ELEMENT_ARRAY_BUFFER, std::span(data.indices), GL_STATIC_DRAW);
    glBindVertexArray(0);
    return {std::move(buffers)};
}

GpuTexture Renderer::upload(const Image& image, bool srgb) {
    glActiveTexture(GL_TEXTURE0);
    return {std::make_shared<GpuTexture::Storage>(GpuTexture::Storage{Texture(image, srgb)})};
}

const DrawCost& Renderer::cost() const { return impl_->cost; }

void Renderer::draw(const Frame& frame, const Viewport& viewport, unsigned framebuffer) {
    if (viewport.width <= 0 || viewport.height <= 0) return;
    impl_->draw(frame, viewport.width, viewport.height);
    showAgain(viewport, framebuffer);
}

void Renderer::showAgain(const Viewport& viewport, unsigned framebuffer) {
    const auto width = static_cast<int>(impl_->size.x), height = static_cast<int>(impl_->size.y);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, impl_->target().resolved().id());
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
    glBlitFramebuffer(0, 0, width, height, viewport.x, viewport.y, viewport.x + viewport.width,
                      viewport.y + viewport.height, GL_COLOR_BUFFER_BIT,
                      impl_->drawn == Detail::Draft ? GL_LINEAR : GL_NEAREST);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
}

Image renderToImage(Renderer& renderer, const Frame& frame, int width, int height) {
    assert(width > 0 && height > 0);
    assert(frame.detail != Detail::Draft);
    renderer.impl_->draw(frame, width, height);
    glBindFramebuffer(GL_FRAMEBUFFER, renderer.impl_->target().resolved().id());
    Image image = readPixels(width, height);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    return image;
}

}  // namespace touchstone::engine
