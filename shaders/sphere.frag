#version 330 core
#include "lighting.glsl"

flat in vec3 toCenter;
flat in float sphereRadius;
flat in vec4 sphereColor;
in vec3 toFragment;

uniform mat4 viewProjection;
uniform vec4 section;
uniform bool translucent;

out vec4 color;

void main() {
    vec3 direction = normalize(toFragment);
    float along = dot(toCenter, direction);
    float miss = length(toCenter - along * direction);   // distance of the line of sight from the center
    float coverage = clamp((sphereRadius - miss) / max(fwidth(miss), 1e-12) + 0.5, 0.0, 1.0);
    if (coverage <= 0.0) discard;

    float halfChord = sqrt(max(sphereRadius * sphereRadius - miss * miss, 0.0));
    vec3 hit = (along - halfChord) * direction;
    bool inside = dot(section, vec4(eye + hit, 1.0)) < 0.0;
    if (inside) {
        hit = (along + halfChord) * direction;
        if (dot(section, vec4(eye + hit, 1.0)) < 0.0) discard;
    }

    vec3 normal = (hit - toCenter) / sphereRadius;
    vec3 base = toLinear(sphereColor.rgb);
    color.rgb = display(inside ? 0.25 * base : shade(eye + hit, normal, base, 0.0, 0.45, keyLight(eye + hit, normal)));
    color.a = coverage * (translucent ? sphereColor.a : 1.0);
    vec4 clip = viewProjection * vec4(eye + hit, 1.0);
    gl_FragDepth = clamp(0.5 * clip.z / clip.w + 0.5, 0.0, 1.0);
}
