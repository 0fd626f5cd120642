#include "haptics/sandbox/scene/scene_motion.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/edit/scene_edit.hpp"
#include "engine/scene/transforms.hpp"
#include "haptics/sandbox/scene/role.hpp"
#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {
namespace {

using engine::AnimationChannel;
using engine::AnimationPath;
using engine::Entity;

bool moves(const AnimationChannel& channel) { return channel.path != AnimationPath::Scale; }

bool isAncestor(const engine::Registry& registry, Entity ancestor, Entity node) {
    while (const engine::Hierarchy* hierarchy = registry.find<engine::Hierarchy>(node)) {
        node = hierarchy->parent;
        if (node == ancestor) return true;
    }
    return false;
}

/// False if the motion changes the shape of the node: a rotation below an unevenly scaled ancestor shears it.
bool staysRigid(const engine::Scene& scene, const engine::Animation& animation, Entity node) {
    const engine::Hierarchy& hierarchy = scene.registry.get<engine::Hierarchy>(node);
    const glm::dmat4 parent = engine::worldMatrix(scene.registry, hierarchy.parent);
    const engine::LocalTransform& rest = scene.registry.get<engine::LocalTransform>(node);
    const glm::dmat3 shape = engine::rigidPart(parent * engine::localMatrix(rest)).rest;
    for (const AnimationChannel& channel : animation.channels) {
        if (channel.target != node || channel.path != AnimationPath::Rotation) continue;
        for (const double t : channel.times) {
            engine::LocalTransform local = rest;
            local.rotation = engine::sampleRotation(channel, t);
            const glm::dmat3 now = engine::rigidPart(parent * engine::localMatrix(local)).rest;
            for (int column = 0; column < 3; ++column)
                if (glm::length(now[column] - shape[column]) > 1e-6 * (1 + glm::length(shape[column]))) return false;
        }
    }
    return true;
}

}  // namespace

SceneMotion::SceneMotion(const engine::Scene& scene, const engine::Animation& animation, Entity node)
    : node_(node), rest_(scene.registry.get<engine::LocalTransform>(node)) {
    const engine::Hierarchy& hierarchy = scene.registry.get<engine::Hierarchy>(node);
    parent_ = engine::worldMatrix(scene.registry, hierarchy.parent);
    for (const AnimationChannel& channel : animation.channels)
        if (channel.target == node && moves(channel)) channels_.channels.push_back(channel);
    assert(!channels_.channels.empty());
    // Files store seconds in single precision: 0.8 becomes 0.80000001, which would add a tick.
    duration_ = std::round(1e5 * engine::endTime(channels_)) / 100;
}

Pose SceneMotion::at(double t) const noexcept {
    return toPose(parent_ * engine::localMatrix(engine::sampleNode(channels_, node_, rest_, t / 1000)));
}

engine::Animation animationOf(const engine::Scene& scene, Entity node, std::span<const MotionKey> keys) {
    AnimationChannel translation, rotation;
    rotation.path = AnimationPath::Rotation;
    for (const MotionKey& key : keys) {
        const double seconds = static_cast<float>(key.t / 1000);
        if (!translation.times.empty() && !(seconds > translation.times.back())) continue;  // equal once rounded
        const engine::LocalTransform local = engine::placedAt(scene.registry, node, toRigidPart(key.X_WT));
        glm::dquat q = local.rotation;
        if (!rotation.values.empty()) {  // the nearer of the two equal quaternions, as other readers may expect
            const glm::dvec4& last = rotation.values.back();
            if (last.x * q.x + last.y * q.y + last.z * q.z + last.w * q.w < 0) q = -q;
        }
        // Rounded and normalized until neither changes it, since writers normalize.
        glm::dvec4 value(q.x, q.y, q.z, q.w);
        for (int i = 0; i < 4; ++i) value = glm::dvec4(glm::vec4(glm::normalize(value)));
        translation.times.push_back(seconds);
        translation.values.emplace_back(glm::dvec3(glm::vec3(local.translation)), 0);
        rotation.values.push_back(value);
    }
    rotation.times = translation.times;
    return {.name = {}, .channels = {std::move(translation), std::move(rotation)}};
}

bool movesTool(const engine::Animation& animation, Entity tool) {
    return std::any_of(animation.channels.begin(), animation.channels.end(),
                       [&](const AnimationChannel& channel) { return channel.target == tool && moves(channel); });
}

std::vector<NamedMotion> findMotions(const engine::Scene& scene, Entity tool, const std::vector<Entity>& obstacles,
                                     std::vector<std::string>& warnings) {
    // One warning for each node, however many of its properties are animated.
    std::vector<Entity> warned;
    const auto warn = [&](Entity node, const std::string& what) {
        if (std::find(warned.begin(), warned.end(), node) != warned.end()) return;
        warned.push_back(node);
        warnings.push_back(nodeLabel(scene, node) + " is animated, but " + what);
    };
    for (const engine::Animation& animation : scene.animations)
        for (const AnimationChannel& channel : animation.channels) {
            const Entity node = channel.target;
            if (node == tool) {
                if (!moves(channel))
                    warnings.push_back(nodeLabel(scene, tool) +
                                       " has an animated scale: the tool is rigid, so its scale does not change");
                continue;
            }
            if (isAncestor(scene.registry, node, tool)) {
                warn(node, "ancestors of the tool do not move: animate the tool node itself");
                continue;
            }
            const Entity owner = roleOwner(scene.registry, node);
            const bool fixed = std::any_of(obstacles.begin(), obstacles.end(), [&](Entity obstacle) {
                return owner == obstacle || isAncestor(scene.registry, node, obstacle);
            });
            if (fixed)
                warn(node, "animated obstacles are not supported: it does not move");
            else if (owner && owner == tool)
                warn(node, "the tool is one rigid body: its parts do not move");
        }
    std::vector<NamedMotion> motions;
    bool rigid = true;
    for (const engine::Animation& animation : scene.animations) {
        if (!movesTool(animation, tool)) continue;
        rigid = rigid && staysRigid(scene, animation, tool);
        motions.push_back({animation.name, std::make_shared<SceneMotion>(scene, animation, tool)});
    }
    if (!rigid)
        warnings.push_back(nodeLabel(scene, tool) +
                           " turns below an ancestor of uneven scale: it keeps the shape that it has at the start");
    return motions;
}

}  // namespace touchstone::sandbox
