#version 330 core
// One quad per line, of the given width in pixels, with room for round ends.
layout(location = 0) in vec3 a;
layout(location = 1) in vec3 b;
layout(location = 2) in vec4 color;
layout(location = 3) in float width;

uniform mat4 viewProjection;
uniform vec2 viewport;
uniform float pixelScale;

flat out vec2 pixelA, pixelB;
flat out vec4 lineColor;
flat out float halfWidth;
noperspective out vec2 pixel;

const float kTowardEye = 4e-5;   // depth offset that keeps a line on a surface visible

void main() {
    vec4 p = viewProjection * vec4(a, 1.0), q = viewProjection * vec4(b, 1.0);
    lineColor = color;
    halfWidth = 0.5 * width * pixelScale;
    pixelA = pixelB = pixel = vec2(0.0);
    float nearP = p.z + p.w, nearQ = q.z + q.w;   // negative: in front of the near plane
    if (nearP < 0.0 && nearQ < 0.0) {
        gl_Position = vec4(0.0, 0.0, 2.0, 1.0);
        return;
    }
    if (nearP < 0.0) p = mix(p, q, nearP / (nearP - nearQ));
    if (nearQ < 0.0) q = mix(q, p, nearQ / (nearQ - nearP));

    pixelA = (0.5 * p.xy / p.w + 0.5) * viewport;
    pixelB = (0.5 * q.xy / q.w + 0.5) * viewport;
    vec2 along = pixelB - pixelA;
    along = dot(along, along) > 1e-12 ? normalize(along) : vec2(1.0, 0.0);
    vec2 across = vec2(-along.y, along.x);
    float reach = halfWidth + 1.0;   // one pixel for the smooth edge
    bool atB = (gl_VertexID & 1) == 1;
    pixel = (atB ? pixelB : pixelA)
          + reach * ((atB ? along : -along) + (gl_VertexID >> 1 == 1 ? across : -across));
    vec4 end = atB ? q : p;
    gl_Position = vec4((pixel / viewport * 2.0 - 1.0) * end.w, end.z - kTowardEye * end.w, end.w);
}
