// Pictures drawn without a display, checked at pixels computed by hand. Colors are 8-bit sRGB; a tolerance of 2 steps
// covers the rounding of driver and blending.
#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "engine/view/gl_context.hpp"
#include "engine/view/renderer.hpp"

namespace touchstone::renderer_tests {

using namespace touchstone::engine;

namespace {

constexpr int kWidth = 320, kHeight = 200;
const glm::vec2 kViewport{kWidth, kHeight};

glm::ivec3 pixel(const Image& image, int x, int y) {
    const std::uint8_t* p = &image.rgba[4 * (static_cast<std::size_t>(y) * image.width + x)];
    return {p[0], p[1], p[2]};
}

glm::ivec3 pixel(const Image& image, glm::vec2 at) {
    return pixel(image, static_cast<int>(at.x), static_cast<int>(at.y));
}

int difference(glm::ivec3 a, glm::ivec3 b) {
    const glm::ivec3 d = glm::abs(a - b);
    return std::max({d.x, d.y, d.z});
}

void requireColor(glm::ivec3 actual, glm::ivec3 expected, int tolerance = 2) {
    INFO("actual " << actual.x << ' ' << actual.y << ' ' << actual.z << ", expected " << expected.x << ' ' << expected.y
                   << ' ' << expected.z);
    REQUIRE(difference(actual, expected) <= tolerance);
}

/// Black background without grid; the camera of the camera tests: one pixel at the origin is 1 cm.
Frame darkFrame() {
    Frame frame;
    frame.camera.distance = 2;
    frame.camera.fovY = 2 * std::atan(0.5f);
    frame.background = {{0, 0, 0}, {0, 0, 0}};
    frame.grid.visible = false;
    return frame;
}

MeshData sphereMesh(float radius, unsigned rings = 96) {
    MeshData mesh;
    const unsigned sectors = 2 * rings;
    for (unsigned i = 0; i <= rings; ++i)
        for (unsigned j = 0; j <= sectors; ++j) {
            const float t = glm::pi<float>() * static_cast<float>(i) / static_cast<float>(rings);
            const float p = glm::two_pi<float>() * static_cast<float>(j) / static_cast<float>(sectors);
            const glm::vec3 n{std::sin(t) * std::cos(p), std::cos(t), -std::sin(t) * std::sin(p)};
            mesh.positions.push_back(radius * n);
            mesh.normals.push_back(n);
        }
    for (unsigned i = 0; i < rings; ++i)
        for (unsigned j = 0; j < sectors; ++j) {
            const unsigned a = i * (sectors + 1) + j, b = a + sectors + 1;
            mesh.indices.insert(mesh.indices.end(), {a, b, b + 1, a, b + 1, a + 1});
        }
    return mesh;
}

/// A rectangle in the plane z = 0 that faces +z.
MeshData quadMesh(float halfWidth, float halfHeight) {
    return {{{-halfWidth, -halfHeight, 0},
             {halfWidth, -halfHeight, 0},
             {halfWidth, halfHeight, 0},
             {-halfWidth, halfHeight, 0}},
            std::vector<glm::vec3>(4, {0, 0, 1}),
            {{0, 1}, {1, 1}, {1, 0}, {0, 0}},
            {0, 1, 2, 0, 2, 3}};
}

Material matt(glm::vec3 color) { return {"matt", {color, 1}, 0, 0.8f, -1}; }

/// Coverage of one column by white on black, in pixels.
float columnSum(const Image& image, int x) {
    float sum = 0;
    for (int y = 0; y < image.height; ++y) sum += static_cast<float>(pixel(image, x, y).x) / 255;
    return sum;
}

struct Stage {
    HeadlessContext context;
    Renderer renderer;

