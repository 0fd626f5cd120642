#version 330 core
flat in vec2 pixelA, pixelB;
flat in vec4 lineColor;
flat in float halfWidth;
noperspective in vec2 pixel;

uniform float opacity;

out vec4 color;

void main() {
    vec2 along = pixelB - pixelA, offset = pixel - pixelA;
    float t = clamp(dot(offset, along) / max(dot(along, along), 1e-12), 0.0, 1.0);
    float coverage = clamp(halfWidth + 0.5 - length(offset - t * along), 0.0, 1.0);
    if (coverage <= 0.0) discard;
    color = vec4(lineColor.rgb, lineColor.a * opacity * coverage);
}
