#version 330 core
#include "lighting.glsl"

in vec3 worldPosition, worldNormal;
in vec2 uv;

uniform vec4 baseColor;
uniform float metallic, roughness, alpha;
uniform bool textured, sectioned;
uniform sampler2D baseTexture;

out vec4 color;

void main() {
    vec3 base = baseColor.rgb;
    if (textured) base *= texture(baseTexture, uv).rgb;
    if (sectioned && !gl_FrontFacing) {   // the inside of a cut solid: matt and dark, so that the cut reads as one
        color = vec4(display(0.25 * base), alpha);
        return;
    }
    vec3 normal = normalize(worldNormal) * (gl_FrontFacing ? 1.0 : -1.0);
    color.rgb = display(shade(worldPosition, normal, base, metallic, roughness));

    // A ghost is denser at its rim, which keeps its shape readable.
    float rim = 1.0 - clamp(dot(normal, normalize(eye - worldPosition)), 0.0, 1.0);
    color.a = mix(alpha, min(1.0, 2.0 * alpha), rim * rim);
}