    Image draw(const Frame& frame) { return renderToImage(renderer, frame, kWidth, kHeight); }
};

}  // namespace

TEST_CASE("renderer: an empty frame is the background gradient, top row first", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    frame.background = {{1, 0, 0}, {0, 0, 1}};
    const Image image = stage.draw(frame);
    for (const int y : {0, 50, 150, kHeight - 1}) {
        const float up = 1 - (static_cast<float>(y) + 0.5f) / kHeight;
        requireColor(pixel(image, 17, y), {std::lround(255 * up), 0, std::lround(255 * (1 - up))}, 1);
    }
    REQUIRE(glGetError() == GL_NO_ERROR);
}

TEST_CASE("renderer: meshes and sphere instances share outline and depth", "[gl]") {
    Stage stage;
    // A sphere off the axis, where its outline is an ellipse, cut by a slanted plane through its center.
    const glm::vec3 center{0.45f, 0.2f, 0.1f};
    const float radius = 0.5f;
    Frame meshFrame = darkFrame();
    const glm::mat4 move = glm::translate(glm::mat4(1), center);
    const DrawItem plane{stage.renderer.upload(quadMesh(0.9f, 0.7f)),
                         glm::rotate(move, 0.6f, glm::normalize(glm::vec3(1, 1, 0))),
                         matt({0, 0.6f, 0}),
                         {},
                         1};
    meshFrame.items = {plane};
    Frame impostorFrame = meshFrame;
    meshFrame.items.push_back({stage.renderer.upload(sphereMesh(radius)), move, matt({0.6f, 0, 0}), {}, 1});
    impostorFrame.spheres = {{center, radius, {0.8f, 0, 0, 1}}};
    const Image a = stage.draw(meshFrame), b = stage.draw(impostorFrame);

    enum class Seen { Background, Plane, Sphere };
    const auto classify = [](glm::ivec3 c) {
        if (std::max(c.x, c.y) < 60) return Seen::Background;
        return c.x > c.y ? Seen::Sphere : Seen::Plane;
    };
    // The two kinds of edge are antialiased differently, so a pixel on an edge may differ. A pixel whose neighbors all
    // agree must not.
    int spherePixels = 0, planePixels = 0, mismatches = 0;
    for (int y = 1; y < kHeight - 1; ++y)
        for (int x = 1; x < kWidth - 1; ++x) {
            const Seen here = classify(pixel(a, x, y));
            bool edge = false;
            for (int dy = -1; dy <= 1; ++dy)
                for (int dx = -1; dx <= 1; ++dx) edge = edge || classify(pixel(a, x + dx, y + dy)) != here;
            if (edge) continue;
            spherePixels += here == Seen::Sphere;
            planePixels += here == Seen::Plane;
            mismatches += classify(pixel(b, x, y)) != here;
        }
    REQUIRE(spherePixels > 2000);
    REQUIRE(planePixels > 2000);
    REQUIRE(mismatches == 0);
}

TEST_CASE("renderer: a sphere's outline has the computed radius", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    frame.spheres = {{{0, 0, 0}, 0.5f, {1, 1, 1, 1}}};
    // Half the outline: tan(asin(r / d)) over the 1/200 that a pixel spans at unit distance.
    const float expected = std::tan(std::asin(0.5f / 2)) * kHeight;
    const Image image = stage.draw(frame);
    int covered = 0;
    for (int x = 0; x < kWidth; ++x) covered += pixel(image, x, kHeight / 2).x > 40;
    REQUIRE(static_cast<float>(covered) == Approx(2 * expected).margin(2));  // one pixel on each side
}

TEST_CASE("renderer: gold is yellow, silver is gray, and neither looks like matte paint", "[gl]") {
    Stage stage;
    const GpuMesh ball = stage.renderer.upload(sphereMesh(0.6f));
    const auto mean = [&](const Material& material) {
        Frame frame = darkFrame();
        frame.items = {{ball, glm::mat4(1), material, {}, 1}};
        const Image image = stage.draw(frame);
        glm::vec3 sum{0};
        float count = 0;
        for (int y = 60; y < 140; ++y)
            for (int x = 120; x < 200; ++x) {
                sum += glm::vec3(pixel(image, x, y));
                ++count;
            }
        return sum / count;
    };
    const glm::vec3 gold = mean({"gold", {1, 0.766f, 0.336f, 1}, 1, 0.3f, -1});
    const glm::vec3 silver = mean({"silver", {0.972f, 0.960f, 0.915f, 1}, 1, 0.3f, -1});
    // Thresholds far from both: gold reflects a third as much blue as red, silver nearly as much.
    REQUIRE(gold.r > 130);
    REQUIRE(gold.r > gold.g + 10);
    REQUIRE(gold.b < 0.75f * gold.r);
    REQUIRE(silver.r > 130);
    REQUIRE(silver.b > 0.9f * silver.r);
    REQUIRE(silver.b < 1.05f * silver.r);
}

TEST_CASE("renderer: a mirrored item looks like the mirrored mesh", "[gl]") {
    Stage stage;
    MeshData skew{
        {{0, 0, 0.4f}, {0.7f, -0.3f, 0}, {0, 0.6f, 0}, {-0.3f, -0.2f, 0}}, {}, {}, {0, 1, 2, 0, 2, 3, 0, 3, 1}};
    for (const glm::vec3& p : skew.positions) skew.normals.push_back(glm::normalize(p + glm::vec3(0, 0, 0.1f)));
    MeshData mirrored = skew;
    for (glm::vec3& p : mirrored.positions) p.x = -p.x;
    for (glm::vec3& n : mirrored.normals) n.x = -n.x;
    for (std::size_t i = 0; i < mirrored.indices.size(); i += 3)
        std::swap(mirrored.indices[i], mirrored.indices[i + 1]);

    const Material material{"m", {0.8f, 0.5f, 0.3f, 1}, 0.5f, 0.4f, -1};
    Frame byMatrix = darkFrame(), byMesh = darkFrame(), plain = darkFrame();
    const glm::mat4 mirror = glm::scale(glm::mat4(1), glm::vec3(-1, 1, 1));
    const GpuMesh mesh = stage.renderer.upload(skew);
    byMatrix.items = {{mesh, mirror, material, {}, 1}};
    byMesh.items = {{stage.renderer.upload(mirrored), glm::mat4(1), material, {}, 1}};
    plain.items = {{mesh, glm::mat4(1), material, {}, 1}};
    const auto worst = [](const Image& a, const Image& b) {
        int most = 0;
        for (std::size_t i = 0; i < a.rgba.size(); ++i) most = std::max(most, std::abs(a.rgba[i] - b.rgba[i]));
        return most;
    };
    const Image image = stage.draw(byMatrix);
    REQUIRE(worst(image, stage.draw(byMesh)) <= 2);
    REQUIRE(worst(image, stage.draw(plain)) > 50);
}

TEST_CASE("renderer: a section shows the dark inside", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    frame.items = {{stage.renderer.upload(sphereMesh(0.6f)), glm::mat4(1), matt({0.5f, 0.2f, 0.1f}), {}, 1}};
    frame.section = glm::vec4(0, 0, -1, 0);  // keeps z <= 0
    // A quarter of the base color, (0.125, 0.05, 0.025); the tone map subtracts x - 6.25 x² of the smallest component,
    // 0.0211, and sRGB maps (0.1039, 0.0289, 0.0039) to (91, 47, 13).
    requireColor(pixel(stage.draw(frame), kViewport / 2.f), {91, 47, 13});

    // The same for a sphere instance: sRGB (0.5, 0, 0) is 0.2140 in linear light; a quarter is 0.0535, sRGB 65.
    frame.items.clear();
    frame.spheres = {{{0, 0, 0}, 0.6f, {0.5f, 0, 0, 1}}};
    requireColor(pixel(stage.draw(frame), kViewport / 2.f), {65, 0, 0});
    frame.section = glm::vec4(0, 0, -1, -1);  // keeps z <= -1: nothing
    requireColor(pixel(stage.draw(frame), kViewport / 2.f), {0, 0, 0});
}

TEST_CASE("renderer: a ghost is transparent", "[gl]") {
    Stage stage;
    const GpuMesh quad = stage.renderer.upload(quadMesh(0.5f, 0.5f));
    const DrawItem behind{quad, glm::translate(glm::mat4(1), glm::vec3(0, 0, -0.5f)), matt({0.8f, 0.1f, 0.1f}), {}, 1};
    DrawItem ghost{quad, glm::mat4(1), matt({0.1f, 0.2f, 0.8f}), {}, 1};
    const glm::vec2 middle = kViewport / 2.f;
    Frame frame = darkFrame();
    frame.items = {behind};
    const glm::vec3 back(pixel(stage.draw(frame), middle));
    frame.items = {ghost};
    const glm::vec3 front(pixel(stage.draw(frame), middle));
    ghost.alpha = 0.4f;
    frame.items = {ghost, behind};  // in any order
    // Seen face-on the rim adds nothing: the picture is 0.4 of one and 0.6 of the other.
    requireColor(pixel(stage.draw(frame), middle), glm::ivec3(glm::round(0.4f * front + 0.6f * back)));

    frame.items[0].alpha = 0;
    requireColor(pixel(stage.draw(frame), middle), glm::ivec3(back));
}

TEST_CASE("renderer: vertex colors, alpha modes and missing normals are drawn as glTF says, in any combination",
          "[gl]") {
    Stage stage;
    const GpuMesh plain = stage.renderer.upload(quadMesh(0.5f, 0.5f));
    const DrawItem behind{plain, glm::translate(glm::mat4(1), glm::vec3(0, 0, -0.5f)), matt({0.8f, 0.1f, 0.1f}), {}, 1};
    const glm::vec2 middle = kViewport / 2.f;
    Frame frame = darkFrame();
    frame.shadows = false;
    const auto draw = [&](const std::vector<DrawItem>& items) {
        frame.items = items;
        return glm::vec3(pixel(stage.draw(frame), middle));
    };
    const glm::vec3 back = draw({behind});
    for (const bool colored : {false, true})
        for (const bool flat : {false, true})
            for (const AlphaMode mode : {AlphaMode::Opaque, AlphaMode::Mask, AlphaMode::Blend})
                for (const float alpha : {0.25f, 0.75f, 1.f}) {
                    CAPTURE(colored, flat, int(mode), alpha);
                    // The same color and alpha, from the material or from the vertices.
                    MeshData mesh = quadMesh(0.5f, 0.5f);
                    const glm::vec4 color(0.1f, 0.2f, 0.8f, alpha);
                    if (colored) mesh.colors.assign(4, color);
                    if (flat) mesh.normals.assign(4, {1, 0, 0});
                    mesh.flat = flat;
                    DrawItem item{stage.renderer.upload(mesh), glm::mat4(1), matt({0.1f, 0.2f, 0.8f}), {}, 1};
                    const glm::vec3 front = draw({{plain, glm::mat4(1), item.material, {}, 1}});
                    item.material.baseColor = colored ? glm::vec4(1) : color;
                    item.material.alphaMode = mode;
                    const glm::vec3 expected = mode == AlphaMode::Blend ? alpha * front + (1 - alpha) * back
                                               : mode == AlphaMode::Mask && alpha < 0.5f ? back
                                                                                         : front;
                    requireColor(glm::ivec3(draw({item, behind})), glm::ivec3(glm::round(expected)));
                }
    // A bent strip with smooth normals is flat on each side of its edge only if it has none of its own.
    MeshData roof{{{-0.5f, -0.5f, -0.3f},
                   {0, -0.5f, 0},
                   {0.5f, -0.5f, -0.3f},
                   {-0.5f, 0.5f, -0.3f},
                   {0, 0.5f, 0},
                   {0.5f, 0.5f, -0.3f}},
                  {},
                  {},
                  {0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4}};
    roof.normals = smoothNormals(roof);
    for (const bool flat : {false, true}) {
        CAPTURE(flat);
        roof.flat = flat;
        frame.items = {{stage.renderer.upload(roof), glm::mat4(1), matt({0.5f, 0.5f, 0.5f}), {}, 1}};
        const Image image = stage.draw(frame);
        const int beside = difference(pixel(image, middle + glm::vec2(-3, 0)), pixel(image, middle + glm::vec2(3, 0)));
        CHECK((beside > 20) == flat);
    }
}

TEST_CASE("renderer: a ghost vanishes where it coincides with its solid", "[gl]") {
    Stage stage;
    const GpuMesh ball = stage.renderer.upload(sphereMesh(0.5f));
    Frame frame = darkFrame();
    frame.items = {{ball, glm::mat4(1), matt({0.8f, 0.1f, 0.1f}), {}, 1}};
    const Image solid = stage.draw(frame);
    frame.items.push_back({ball, glm::mat4(1), matt({0.1f, 0.2f, 0.8f}), {}, 0.5f});
    const Image both = stage.draw(frame);
    for (const glm::vec2 at :
         {kViewport / 2.f, kViewport / 2.f + glm::vec2(30, 10), kViewport / 2.f + glm::vec2(-20, 25)})
        requireColor(pixel(both, at), pixel(solid, at));
}

TEST_CASE("renderer: lines keep their width in pixels at any distance", "[gl]") {
    Stage stage;
    for (const float width : {1.f, 2.f, 6.f}) {
        Frame frame = darkFrame();
        frame.lines = {{{-5, 0, 0.9f}, {0.2f, 0, 0.9f}, {1, 1, 1, 1}, width},  // near, at the left
                       {{1, 0, -3}, {30, 0, -30}, {1, 1, 1, 1}, width}};       // far, at the right
        const Image image = stage.draw(frame);
        // Coverage is linear in the distance to the edge, so a column sums to the width; colors round to 1/255.
        REQUIRE(columnSum(image, 30) == Approx(width).margin(0.1));
        REQUIRE(columnSum(image, 260) == Approx(width).margin(0.1));
        frame.pixelScale = 2;
        REQUIRE(columnSum(stage.draw(frame), 30) == Approx(2 * width).margin(0.1));
    }
}

TEST_CASE("renderer: a line of zero length is a round dot, and a line from behind the eye is clipped", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    frame.lines = {{{0, 0, 0}, {0, 0, 0}, {1, 1, 1, 1}, 20}};
    Image image = stage.draw(frame);
    float area = 0;
    for (int x = 0; x < kWidth; ++x) area += columnSum(image, x);
    REQUIRE(area == Approx(glm::pi<float>() * 100).epsilon(0.02));  // sampled at pixel centers

    frame.lines = {{{0, 0, 0}, {4, 0, 50}, {1, 1, 1, 1}, 4}};  // passes the eye at the right
    image = stage.draw(frame);
    requireColor(pixel(image, kWidth - 10, kHeight / 2), {255, 255, 255});
    requireColor(pixel(image, 100, kHeight / 2), {0, 0, 0});
}

TEST_CASE("renderer: hidden lines and arrows are faint, visible ones opaque", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    frame.items = {{stage.renderer.upload(quadMesh(0.5f, 0.5f)), glm::mat4(1), matt({0, 0, 0}), {}, 1}};
    const int bare = pixel(stage.draw(frame), kViewport / 2.f).x;
    frame.lines = {{{0, 0, -0.5f}, {2, 0, -0.5f}, {1, 1, 1, 1}, 8}};
    frame.hiddenOpacity = 0.25f;
    Image image = stage.draw(frame);
    const float expected = 0.25f * 255 + 0.75f * static_cast<float>(bare);
    REQUIRE(pixel(image, 180, kHeight / 2).x == Approx(expected).margin(2));
    requireColor(pixel(image, 240, kHeight / 2), {255, 255, 255});
    frame.hiddenOpacity = 0;
    REQUIRE(pixel(stage.draw(frame), 180, kHeight / 2).x == Approx(bare).margin(1));
}

TEST_CASE("renderer: an arrow has its shaft's radius, a wider head, and ends at its tip", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    frame.arrows = {{{-0.8f, 0, 0}, {0.8f, 0, 0}, 0.05f, {1, 0.2f, 0.2f, 1}}};
    const Image image = stage.draw(frame);
    const auto thickness = [&](int x) {
        int count = 0;
        for (int y = 0; y < kHeight; ++y) count += pixel(image, x, y).x > 30;
        return count;
    };
    // One pixel is 1 cm at the axis; the near side of the shaft is 2.5 percent nearer, and an edge adds up to a pixel.
    REQUIRE(std::abs(thickness(130) - 10) <= 2);
    // Just above the base of the head, 6 radii before the tip at x = 240: nearly 2.4 radii to each side.
    REQUIRE(std::abs(thickness(212) - 23) <= 3);
    REQUIRE(thickness(243) == 0);
    REQUIRE(thickness(76) == 0);

    frame.arrows[0].to = frame.arrows[0].from;
    for (const std::uint8_t c : stage.draw(frame).rgba) REQUIRE((c == 0 || c == 255));  // only the background
}

TEST_CASE("renderer: textures are upright", "[gl]") {
    Stage stage;
    const Image picture{2, 2, {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 255}};
    Frame frame = darkFrame();
    frame.items = {{stage.renderer.upload(quadMesh(0.8f, 0.8f)), glm::mat4(1), matt({1, 1, 1}),
                    stage.renderer.upload(picture), 1}};
    const Image image = stage.draw(frame);
    // At the centers of the four texels, where nothing is interpolated.
    const glm::ivec3 upperLeft = pixel(image, 120, 60), upperRight = pixel(image, 200, 60);
    const glm::ivec3 lowerLeft = pixel(image, 120, 140), lowerRight = pixel(image, 200, 140);
    REQUIRE(upperLeft.r > upperLeft.g + 80);
    REQUIRE(upperRight.g > upperRight.r + 80);
    REQUIRE(lowerLeft.b > lowerLeft.r + 80);
    REQUIRE(std::min({lowerRight.r, lowerRight.g, lowerRight.b}) > 150);
}

TEST_CASE("renderer: the grid has lines on the ground and fades out", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    frame.grid.visible = true;
    frame.camera.pitch = 0.5f;
    const Image image = stage.draw(frame);
    // The x axis, red, runs through the target.
    const glm::ivec3 axis = pixel(image, 40, kHeight / 2);
    REQUIRE(axis.r > axis.b + 20);
    // Between the lines, at x = z = 0.05, nothing is drawn: strong lines are 1 m apart, weak ones 0.1 m.
    const auto between = frame.camera.project({0.05f, 0, 0.05f}, kViewport);
    REQUIRE(difference(pixel(image, *between), {0, 0, 0}) < 12);
    int top = 0;
    for (int x = 0; x < kWidth; ++x) top = std::max(top, pixel(image, x, 0).r);
    REQUIRE(top < 60);
}

TEST_CASE("renderer: a viewport fills its part of a framebuffer and leaves the rest", "[gl]") {
    Stage stage;
    GLuint framebuffer = 0, color = 0;
    glGenFramebuffers(1, &framebuffer);
    glGenRenderbuffers(1, &color);
    glBindRenderbuffer(GL_RENDERBUFFER, color);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, 100, 80);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
    glClearColor(0, 1, 0, 1);
    glClear(GL_COLOR_BUFFER_BIT);

