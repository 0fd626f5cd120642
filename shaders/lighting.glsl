// Metallic-roughness shading in a small studio that turns with the camera about the vertical: a gradient from floor to
// ceiling, two soft boxes for reflections, and a key light that casts shadows. Linear radiance in, sRGB out.
const float kPi = 3.14159265;

uniform vec3 eye;
uniform mat3 rig;   // rotation from world to studio: x right, y up, z toward the viewer
uniform vec3 keyDirection;   // in the studio, unit length
uniform bool shadowed;
uniform sampler2DShadow shadowMap;
uniform mat4 shadowMatrix;   // world to map coordinates, 0 to 1
uniform float shadowTexel;   // texel length in the world

const vec3 kRimDirection = vec3(0.86, 0.33, -0.39);
const float kKeyIntensity = 2.2;

vec3 toLinear(vec3 srgb) {
    return mix(srgb / 12.92, pow((srgb + 0.055) / 1.055, vec3(2.4)), step(0.04045, srgb));
}

vec3 toSrgb(vec3 linear) {
    return mix(linear * 12.92, 1.055 * pow(linear, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, linear));
}

// Khronos PBR Neutral tone mapper: keeps base colors and compresses only highlights toward white.
vec3 toneMap(vec3 color) {
    const float start = 0.76, desaturation = 0.15;
    float low = min(color.r, min(color.g, color.b));
    color -= low < 0.08 ? low - 6.25 * low * low : 0.04;
    float peak = max(color.r, max(color.g, color.b));
    if (peak < start) return color;
    const float range = 1.0 - start;
    float compressed = 1.0 - range * range / (peak + range - start);
    color *= compressed / peak;
    return mix(vec3(compressed), color, 1.0 / (desaturation * (peak - compressed) + 1.0));
}

vec3 display(vec3 radiance) {
    return toSrgb(clamp(toneMap(radiance), 0.0, 1.0));
}

// Share of the key light that reaches a surface point with this normal, by 3 x 3 filtered comparisons.
float keyLight(vec3 position, vec3 normal) {
    if (!shadowed) return 1.0;
    vec3 at = (shadowMatrix * vec4(position + 1.5 * shadowTexel * normal, 1.0)).xyz;
    float spread = 1.2 / float(textureSize(shadowMap, 0).x);
    float lit = 0.0;
    for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) lit += texture(shadowMap, at + vec3(spread * vec2(x, y), 0.0));
    return lit / 9.0;
}

// A rectangular light around a direction. Its edges are softer for rougher surfaces.
float softBox(vec3 d, vec3 center, vec2 halfSize, float softness) {
    float facing = dot(d, center);
    if (facing <= 0.0) return 0.0;
    vec3 side = normalize(cross(vec3(0.0, 1.0, 0.0), center));
    vec2 p = vec2(dot(d, side), dot(d, cross(center, side))) / facing;
    vec2 inside = 1.0 - smoothstep(halfSize - softness, halfSize + softness, abs(p));
    return inside.x * inside.y;
}

// Radiance that a surface of this roughness reflects from a studio direction. `key`: visible share of the key's box.
vec3 environment(vec3 d, float roughness, float key) {
    float blur = mix(0.06, 0.9, roughness);
    float above = smoothstep(-blur, blur, d.y + 0.05);
    vec3 floorColor = vec3(0.29, 0.262, 0.235) * (1.0 + 0.6 * d.y);
    vec3 wallColor = mix(vec3(0.67, 0.66, 0.65), vec3(0.36, 0.36, 0.37), smoothstep(0.0, 1.0, d.y));
    float softness = mix(0.16, 0.7, roughness);
    vec3 boxes = key * vec3(2.1, 2.03, 1.92) * softBox(d, keyDirection, vec2(0.75, 0.45), softness)
               + vec3(1.0, 1.1, 1.25) * softBox(d, kRimDirection, vec2(0.35, 1.1), softness);
    return mix(floorColor, wallColor, above) + boxes * mix(1.0, 0.55, roughness);
}

// Irradiance of a matte surface with this studio normal.
vec3 ambient(vec3 n) {
    return mix(vec3(0.20, 0.19, 0.18), vec3(0.56, 0.58, 0.62), 0.5 + 0.5 * n.y);
}

// Specular reflectance integrated over the hemisphere (Karis 2014, analytic fit of the GGX split sum).
vec3 environmentReflectance(vec3 f0, float roughness, float nv) {
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float a = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
    vec2 scaleBias = vec2(-1.04, 1.04) * a + r.zw;
    return f0 * scaleBias.x + scaleBias.y;
}

// GGX with height-correlated Smith visibility and Schlick's Fresnel term.
vec3 specular(vec3 f0, float roughness, float nl, float nv, float nh, float vh) {
    float alpha = roughness * roughness, a2 = alpha * alpha;
    float t = nh * nh * (a2 - 1.0) + 1.0;
    float distribution = a2 / (kPi * t * t);
    float visibility = 0.5 / (nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2));
    return (f0 + (1.0 - f0) * pow(1.0 - vh, 5.0)) * distribution * visibility;
}

// Radiance toward the eye. World space; `normal` has unit length and faces the eye. `lit`: share of the key light.
vec3 shade(vec3 position, vec3 normal, vec3 baseColor, float metallic, float roughness, float lit) {
    roughness = clamp(roughness, 0.08, 1.0);
    vec3 f0 = mix(vec3(0.04), baseColor, metallic);
    vec3 diffuse = baseColor * (1.0 - metallic);

    vec3 n = rig * normal;
    vec3 v = rig * normalize(eye - position);
    vec3 h = normalize(v + keyDirection);
    float nv = clamp(dot(n, v), 1e-3, 1.0);
    float nl = clamp(dot(n, keyDirection), 0.0, 1.0);

    vec3 key = diffuse / kPi;
    if (nl > 0.0) key += specular(f0, roughness, nl, nv, clamp(dot(n, h), 0.0, 1.0), clamp(dot(v, h), 0.0, 1.0));
    // Whatever blocks the key light also blocks part of the ambient light.
    float open = mix(0.72, 1.0, lit);
    return key * kKeyIntensity * nl * lit + diffuse * ambient(n) * open
         + environmentReflectance(f0, roughness, nv) * environment(reflect(-v, n), roughness, mix(0.25, 1.0, lit)) * open;
}
