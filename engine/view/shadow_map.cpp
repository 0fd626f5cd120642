#include "engine/view/shadow_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <stdexcept>

namespace touchstone::engine {

LightView::LightView(glm::vec3 toward, std::span<const Ball> balls, int size) {
    if (balls.empty()) return;
    const glm::vec3 aside = std::abs(toward.y) < 0.99f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
    const glm::vec3 right = glm::normalize(glm::cross(aside, toward)), up = glm::cross(toward, right);
    const glm::mat4 turn(glm::transpose(glm::mat3(right, up, toward)));
    glm::vec3 low(std::numeric_limits<float>::infinity()), high = -low;
    for (const Ball& ball : balls) {
        const glm::vec3 p(turn * glm::vec4(ball.center, 1));
        low = glm::min(low, p - ball.radius);
        high = glm::max(high, p + ball.radius);
    }
    const glm::vec3 rim = glm::vec3(0.01f * std::max({high.x - low.x, high.y - low.y, high.z - low.z, 1e-6f}));
    low -= rim;
    high += rim;
    viewProjection = glm::ortho(low.x, high.x, low.y, high.y, -high.z, -low.z) * turn;
    texel = std::max(high.x - low.x, high.y - low.y) / static_cast<float>(size);
}

ShadowMap::ShadowMap(int size) : size_(size) {
    glBindTexture(GL_TEXTURE_2D, depth_.id());
    glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, size, size, 0, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT, nullptr);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    constexpr std::array<float, 4> kLit{1, 1, 1, 1};
    glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, kLit.data());

    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_.id(), 0);
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        throw std::runtime_error(
            "The graphics driver cannot render depth textures, which shadows need; update the driver.");
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

void ShadowMap::begin() const {
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.id());
    glViewport(0, 0, size_, size_);
    glClear(GL_DEPTH_BUFFER_BIT);
}

void ShadowMap::bindTexture(GLenum unit) const {
    glActiveTexture(unit);
    glBindTexture(GL_TEXTURE_2D, depth_.id());
}

}  // namespace touchstone::engine