    Frame frame = darkFrame();
    frame.background = {{1, 0, 0}, {1, 0, 0}};
    stage.renderer.draw(frame, {20, 10, 50, 30}, framebuffer);
    stage.renderer.draw(frame, {0, 0, 0, 30}, framebuffer);
    const Image image = readPixels(100, 80);
    requireColor(pixel(image, 20, 80 - 11), {255, 0, 0});
    requireColor(pixel(image, 69, 80 - 40), {255, 0, 0});
    requireColor(pixel(image, 19, 80 - 11), {0, 255, 0});
    requireColor(pixel(image, 70, 80 - 41), {0, 255, 0});
    REQUIRE(glGetError() == GL_NO_ERROR);
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteRenderbuffers(1, &color);
}

TEST_CASE("renderer: the same frame gives the same picture, and an empty mesh draws nothing", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    frame.items = {{stage.renderer.upload(sphereMesh(0.4f)), glm::mat4(1), matt({0.5f, 0.5f, 0.5f}), {}, 1},
                   {stage.renderer.upload(MeshData{}), glm::mat4(1), matt({1, 1, 1}), {}, 1}};
    frame.spheres = {{{0.3f, 0, 0}, 0.3f, {0.2f, 0.4f, 0.8f, 0.5f}}, {{-0.3f, 0, 0}, 0.2f, {1, 1, 1, 1}}};
    REQUIRE(stage.draw(frame).rgba == stage.draw(frame).rgba);
    REQUIRE(glGetError() == GL_NO_ERROR);
}

