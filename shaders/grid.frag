#version 330 core
#include "lighting.glsl"

in vec2 ground;

uniform vec3 gridCenter;
uniform float gridExtent;
uniform float spacing;      // of the strong lines; weak lines divide it by ten
uniform float weakOpacity;
uniform float pixelScale;

out vec4 color;

// Coverage of this pixel by the nearest grid line, with lines at integers. Lines less than a few pixels apart fade out
// to avoid flicker.
float lines(vec2 p, float halfWidth) {
    vec2 perPixel = max(fwidth(p), 1e-9);
    vec2 away = abs(fract(p - 0.5) - 0.5) / perPixel;
    vec2 covered = clamp(halfWidth + 0.5 - away, 0.0, 1.0) * (1.0 - smoothstep(0.15, 0.5, perPixel));
    return max(covered.x, covered.y);
}

void main() {
    float strong = lines(ground / spacing, 0.6 * pixelScale);
    float weak = lines(10.0 * ground / spacing, 0.5 * pixelScale) * weakOpacity;
    float fade = 1.0 - smoothstep(0.1, 1.0, distance(ground, gridCenter.xz) / gridExtent);

    // The axes through the origin in their usual colors: x red, z blue.
    vec2 fromAxis = abs(ground) / max(fwidth(ground), 1e-12);
    vec2 axis = clamp(0.9 * pixelScale + 0.5 - fromAxis, 0.0, 1.0);
    color = vec4(vec3(0.62, 0.66, 0.72), max(0.34 * strong, 0.16 * weak));
    color = mix(color, vec4(0.85, 0.36, 0.36, 0.6), axis.y);
    color = mix(color, vec4(0.36, 0.52, 0.9, 0.6), axis.x);
    // Below the lines, darken the floor by the shadow that falls on it.
    float shade = 0.5 * (1.0 - keyLight(vec3(ground.x, gridCenter.y, ground.y), vec3(0.0, 1.0, 0.0)));
    float covered = color.a + shade * (1.0 - color.a);
    color = vec4(color.rgb * color.a / max(covered, 1e-4), covered * fade);
}
