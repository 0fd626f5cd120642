#version 330 core
layout(location = 0) in vec3 position;

uniform mat4 viewProjection, model;
uniform vec4 section;   // (n, d): kept where n·p + d >= 0

void main() {
    vec4 world = model * vec4(position, 1.0);
    gl_Position = viewProjection * world;
    gl_ClipDistance[0] = dot(section, world);
}