TEST_CASE(
    "renderer: a draft is the same picture with a quarter of the pixels and no shadow, and is shown again as it was",
    "[gl]") {
    Stage stage;
    GLuint framebuffer = 0, color = 0;
    glGenFramebuffers(1, &framebuffer);
    glGenRenderbuffers(1, &color);
    glBindRenderbuffer(GL_RENDERBUFFER, color);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, kWidth, kHeight);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
    const auto shown = [&](auto&& draw) {
        glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
        glClearColor(0, 1, 0, 1);
        glClear(GL_COLOR_BUFFER_BIT);
        draw();
        return readPixels(kWidth, kHeight);
    };
    constexpr Viewport kWhole{0, 0, kWidth, kHeight};

    Frame frame = darkFrame();
    frame.items = {{stage.renderer.upload(sphereMesh(0.4f)), glm::mat4(1), matt({0.5f, 0.5f, 0.5f}), {}, 1}};
    frame.lines = {{{-0.9f, -0.7f, 0}, {0.9f, -0.7f, 0}, glm::vec4(1), 8}};
    const Image full = shown([&] { stage.renderer.draw(frame, kWhole, framebuffer); });
    const int calls = stage.renderer.cost().calls;
    frame.detail = Detail::Draft;
    const Image draft = shown([&] { stage.renderer.draw(frame, kWhole, framebuffer); });
    CHECK(stage.renderer.cost().calls == calls - 1);  // that of the shadow map
    // Each pixel of the draft covers four of the window, and is smoothed: of pixels at least two within an area both
    // pictures show the same.
    for (const glm::ivec2 at : {glm::ivec2(160, 100), glm::ivec2(140, 80), glm::ivec2(20, 20), glm::ivec2(160, 170)})
        requireColor(pixel(draft, at.x, at.y), pixel(full, at.x, at.y), 4);
    CHECK(columnSum(draft, 40) ==
          Approx(columnSum(full, 40)).margin(2));  // the line is as wide, to a pixel of the draft
    int half = 0;  // pixels along the outline that have neither color of the edge: more where pixels are coarse
    for (int x = 1; x < kWidth; ++x) half += difference(pixel(draft, x, 100), pixel(full, x, 100)) > 8;
    CHECK(half > 0);
    const Image again = shown([&] { stage.renderer.showAgain(kWhole, framebuffer); });
    CHECK(again.rgba == draft.rgba);
    frame.detail = Detail::Plain;
    const Image plain = shown([&] { stage.renderer.draw(frame, kWhole, framebuffer); });
    for (const glm::ivec2 at : {glm::ivec2(160, 100), glm::ivec2(140, 80), glm::ivec2(20, 20), glm::ivec2(160, 170)})
        requireColor(pixel(plain, at.x, at.y), pixel(full, at.x, at.y));
    CHECK(stage.renderer.cost().calls == calls);
    frame.detail = Detail::Full;
    CHECK(shown([&] { stage.renderer.draw(frame, kWhole, framebuffer); }).rgba == full.rgba);
    CHECK(shown([&] { stage.renderer.showAgain(kWhole, framebuffer); }).rgba == full.rgba);
    REQUIRE(glGetError() == GL_NO_ERROR);
    glDeleteFramebuffers(1, &framebuffer);
    glDeleteRenderbuffers(1, &color);
}

