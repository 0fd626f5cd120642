#include "haptics/sandbox/scene/scene_motion.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "engine/scene/transforms.hpp"
#include "haptics/sandbox/scene/roles.hpp"
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

/// How far the shape of the node changes over the motion: a rotation below a stretched ancestor shears.
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
    // Files keep seconds in single precision: 0.8 is 0.80000001 there and would cost a tick more.
    duration_ = std::round(1e5 * engine::endTime(channels_)) / 100;
}

Pose SceneMotion::at(double t) const noexcept {
    return toPose(parent_ * engine::localMatrix(engine::sampleNode(channels_, node_, rest_, t / 1000)));
}

bool movesTool(const engine::Animation& animation, Entity tool) {
    return std::any_of(animation.channels.begin(), animation.channels.end(),
                       [&](const AnimationChannel& channel) { return channel.target == tool && moves(channel); });
}

std::vector<NamedMotion> findMotions(const engine::Scene& scene, Entity tool, const std::vector<Entity>& obstacles,
                                     std::vector<std::string>& warnings) {
    // A node once, whatever number of its properties is animated.
    std::vector<Entity> named;
    const auto warn = [&](Entity node, const std::string& what) {
        if (std::find(named.begin(), named.end(), node) != named.end()) return;
        named.push_back(node);
        warnings.push_back(nodeLabel(scene, node) + " is animated, but " + what);
    };
    for (const engine::Animation& animation : scene.animations)
        for (const AnimationChannel& channel : animation.channels) {
            const Entity node = channel.target;
            if (node == tool) {
                if (!moves(channel))
                    warnings.push_back(nodeLabel(scene, tool) +
                                       " has an animated scale: the tool is rigid, so it is left as it stands");
                continue;
            }
            if (isAncestor(scene.registry, node, tool)) {
                warn(node, "ancestors of the tool stand still: animate the tool node itself");
                continue;
            }
            const Entity owner = roleOwner(scene.registry, node);
            const bool fixed = std::any_of(obstacles.begin(), obstacles.end(), [&](Entity obstacle) {
                return owner == obstacle || isAncestor(scene.registry, node, obstacle);
            });
            if (fixed)
                warn(node, "moving obstacles are not supported: it stands still");
            else if (owner && owner == tool)
                warn(node, "the tool is one rigid body: its parts stand still");
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
                           " turns below an ancestor of uneven scale: its shape is kept as it stands at the start");
    return motions;
}

}  // namespace touchstone::sandbox
