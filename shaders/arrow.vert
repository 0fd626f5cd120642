#version 330 core
// A solid of revolution with shaft and head, stretched between two points.
layout(location = 0) in vec4 profile;   // radius in shaft radii; along: in lengths, minus head lengths; 1 on the cone
layout(location = 1) in vec4 ring;      // cosine, sine; normal outwards and along the axis (unused on the cone)
layout(location = 2) in vec3 from;
layout(location = 3) in vec3 to;
layout(location = 4) in float radius;
layout(location = 5) in vec4 color;

uniform mat4 viewProjection;
uniform float headRadius, headLength;   // in shaft radii

out vec3 worldPosition, worldNormal;
flat out vec4 arrowColor;

void main() {
    vec3 axis = to - from;
    float span = length(axis);
    arrowColor = color;
    if (span <= 0.0) {
        worldPosition = from;
        worldNormal = vec3(0.0, 1.0, 0.0);
        gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
        return;
    }
    axis /= span;
    vec3 u = normalize(abs(axis.y) < 0.9 ? cross(axis, vec3(0.0, 1.0, 0.0)) : cross(axis, vec3(1.0, 0.0, 0.0)));
    vec3 v = cross(axis, u);
    // A short arrow is drawn thinner, so that it keeps a visible shaft.
    float scale = min(radius, span / (1.5 * headLength));
    float head = headLength * scale;
    vec3 outward = ring.x * u + ring.y * v;
    worldPosition = from + axis * (profile.y * span - profile.z * head) + outward * (profile.x * scale);
    vec2 slope = profile.w > 0.5 ? normalize(vec2(headLength, headRadius)) : ring.zw;
    worldNormal = slope.x * outward + slope.y * axis;
    gl_Position = viewProjection * vec4(worldPosition, 1.0);
}
