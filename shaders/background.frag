#version 330 core
in float height;

uniform vec3 top, bottom;   // sRGB

out vec4 color;

void main() {
    color = vec4(mix(bottom, top, height), 1.0);
}
