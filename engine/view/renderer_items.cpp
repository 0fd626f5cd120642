// Drawing of meshes: shadows, solids and their cuts, ghosts.
#include <glm/gtc/matrix_inverse.hpp>

#include "engine/view/renderer_impl.hpp"

namespace touchstone::engine {
namespace {

Ball ballOf(const DrawItem& item) {
    const Ball& ball = item.mesh.buffers->ball;
    const glm::mat3 m(item.model);
    return {glm::vec3(item.model * glm::vec4(ball.center, 1)),
            ball.radius * std::max({glm::length(m[0]), glm::length(m[1]), glm::length(m[2])})};
}

/// Whether its material lets other things show through. Many files ask for blending where nothing is see-through.
bool isSeeThrough(const DrawItem& item) {
    return item.material.alphaMode == AlphaMode::Blend &&
           (item.material.baseColor.a < 1 || item.texture || item.mesh.buffers->seeThrough);
}

bool isSolid(const DrawItem& item) { return item.mesh && item.alpha >= 1 && !isSeeThrough(item); }

}  // namespace

void Renderer::Impl::drawMesh(const ShaderProgram& program, const DrawItem& item) {
    program.set("model", item.model);
    // A mirroring matrix reverses the winding order, by which the shader determines the outside.
    glFrontFace(glm::determinant(glm::mat3(item.model)) < 0 ? GL_CW : GL_CCW);
    glBindVertexArray(item.mesh.buffers->array.id());
    glDrawElements(GL_TRIANGLES, item.mesh.buffers->indexCount, GL_UNSIGNED_INT, nullptr);
    glFrontFace(GL_CCW);
    ++cost.calls;
    cost.triangles += static_cast<std::size_t>(item.mesh.buffers->indexCount / 3);
}

/// Culls back faces of closed solids, whose far side is never visible; this halves the work. drawOpaqueItems() does
/// not cull, since a mesh may be inside out.
void Renderer::Impl::cullWhereClosed(const DrawItem& item) const {
    if (item.body != 0 && !frame->section)
        glEnable(GL_CULL_FACE);
    else
        glDisable(GL_CULL_FACE);
}

void Renderer::Impl::drawItem(const DrawItem& item) {
    mesh.set("normalMatrix", glm::inverseTranspose(glm::mat3(item.model)));
    mesh.set("baseColor", item.material.baseColor);
    mesh.set("metallic", item.material.metallic);
    mesh.set("roughness", item.material.roughness);
    mesh.set("normalScale", item.material.normalScale);
    mesh.set("emissive", item.material.emissive);
    mesh.set("alpha", item.alpha);
    mesh.set("blended", isSeeThrough(item) ? 1 : 0);
    mesh.set("alphaCutoff", item.material.alphaMode == AlphaMode::Mask ? item.material.alphaCutoff : 0.f);
    mesh.set("flatShaded", item.mesh.buffers->flat ? 1 : 0);
    if (!item.mesh.buffers->hasColors) glVertexAttrib4f(kColorAttribute, 1, 1, 1, 1);
    const auto bind = [&](const char* has, const char* sampler, int unit, const GpuTexture& texture) {
        const bool used = texture && item.mesh.buffers->hasTexcoords;
        mesh.set(has, used ? 1 : 0);
        mesh.set(sampler, unit);
        if (!used) return;
        glActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
        glBindTexture(GL_TEXTURE_2D, texture.storage->texture.id());
    };
    bind("baseTextured", "baseTexture", 0, item.texture);
    bind("surfaceTextured", "surfaceTexture", 1, item.metallicRoughness);
    bind("normalTextured", "normalTexture", 2, item.normal);
    bind("emissiveTextured", "emissiveTexture", 3, item.emissive);
    drawMesh(mesh, item);
}

/// Redraws the shadow map only if its content has changed.
void Renderer::Impl::drawShadows() {
    ShadowScene now{.casters = {}, .section = frame->section, .toward = glm::transpose(rig) * kKeyDirection};
    std::vector<Ball> balls;
    if (frame->shadows && frame->detail != Detail::Draft)
        for (const DrawItem& item : frame->items)
            if (isSolid(item)) {
                now.casters.push_back({item.mesh.buffers, item.model, item.body != 0});
                balls.push_back(ballOf(item));
            }
    const bool known = now == shadowed;
    shadowed = std::move(now);
    if (balls.empty()) return;
    if (!known) {
        light = LightView(shadowed.toward, balls, shadowMap.size());
        drawShadowMap();
    }
    shadowMap.bindTexture(GL_TEXTURE0 + kShadowUnit);
}

void Renderer::Impl::drawShadowMap() {
    shadowMap.begin();
    glEnable(GL_DEPTH_TEST);
    glEnable(GL_POLYGON_OFFSET_FILL);
    glPolygonOffset(1.5f, 3);
    begin(shadow);
    shadow.set("viewProjection", light.viewProjection);
    if (frame->section) glEnable(GL_CLIP_DISTANCE0);  // light enters bodies that are cut open
    for (const DrawItem& item : frame->items)
        if (isSolid(item)) {
            cullWhereClosed(item);
            drawMesh(shadow, item);
        }
    glDisable(GL_CULL_FACE);
    glDisable(GL_CLIP_DISTANCE0);
    glDisable(GL_POLYGON_OFFSET_FILL);
}

void Renderer::Impl::drawOpaqueItems() {
    begin(mesh);
    mesh.set("sectioned", frame->section ? 1 : 0);
    if (frame->section) glEnable(GL_CLIP_DISTANCE0);
    for (const DrawItem& item : frame->items)
        if (isSolid(item)) drawItem(item);
    glDisable(GL_CLIP_DISTANCE0);
}

void Renderer::Impl::drawCaps() {
    std::vector<int> bodies;
    for (const DrawItem& item : frame->items)
        if (isSolid(item) && item.body != 0 && std::find(bodies.begin(), bodies.end(), item.body) == bodies.end())
            bodies.push_back(item.body);
    const glm::vec3 normal(*frame->section);
    const glm::vec3 aside = std::abs(normal.y) < 0.9f * glm::length(normal) ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
    const glm::vec3 u = glm::normalize(glm::cross(normal, aside)), v = glm::normalize(glm::cross(normal, u));

    glEnable(GL_STENCIL_TEST);
    for (const int body : bodies) {
        // Count exits minus entries along each line of sight behind the plane: the count is nonzero exactly where the
        // line starts inside the body.
        glClear(GL_STENCIL_BUFFER_BIT);
        glStencilFunc(GL_ALWAYS, 0, 0xff);
        glStencilOpSeparate(GL_FRONT, GL_KEEP, GL_DECR_WRAP, GL_DECR_WRAP);
        glStencilOpSeparate(GL_BACK, GL_KEEP, GL_INCR_WRAP, GL_INCR_WRAP);
        glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        glDepthMask(GL_FALSE);
        glEnable(GL_CLIP_DISTANCE0);
        begin(shadow);
        const DrawItem* first = nullptr;
        std::vector<Ball> balls;
        for (const DrawItem& item : frame->items) {
            if (!isSolid(item) || item.body != body) continue;
            if (!first) first = &item;
            balls.push_back(ballOf(item));
            drawMesh(shadow, item);
        }
        glDisable(GL_CLIP_DISTANCE0);
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        glDepthMask(GL_TRUE);

        glm::vec3 center{0};
        float reach = 0;
        for (const Ball& ball : balls) center += ball.center / static_cast<float>(balls.size());
        for (const Ball& ball : balls) reach = std::max(reach, glm::distance(center, ball.center) + ball.radius);
        center -= normal * (glm::dot(*frame->section, glm::vec4(center, 1)) / glm::dot(normal, normal));
        glStencilFunc(GL_NOTEQUAL, 0, 0xff);
        glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
        begin(cap);
        cap.set("capCenter", center);
        cap.set("capU", reach * u);
        cap.set("capV", reach * v);
        cap.set("baseColor", glm::vec3(first->material.baseColor));
        cap.set("hatch", body % 2 == 0 ? 1.f : -1.f);
        drawQuad();
    }
    glDisable(GL_STENCIL_TEST);
}

void Renderer::Impl::drawGhosts() {
    std::vector<std::pair<float, const DrawItem*>> ghosts;
    for (const DrawItem& item : frame->items)
        if (item.mesh && item.alpha > 0 && !isSolid(item)) {
            ghosts.emplace_back(glm::dot(ballOf(item).center - eye, frame->camera.forward()), &item);
        }
    std::stable_sort(ghosts.begin(), ghosts.end(), [](const auto& a, const auto& b) { return a.first > b.first; });

    begin(mesh);
    mesh.set("sectioned", frame->section ? 1 : 0);
    if (frame->section) glEnable(GL_CLIP_DISTANCE0);
    // A depth offset hides a ghost where it coincides with its solid; otherwise it would flicker.
    glEnable(GL_POLYGON_OFFSET_FILL);
    glPolygonOffset(1, 2);
    const Blend blend;
    for (const auto& [depth, item] : ghosts) {
        cullWhereClosed(*item);
        // First draw only the depth, then only the nearest surface, so that the order of triangles does not matter.
        glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
        drawItem(*item);
        glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
        glDepthFunc(GL_EQUAL);
        drawItem(*item);
        glDepthFunc(GL_LESS);
    }
    glDisable(GL_CULL_FACE);
    glDisable(GL_POLYGON_OFFSET_FILL);
    glDisable(GL_CLIP_DISTANCE0);
}

}  // namespace touchstone::engine
