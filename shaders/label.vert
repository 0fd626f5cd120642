#version 330 core
// One quad per glyph.
layout(location = 0) in vec4 pixels;   // left, top, right, bottom, y down
layout(location = 1) in vec4 texels;
layout(location = 2) in vec4 color;

uniform vec2 viewport;

out vec2 uv;
flat out vec4 glyphColor;

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    uv = mix(texels.xy, texels.zw, corner);
    glyphColor = color;
    vec2 at = mix(pixels.xy, pixels.zw, corner) / viewport * 2.0 - 1.0;
    gl_Position = vec4(at.x, -at.y, 0.0, 1.0);
}
