#version 330 core
#include "lighting.glsl"

in vec3 worldPosition, worldNormal;
in vec2 uv;
in vec4 ownColor;

uniform vec4 baseColor;
uniform vec3 emissive;
uniform float metallic, roughness, normalScale, alpha;
uniform float alphaCutoff;   // 0: nothing is cut out
uniform bool blended, flatShaded;
uniform bool baseTextured, surfaceTextured, normalTextured, emissiveTextured, sectioned;
uniform sampler2D baseTexture, surfaceTexture, normalTexture, emissiveTexture;

out vec4 color;

// Normal mapping with a tangent frame from screen-space derivatives (Schueler 2013), so that meshes need no tangents.
vec3 bumped(vec3 n) {
    vec3 along = cross(dFdy(worldPosition), n), up = cross(n, dFdx(worldPosition));
    vec2 across = dFdx(uv), down = dFdy(uv);
    vec3 t = along * across.x + up * down.x, b = along * across.y + up * down.y;
    float longest = max(dot(t, t), dot(b, b));
    if (longest <= 0.0) return n;
    vec3 m = texture(normalTexture, uv).xyz * 2.0 - 1.0;
    m.xy *= normalScale * inversesqrt(longest);
    return normalize(t * m.x - b * m.y + n * m.z);   // v of glTF points down
}

void main() {
    vec4 own = baseColor * ownColor;
    if (baseTextured) own *= texture(baseTexture, uv);
    if (own.a < alphaCutoff) discard;
    vec3 base = own.rgb;
    if (sectioned && !gl_FrontFacing) {   // inside of a cut solid: matte and dark, so that the cut stands out
        color = vec4(display(0.25 * base), alpha);
        return;
    }
    vec2 surface = vec2(roughness, metallic);
    if (surfaceTextured) surface *= texture(surfaceTexture, uv).gb;
    vec3 glow = emissive;
    if (emissiveTextured) glow *= texture(emissiveTexture, uv).rgb;
    vec3 outward = worldNormal;
    if (flatShaded) {   // of the triangle, on the side of the mesh's normal, whatever the direction of the picture's axes
        outward = cross(dFdx(worldPosition), dFdy(worldPosition));
        if (dot(outward, eye - worldPosition) < 0.0) outward = -outward;
    }
    bool turned = !flatShaded && !gl_FrontFacing;
    vec3 smoothNormal = normalize(outward) * (turned ? -1.0 : 1.0);
    vec3 normal = normalTextured ? bumped(smoothNormal) : smoothNormal;
    float lit = alpha < 1.0 ? 1.0 : keyLight(worldPosition, smoothNormal);
    color.rgb = display(shade(worldPosition, normal, base, surface.y, surface.x, lit) + glow);

    // A ghost is denser at its rim, so that its shape stays readable.
    float rim = 1.0 - clamp(dot(normal, normalize(eye - worldPosition)), 0.0, 1.0);
    color.a = mix(alpha, min(1.0, 2.0 * alpha), rim * rim);
    if (blended) color.a *= own.a;
}