TEST_CASE("renderer: a body in the key light casts a shadow behind it, and nowhere else", "[gl]") {
    Stage stage;
    // The light comes from the upper left and the front, (-0.45, 0.74, 0.5) for a camera that looks along -z: a small
    // plate 0.2 m above the center of a floor casts its shadow 0.2 m * 0.45 / 0.74 = 0.12 m to the right and 0.135 m
    // back.
    const glm::mat4 flat = glm::rotate(glm::mat4(1), -glm::half_pi<float>(), glm::vec3(1, 0, 0));
    Frame frame = darkFrame();
    frame.camera.pitch = 1;
    frame.items = {{stage.renderer.upload(quadMesh(0.8f, 0.8f)), flat, matt({0.5f, 0.5f, 0.5f}), {}, 1},
                   {stage.renderer.upload(quadMesh(0.06f, 0.06f)),
                    glm::translate(glm::mat4(1), glm::vec3(0, 0.2f, 0)) * flat,
                    matt({0.5f, 0.5f, 0.5f}),
                    {},
                    1}};
    const auto at = [&](const Image& image, glm::vec3 p) {
        return pixel(image, frame.camera.project(p, kViewport).value()).x;
    };
    const glm::vec3 inShadow{0.122f, 0, -0.135f}, beside{-0.12f, 0, 0.135f};
    const Image lit = stage.draw(frame);
    REQUIRE(at(lit, inShadow) < at(lit, beside) - 40);

    // The shadow map is drawn once, and again when something moves.
    const int first = stage.renderer.cost().calls;
    REQUIRE(stage.draw(frame).rgba == lit.rgba);
    REQUIRE(stage.renderer.cost().calls == first - 2);
    const glm::mat4 before = frame.items[1].model;
    frame.items[1].model = glm::translate(glm::mat4(1), glm::vec3(0.1f, 0, 0)) * before;
    const Image moved = stage.draw(frame);
    REQUIRE(stage.renderer.cost().calls == first);
    REQUIRE(at(moved, inShadow) > at(lit, inShadow) + 40);
    REQUIRE(at(moved, inShadow + glm::vec3(0.1f, 0, 0)) < at(moved, beside) - 40);
    frame.items[1].model = before;
    REQUIRE(stage.draw(frame).rgba == lit.rgba);

    frame.shadows = false;
    const Image plain = stage.draw(frame);
    REQUIRE(std::abs(at(plain, inShadow) - at(plain, beside)) < 10);
    REQUIRE(std::abs(at(lit, beside) - at(plain, beside)) <= 2);
}

