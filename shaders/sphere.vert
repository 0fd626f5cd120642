#version 330 core
// One quad per sphere, which just covers its outline as seen from the eye.
layout(location = 0) in vec3 center;
layout(location = 1) in float radius;
layout(location = 2) in vec4 color;

uniform mat4 viewProjection;
uniform vec3 eye;
uniform vec3 cameraUp;
uniform float pixelAngle;   // angle of one pixel

flat out vec3 toCenter;   // from the eye
flat out float sphereRadius;
flat out vec4 sphereColor;
out vec3 toFragment;   // from the eye

void main() {
    toCenter = center - eye;
    sphereRadius = radius;
    sphereColor = color;
    float distance2 = dot(toCenter, toCenter), radius2 = radius * radius;
    if (radius <= 0.0 || distance2 <= radius2) {   // empty, or seen from inside: not drawn
        gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
        return;
    }
    // The tangent cone from the eye intersects the plane through the center in a circle of this radius; one pixel is
    // added for the smooth edge.
    float extent = radius * sqrt(distance2 / (distance2 - radius2)) + pixelAngle * sqrt(distance2);
    vec3 axis = normalize(toCenter);
    vec3 u = normalize(cross(axis, cameraUp)), v = cross(u, axis);
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
    toFragment = toCenter + extent * (corner.x * u + corner.y * v);
    gl_Position = viewProjection * vec4(eye + toFragment, 1.0);
}
