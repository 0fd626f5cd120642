#version 330 core
#include "lighting.glsl"

in vec3 worldPosition, worldNormal;
flat in vec4 arrowColor;

uniform float opacity;

out vec4 color;

void main() {
    vec3 radiance = shade(worldPosition, normalize(worldNormal), toLinear(arrowColor.rgb), 0.0, 0.5, 1.0);
    color = vec4(display(radiance), arrowColor.a * opacity);
}