TEST_CASE("renderer: the cut of a closed body is filled, and that of a hollow body has a hole", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    const Material red = matt({0.8f, 0.1f, 0.1f});
    const GpuMesh ball = stage.renderer.upload(sphereMesh(0.6f));
    MeshData inner = sphereMesh(0.3f);
    for (std::size_t i = 0; i < inner.indices.size(); i += 3) std::swap(inner.indices[i], inner.indices[i + 1]);
    for (glm::vec3& n : inner.normals) n = -n;
    frame.items = {{ball, glm::mat4(1), red, {}, 1}};
    frame.items[0].body = 1;
    frame.section = glm::vec4(0, 0, -1, 0);
    // Hatched between 0.62 and 0.34 of the base color, both far above the dark inside of an unfilled body, and the same
    // from every view.
    const auto brightness = [&](const Image& image, glm::vec2 middle) {
        float sum = 0;
        for (int y = -9; y < 9; ++y)
            for (int x = -9; x < 9; ++x)
                sum += static_cast<float>(pixel(image, middle + glm::vec2(x, y)).x) / (18 * 18);
        return sum;
    };
    const glm::vec2 middle = kViewport / 2.f, rim = middle + glm::vec2(45, 0);
    Image image = stage.draw(frame);
    REQUIRE(brightness(image, middle) > 150);
    REQUIRE(brightness(image, middle) == Approx(brightness(image, rim)).margin(3));

    frame.items.push_back({stage.renderer.upload(inner), glm::mat4(1), red, {}, 1});
    frame.items[1].body = 1;
    image = stage.draw(frame);
    REQUIRE(brightness(image, rim) > 150);
    // The inner wall is visible through the hole, lit and without hatching.
    const glm::ivec3 wall = pixel(image, middle);
    REQUIRE(difference(wall, pixel(image, middle + glm::vec2(4, 0))) <= 6);
}

