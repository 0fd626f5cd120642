#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texcoord;
layout(location = 3) in vec4 vertexColor;

uniform mat4 viewProjection, model;
uniform mat3 normalMatrix;
uniform vec4 section;   // (n, d): kept where n·p + d >= 0

out vec3 worldPosition, worldNormal;
out vec2 uv;
out vec4 ownColor;
invariant gl_Position;   // a ghost is drawn twice and must get equal depths

void main() {
    vec4 world = model * vec4(position, 1.0);
    worldPosition = world.xyz;
    worldNormal = normalMatrix * normal;
    uv = texcoord;
    ownColor = vertexColor;
    gl_Position = viewProjection * world;
    gl_ClipDistance[0] = dot(section, world);
}
