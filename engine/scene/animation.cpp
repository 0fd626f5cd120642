#include "engine/scene/animation.hpp"

#include <algorithm>
#include <cassert>

namespace touchstone::engine {
namespace {

glm::dquat asQuaternion(const glm::dvec4& xyzw) { return {xyzw.w, xyzw.x, xyzw.y, xyzw.z}; }

/// Where a time falls: after key `key`, `fraction` of the way to the next key, which lies `step` seconds later.
struct KeySpan {
    std::size_t key;
    double fraction, step;
};

KeySpan locate(const std::vector<double>& times, double seconds) {
    assert(!times.empty());
    if (!(seconds > times.front())) return {0, 0, 0};
    if (seconds >= times.back()) return {times.size() - 1, 0, 0};
    const auto next = std::upper_bound(times.begin(), times.end(), seconds);
    const double start = *(next - 1), step = *next - start;
    return {static_cast<std::size_t>(next - times.begin()) - 1, (seconds - start) / step, step};
}

/// glTF 2.0, appendix C.5: Hermite spline through v_k and v_k+1 with tangents scaled by the step t_d:
/// v(t) = (2t^3 - 3t^2 + 1) v_k + t_d (t^3 - 2t^2 + t) b_k + (-2t^3 + 3t^2) v_k+1 + t_d (t^3 - t^2) a_k+1.
glm::dvec4 cubic(const std::vector<glm::dvec4>& values, const KeySpan& span) {
    const glm::dvec4 &v0 = values[3 * span.key + 1], &b0 = values[3 * span.key + 2];
    if (span.step == 0) return v0;
    const glm::dvec4 &a1 = values[3 * span.key + 3], &v1 = values[3 * span.key + 4];
    const double t = span.fraction, t2 = t * t, t3 = t2 * t;
    return (2 * t3 - 3 * t2 + 1) * v0 + span.step * (t3 - 2 * t2 + t) * b0 + (3 * t2 - 2 * t3) * v1 +
           span.step * (t3 - t2) * a1;
}

}  // namespace

glm::dvec3 sampleVector(const AnimationChannel& channel, double seconds) {
    const KeySpan span = locate(channel.times, seconds);
    if (channel.interpolation == Interpolation::CubicSpline) return cubic(channel.values, span);
    const glm::dvec4& value = channel.values[span.key];
    if (channel.interpolation == Interpolation::Step || span.fraction == 0) return value;
    return (1 - span.fraction) * value + span.fraction * channel.values[span.key + 1];
}

glm::dquat sampleRotation(const AnimationChannel& channel, double seconds) {
    const KeySpan span = locate(channel.times, seconds);
    if (channel.interpolation == Interpolation::CubicSpline) {
        const glm::dquat value = asQuaternion(cubic(channel.values, span));
        // A spline through the origin has no direction there, so the previous key is used.
        if (glm::length(value) < 1e-9) return glm::normalize(asQuaternion(channel.values[3 * span.key + 1]));
        return glm::normalize(value);
    }
    const glm::dquat value = glm::normalize(asQuaternion(channel.values[span.key]));
    if (channel.interpolation == Interpolation::Step || span.fraction == 0) return value;
    const glm::dquat next = glm::normalize(asQuaternion(channel.values[span.key + 1]));
    return glm::normalize(glm::slerp(value, next, span.fraction));
}

namespace {
void apply(const AnimationChannel& channel, double seconds, LocalTransform& local) {
    switch (channel.path) {
        case AnimationPath::Translation:
            local.translation = sampleVector(channel, seconds);
            break;
        case AnimationPath::Rotation:
            local.rotation = sampleRotation(channel, seconds);
            break;
        case AnimationPath::Scale:
            local.scale = sampleVector(channel, seconds);
            break;
    }
}
}  // namespace

LocalTransform sampleNode(const Animation& animation, Entity node, const LocalTransform& rest, double seconds) {
    LocalTransform local = rest;
    for (const AnimationChannel& channel : animation.channels)
        if (channel.target == node) apply(channel, seconds, local);
    return local;
}

bool animates(const Animation& animation, Entity node) {
    return node && std::any_of(animation.channels.begin(), animation.channels.end(),
                               [&](const AnimationChannel& channel) { return channel.target == node; });
}

double endTime(const Animation& animation) {
    double end = 0;
    for (const AnimationChannel& channel : animation.channels) end = std::max(end, channel.times.back());
    return end;
}

void applyAnimation(Registry& registry, const Animation& animation, double seconds) {
    for (const AnimationChannel& channel : animation.channels)
        if (LocalTransform* local = registry.find<LocalTransform>(channel.target)) apply(channel, seconds, *local);
}

}  // namespace touchstone::engine