TEST_CASE("renderer: textures of surface, normals and emission follow glTF", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    const auto texture = [&](std::array<std::uint8_t, 3> c, bool srgb) {
        return stage.renderer.upload(Image{1, 1, {c[0], c[1], c[2], 255}}, srgb);
    };
    const GpuMesh quad = stage.renderer.upload(quadMesh(0.8f, 0.8f));
    DrawItem item{quad, glm::mat4(1), {"m", {0.9f, 0.6f, 0.2f, 1}, 1, 1, -1}, {}, 1};
    const auto shown = [&](const DrawItem& of) {
        frame.items = {of};
        return pixel(stage.draw(frame), kViewport / 2.f);
    };
    // Green is roughness, blue metalness: the texture gives the same factors as the material without it.
    DrawItem textured = item;
    textured.metallicRoughness = texture({7, 128, 51}, false);
    item.material.roughness = 128 / 255.f;
    item.material.metallic = 51 / 255.f;
    requireColor(shown(textured), shown(item));

    // A flat normal map changes nothing; one that leans to the left looks like the quad turned to the left, and one
    // that leans up (green) like the quad turned up. sin 30 degrees = 0.5.
    item.material = matt({0.6f, 0.6f, 0.6f});
    DrawItem bumped = item;
    bumped.normal = texture({128, 128, 255}, false);
    requireColor(shown(bumped), shown(item), 3);
    const auto turned = [&](glm::vec3 axis, float angle) {
        DrawItem other = item;
        other.model = glm::rotate(glm::mat4(1), angle, axis);
        return shown(other);
    };
    const float tilt = glm::radians(30.f);
    bumped.normal = texture({64, 128, 238}, false);
    requireColor(shown(bumped), turned({0, 1, 0}, -tilt), 4);
    bumped.normal = texture({128, 191, 238}, false);
    requireColor(shown(bumped), turned({1, 0, 0}, -tilt), 4);

    // Emission is added: sRGB 188 is 0.503 in linear light.
    DrawItem glowing{quad, glm::mat4(1), {"black", {0, 0, 0, 1}, 0, 1, -1}, {}, 1}, factor = glowing;
    glowing.material.emissive = {1, 1, 1};
    glowing.emissive = texture({188, 0, 0}, true);
    factor.material.emissive = {0.503f, 0, 0};
    requireColor(shown(glowing), shown(factor));
    REQUIRE(shown(glowing).x > 150);
}

