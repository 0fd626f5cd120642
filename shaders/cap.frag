#version 330 core
#include "lighting.glsl"

uniform vec3 baseColor;
uniform float hatch;        // 1 or -1: direction of the hatching
uniform float pixelScale;

out vec4 color;

// The cut of a solid: flat and hatched as in a technical drawing, to distinguish it from surfaces.
void main() {
    float period = 9.0 * pixelScale;
    float across = mod(gl_FragCoord.x + hatch * gl_FragCoord.y, period);
    float stripe = 1.0 - clamp(abs(across - 0.5 * period) / pixelScale - 0.4, 0.0, 1.0);
    color = vec4(display(baseColor * mix(0.62, 0.34, stripe)), 1.0);
}
