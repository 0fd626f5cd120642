#version 330 core
in vec2 uv;
flat in vec4 glyphColor;

uniform sampler2D glyphs;

out vec4 color;

void main() {
    color = vec4(glyphColor.rgb, glyphColor.a * texture(glyphs, uv).a);
}