TEST_CASE("renderer: a label is drawn beside its point, on top, and draw calls are counted", "[gl]") {
    Stage stage;
    Frame frame = darkFrame();
    frame.items = {{stage.renderer.upload(quadMesh(0.9f, 0.9f)), glm::mat4(1), matt({0, 0, 0}), {}, 1}};
    frame.shadows = false;
    stage.draw(frame);
    REQUIRE(stage.renderer.cost().calls == 2);  // background, quad
    REQUIRE(stage.renderer.cost().triangles == 3);
    frame.labels = {{{0, 0, -1}, "1.5 mN·m", {1, 1, 1, 1}}, {{0, 0, 5}, "behind the eye", {1, 1, 1, 1}}};
    const Image image = stage.draw(frame);
    REQUIRE(stage.renderer.cost().calls == 3);  // all labels are one call
    int left = kWidth, right = 0, top = kHeight, bottom = 0;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            if (pixel(image, x, y).x > 150) {
                left = std::min(left, x);
                right = std::max(right, x);
                top = std::min(top, y);
                bottom = std::max(bottom, y);
            }
    // In any font of about 15 pixels, eight letters are 30 to 110 wide and at most 16 high.
    REQUIRE(left >= kWidth / 2 + 10);
    REQUIRE(right - left > 30);
    REQUIRE(right - left < 110);
    REQUIRE(bottom - top < 16);
    REQUIRE(std::abs((top + bottom) / 2 - kHeight / 2) < 6);
}

}  // namespace touchstone::renderer_tests
