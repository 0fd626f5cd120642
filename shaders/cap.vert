#version 330 core
// A square in the section plane.
uniform mat4 viewProjection;
uniform vec3 capCenter, capU, capV;   // center and half sides of the square

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    gl_Position = viewProjection * vec4(capCenter + corner.x * capU + corner.y * capV, 1.0);
}
