// The window. Cases that need a display are skipped with a warning if there is none.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <imgui.h>

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>

#include "engine/view/gl_context.hpp"
#include "engine/view/plots.hpp"
#include "engine/view/renderer.hpp"
#include "engine/view/window.hpp"

namespace touchstone::window_tests {

using namespace touchstone::engine;

namespace {

bool noDisplay() {
    if (std::getenv("DISPLAY")) return false;
    WARN("DISPLAY is not set: skipped; start under xvfb-run to include it.");
    return true;
}

WindowOptions small() {
    WindowOptions options;
    options.width = 400;
    options.height = 300;
    options.vsync = false;
    return options;
}

std::array<int, 3> pixel(const Image& image, int x, int y) {
    const std::uint8_t* p = &image.rgba[4 * (static_cast<std::size_t>(y) * image.width + x)];
    return {p[0], p[1], p[2]};
}

}  // namespace

TEST_CASE("window: without a display the error is one sentence with a remedy", "[view]") {
    const char* set = std::getenv("DISPLAY");
    const std::optional<std::string> before = set ? std::optional<std::string>(set) : std::nullopt;
    glfwTerminate();  // another case of this run may have initialized it with a display
    unsetenv("DISPLAY");
    CHECK_THROWS_WITH(Window(small()), Catch::Contains("DISPLAY") && Catch::Contains("headless"));
    if (before) setenv("DISPLAY", before->c_str(), 1);
}

TEST_CASE("window: shows the renderer's frame and ImGui, and gives the picture", "[ui]") {
    if (noDisplay()) return;
    Window window(small());
    Renderer renderer;
    Frame frame;
    frame.grid.visible = false;
    frame.background = {{0, 0, 1}, {0, 0, 1}};
    Image picture;
    for (int i = 0; i < 3; ++i) {
        REQUIRE(window.beginFrame());
        const glm::ivec2 pixels = window.framebufferSize();
        renderer.draw(frame, {0, 0, pixels.x, pixels.y});
        ImGui::GetForegroundDrawList()->AddRectFilled({10, 20}, {60, 50}, IM_COL32(255, 0, 0, 255));
        window.endFrame(&picture);
    }
    const glm::ivec2 pixels = window.framebufferSize();
    REQUIRE(picture.width == pixels.x);
    REQUIRE(picture.height == pixels.y);
    REQUIRE(pixel(picture, 30, 35) == std::array{255, 0, 0});
    REQUIRE(pixel(picture, 30, picture.height - 35) == std::array{0, 0, 255});
    window.close();
    REQUIRE_FALSE(window.beginFrame());
}

TEST_CASE("window: a slider follows the mouse", "[ui]") {
    if (noDisplay()) return;
    Window window(small());
    float value = 0;
    ImVec2 low{}, high{};
    const auto frames = [&](int count) {
        for (int i = 0; i < count; ++i) {
            REQUIRE(window.beginFrame());
            ImGui::SetNextWindowPos({10, 10});
            ImGui::SetNextWindowSize({300, 100});
            ImGui::Begin("panel");
            ImGui::SliderFloat("stiffness", &value, 0, 1000, "%.0f N/m");
            low = ImGui::GetItemRectMin();
            high = {low.x + ImGui::CalcItemWidth(), ImGui::GetItemRectMax().y};
            ImGui::End();
            window.endFrame();
        }
    };
    glfwFocusWindow(window.handle());
    frames(10);
    const auto click = [&](double x) {
        glfwSetCursorPos(window.handle(), x, 0.5 * (low.y + high.y));
        frames(3);
        ImGui_ImplGlfw_MouseButtonCallback(window.handle(), GLFW_MOUSE_BUTTON_LEFT, GLFW_PRESS, 0);
        frames(3);
    };
    click(0.5 * (low.x + high.x));
    REQUIRE(value == Approx(500).margin(20));  // the slider's grab is some pixels wide
    click(high.x - 1);
    REQUIRE(value == Approx(1000));
}

TEST_CASE("window: text has the scale of the monitor, or the one chosen", "[ui]") {
    if (noDisplay()) return;
    const auto heightAt = [](std::optional<float> scale) {
        WindowOptions options = small();
        options.uiScale = scale;
        Window window(options);
        REQUIRE(window.beginFrame());
        const float height = ImGui::GetTextLineHeight();
        window.endFrame();
        if (scale) CHECK(window.scale() == *scale);
        return height;
    };
    const float one = heightAt(1.f);
    CHECK(heightAt(2.f) == Approx(2 * one));
    float x = 1, y = 1;
    glfwGetMonitorContentScale(glfwGetPrimaryMonitor(), &x, &y);
    CHECK(heightAt({}) == Approx(std::round(x * one)));
}

TEST_CASE("window: is no larger than the screen, at its start and when it is given a remembered size", "[ui]") {
    if (noDisplay()) return;
    WindowOptions options = small();
    options.width = 9000;
    options.height = 7000;
    Window window(options);
    glm::ivec2 corner, room;
    glfwGetMonitorWorkarea(glfwGetPrimaryMonitor(), &corner.x, &corner.y, &room.x, &room.y);
    const auto settled = [&] {
        for (int i = 0; i < 5 && window.beginFrame(); ++i) window.endFrame();
        return window.size();
    };
    CHECK(settled() == room);
    window.setSize({8000, 300});
    CHECK(settled() == glm::ivec2(room.x, 300));
}

TEST_CASE("window: a plot shows a spike of one sample and accepts NaN and empty data", "[ui]") {
    if (noDisplay()) return;
    Window window(small());
    std::array<float, 4000> data{};
    data[1234] = 1;
    data[50] = std::numeric_limits<float>::quiet_NaN();
    Image picture;
    for (int i = 0; i < 2; ++i) {
        REQUIRE(window.beginFrame());
        ImGui::SetNextWindowPos({0, 0});
        ImGui::SetNextWindowSize({400, 300});
        ImGui::Begin("panel");
        const Series spike{"force", {data.data(), data.size(), 0, data.size()}, {0, 1, 0, 1}};
        PlotOptions options;
        options.unit = "N";
        options.yMax = 2.f;
        drawSeries("Spike", std::array{spike}, options);
        options.logarithmic = true;
        options.budget = 100.f;
        drawSeries("Nothing", {}, options);
        ImGui::End();
        window.endFrame(&picture);
    }
    // Half the plot's height, 6 lines of text, in one column of pure green; green text is much lower.
    int tallest = 0;
    for (int x = 0; x < picture.width; ++x) {
        int run = 0;
        for (int y = 0; y < picture.height; ++y) {
            run = pixel(picture, x, y) == std::array{0, 255, 0} ? run + 1 : 0;
            tallest = std::max(tallest, run);
        }
    }
    REQUIRE(tallest >= 30);
}

TEST_CASE("window: a process can open many in sequence, among headless contexts and other windows", "[ui]") {
    if (noDisplay()) return;
    const auto requireDraws = [](Window& window, int shade) {
        Image picture;
        REQUIRE(window.beginFrame());
        ImGui::GetForegroundDrawList()->AddRectFilled({10, 20}, {60, 50}, IM_COL32(shade, 0, 255, 255));
        window.endFrame(&picture);
        REQUIRE(pixel(picture, 30, 35) == std::array{shade, 0, 255});
    };
    for (int i = 0; i < 12; ++i) {
        CAPTURE(i);
        Window window(small());
        requireDraws(window, 10 * i);
        if (i % 3 == 1) {  // a picture is taken while the window is open
            const HeadlessContext context;
            REQUIRE(glDescription().starts_with("OpenGL"));
        }
        if (i % 3 == 2) {  // hints that were set for another window stay set
            glfwWindowHint(GLFW_CLIENT_API, GLFW_NO_API);
            glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
            GLFWwindow* other = glfwCreateWindow(100, 100, "another", nullptr, nullptr);
            REQUIRE(other);
            glfwDestroyWindow(other);
        }
        requireDraws(window, 10 * i + 5);
        REQUIRE(glfwGetWindowAttrib(window.handle(), GLFW_RESIZABLE) == GLFW_TRUE);
    }
    HeadlessContext context;
    {
        Window window(small());
        requireDraws(window, 200);
        context.makeCurrent();
        REQUIRE(glDescription().starts_with("OpenGL"));
        requireDraws(window, 210);
    }
    context.makeCurrent();
    REQUIRE(glDescription().starts_with("OpenGL"));
}

}  // namespace touchstone::window_tests
