#version 330 core
// A square in the ground plane about the camera's target.
uniform mat4 viewProjection;
uniform vec3 gridCenter;
uniform float gridExtent;

out vec2 ground;

void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    ground = gridCenter.xz + gridExtent * corner;
    gl_Position = viewProjection * vec4(ground.x, gridCenter.y, ground.y, 1.0);
}
