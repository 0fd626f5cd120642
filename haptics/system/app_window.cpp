#include "haptics/system/app_window.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>
#include <utility>

#include "engine/view/image_file.hpp"
#include "haptics/system/mouse_grab.hpp"
#include "haptics/system/units.hpp"

namespace touchstone::system {
namespace {

using Clock = std::chrono::steady_clock;

// Where the driver does not wait for the monitor; while a scene is opened with nothing to see, the processor is needed
// there.
constexpr auto kShortestFrame = std::chrono::milliseconds(8), kOpeningFrame = std::chrono::milliseconds(60);
constexpr double kMessageSeconds = 8;  // how long a warning stays over the picture

/// A rectangle of the window, screen units from its upper-left corner.
struct Area {
    ImVec2 position, size;
};

/// Where the panels stand; the scene gets what they leave.
struct Layout {
    Area scene, haptics, plots, status, picture;

    Layout(glm::vec2 window, float top, float em, bool panels) {
        const float left = panels ? std::min(20 * em, 0.3f * window.x) : 0;
        const float right = panels ? std::min(25 * em, 0.32f * window.x) : 0;
        const float bottom = panels ? std::min(9 * em, 0.25f * window.y) : 0;
        const float height = std::max(window.y - top, 1.f);
        const float hapticsHeight = std::min(33.5f * em, 0.63f * height);
        scene = {{0, top}, {left, height - hapticsHeight}};
        haptics = {{0, top + height - hapticsHeight}, {left, hapticsHeight}};
        plots = {{window.x - right, top}, {right, height}};
        picture = {{left, top}, {std::max(window.x - left - right, 1.f), std::max(height - bottom, 1.f)}};
        status = {{left, window.y - bottom}, {picture.size.x, bottom}};
    }
};

float statusBarHeight() { return 1.5f * ImGui::GetFontSize(); }

bool beginPanel(const char* title, const Area& area) {
    ImGui::SetNextWindowPos(area.position);
    ImGui::SetNextWindowSize(area.size);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {ImGui::GetStyle().ItemSpacing.x, 4});
    return ImGui::Begin(title, nullptr,
                        ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                            ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                            ImGuiWindowFlags_NoFocusOnAppearing);
}

void endPanel() {
    ImGui::End();
    ImGui::PopStyleVar(2);
}

std::vector<std::filesystem::path> findScenes(const std::vector<std::filesystem::path>& folders) {
    std::vector<std::filesystem::path> scenes;
    for (const std::filesystem::path& folder : folders) {
        std::error_code ignored;
        for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
            if (const auto extension = entry.path().extension(); extension == ".glb" || extension == ".gltf")
                scenes.push_back(entry.path());
    }
    std::sort(scenes.begin(), scenes.end());
    return scenes;
}

class App {
  public:
    explicit App(const WindowRunOptions& options);
    int run();

  private:
    bool beginFrame(bool& last);
    void refreshScene();
    void drawPicture(const Area& area);
    void drawPanels(const Layout& layout);
    void drawBar();
    void drawHints(const Area& picture) const;
    void handleMouse(const Area& picture);
    void handleKeys();
    void carryOut();
    bool timeIsUp();
    void lookAtAll(const Area& picture);
    void noteCost(double cpuMs);

    const WindowRunOptions& options_;
    engine::Window window_;
    engine::Renderer renderer_;
    LiveSession session_;
    std::vector<std::filesystem::path> scenes_;

    std::shared_ptr<HapticScene> viewed_;  // outlives the view of it
    std::unique_ptr<SceneView> view_;
    std::uint64_t viewedNumber_ = 0;
    engine::OrbitCamera camera_;
    MouseGrab grab_;
    bool holding_ = false, everHeld_ = false;

    DisplayOptions display_;
    ScenePanelState scenePanel_;
    LiveMeasure measure_;
    MenuState menu_;
    PanelRequests requests_;
    ItemRects items_, drawnItems_;
    FrameCost cost_, shownCost_;
    std::optional<glm::vec2> toolOnScreen_;
    std::optional<Clock::time_point> runningSince_;
};

App::App(const WindowRunOptions& options)
    : options_(options), window_(options.window), session_(options.session), display_(options.display) {
    scenes_ = findScenes(options.sceneFolders);
    window_.onDrop([this](const std::vector<std::filesystem::path>& files) { requests_.open = files.front(); });
    if (options.scene.empty())
        menu_.openDialog = true;
    else
        session_.open({.file = options.scene, .roles = {}});
}

int App::run() {
    Clock::time_point began = Clock::now();
    bool last = false;
    for (long number = 0; !last; ++number) {
        std::this_thread::sleep_until(began + (viewed_ || !session_.opening() ? kShortestFrame : kOpeningFrame));
        began = Clock::now();
        const double cpuBegan = threadCpuMicroseconds();
        if (options_.onFrame) {
            WindowFrame frame{window_, session_, display_, measure_, drawnItems_, toolOnScreen_, number, cost_};
            options_.onFrame(frame);
        }
        last = timeIsUp();
        if (!beginFrame(last)) break;
        session_.update();
        refreshScene();

        const float top = ImGui::GetFrameHeight();  // of the menu bar
        const glm::vec2 aboveBar = glm::vec2(window_.size()) - glm::vec2(0, statusBarHeight());
        const Layout layout(aboveBar, top, ImGui::GetFontSize(), menu_.panels);
        items_.clear();
        if (viewedNumber_ != session_.sceneNumber()) {
            viewedNumber_ = session_.sceneNumber();
            lookAtAll(layout.picture);
        }
        handleKeys();
        handleMouse(layout.picture);
        drawPicture(layout.picture);
        drawPanels(layout);
        if (requests_.frameCamera) lookAtAll(layout.picture);
        carryOut();

        const bool wanted = last && !options_.screenshot.empty();
        engine::Image picture;
        window_.endFrame(wanted || measure_.wantsPicture() ? &picture : nullptr);
        if (measure_.wantsPicture()) measure_.take(picture, window_.size(), session_);
        std::swap(items_, drawnItems_);
        noteCost(1e-3 * (threadCpuMicroseconds() - cpuBegan));
        if (wanted) engine::writePng(options_.screenshot, picture);
    }
    if (options_.onEnd) options_.onEnd(session_);
    return options_.scene.empty() || session_.scene() ? 0 : 1;
}

void App::noteCost(double cpuMs) {
    cost_ = {.cpuMs = cpuMs, .drawCalls = (view_ ? renderer_.cost().calls : 0) + window_.interfaceDrawCalls()};
    constexpr double kShare = 0.1;  // of the newest frame, so that one can read it
    shownCost_ = {.cpuMs = shownCost_.cpuMs + kShare * (cpuMs - shownCost_.cpuMs), .drawCalls = cost_.drawCalls};
}

/// False once the window is closed; before that it stays for one more frame if a picture of it is wanted.
bool App::beginFrame(bool& last) {
    if (window_.beginFrame()) return true;
    if (last || options_.screenshot.empty()) return false;
    last = true;
    glfwSetWindowShouldClose(window_.handle(), GLFW_FALSE);
    return window_.beginFrame();
}

bool App::timeIsUp() {
    if (!options_.seconds) return false;
    const bool stuck = !options_.scene.empty() && !session_.scene() && !session_.opening();
    if (session_.running() && !runningSince_) runningSince_ = Clock::now();
    return stuck || (runningSince_ && Clock::now() - *runningSince_ > std::chrono::duration<double>(*options_.seconds));
}

void App::refreshScene() {
    if (viewed_ == session_.scene()) return;
    view_.reset();
    viewed_ = session_.scene();
    view_ = std::make_unique<SceneView>(renderer_, *viewed_);
    scenePanel_ = {};
    grab_.reset();
    window_.setTitle("Touchstone - " + session_.request().file.stem().string());
}

void App::lookAtAll(const Area& picture) {
    if (!view_) return;
    const TickRecord* record = session_.record();
    const Pose* X_WT = record ? &record->X_WT : viewed_->world ? &viewed_->world->X_WT_start : nullptr;
    const float aspect = picture.size.x / picture.size.y;
    if (requests_.frameCamera)  // the direction one has turned to stays
        view_->fit(camera_, X_WT, aspect);
    else
        camera_ = view_->look(options_.view, record, session_.settings(), aspect);
}

void App::drawPicture(const Area& area) {
    engine::Frame frame;
    frame.camera = camera_;
    frame.pixelScale = window_.scale();
    frame.hiddenOpacity = kHiddenOpacity;
    if (view_)
        view_->fill(frame, session_.record(), session_.settings(), display_);
    else
        frame.grid.visible = false;

    const glm::vec2 pixels(window_.framebufferSize()), units(window_.size());
    if (units.x <= 0 || units.y <= 0) return;
    const glm::vec2 scale = pixels / units;
    const auto whole = [](float v) { return static_cast<int>(std::lround(v)); };
    renderer_.draw(frame, {.x = whole(scale.x * area.position.x),
                           .y = whole(scale.y * (units.y - area.position.y - area.size.y)),
                           .width = whole(scale.x * area.size.x),
                           .height = whole(scale.y * area.size.y)});
}

void App::drawPanels(const Layout& layout) {
    const std::string& device = session_.device();
    const MenuView menu{scenes_, device, session_.running(), viewed_ && viewed_->demonstration};
    const bool wasOpen = menu_.openDialog;
    drawMenuBar(menu, menu_, display_, requests_, &items_);
    if (menu_.openDialog && !wasOpen) scenes_ = findScenes(options_.sceneFolders);

    if (menu_.panels) {
        if (beginPanel("Scene", layout.scene)) {
            if (viewed_)
                drawScenePanel(*viewed_, !session_.request().roles.empty(), display_, scenePanel_, requests_, &items_);
            else
                ImGui::TextDisabled("No scene is open.");
        }
        endPanel();
        if (beginPanel("Haptics", layout.haptics)) {
            Settings settings = session_.settings();
            if (drawHapticsPanel(settings, requests_, &items_)) session_.setSettings(settings);
        }
        endPanel();
        if (beginPanel("Plots", layout.plots)) measure_.draw(session_, &items_);
        endPanel();
        if (beginPanel("Status", layout.status)) drawStatusPanel(session_.messages());
        endPanel();
    }
    drawBar();
    drawHints(layout.picture);
    drawDialogs(menu, menu_, requests_, &items_);
    if (const auto progress = session_.opening()) drawOpening(*progress, requests_, &items_);
}

/// At the bottom, whatever else is shown.
void App::drawBar() {
    const float height = statusBarHeight();
    const glm::vec2 window = window_.size();
    ImGui::SetNextWindowPos({0, window.y - height});
    ImGui::SetNextWindowSize({window.x, height});
    ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0.6f * ImGui::GetFontSize(), 0.2f * ImGui::GetFontSize()});
    ImGui::Begin("Health", nullptr,
                 ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                     ImGuiWindowFlags_NoFocusOnAppearing);
    drawStatusBar({session_.snapshot(), session_.realTime(), session_.device(), session_.deviceFacts(), shownCost_},
                  &items_);
    ImGui::End();
    ImGui::PopStyleVar(2);
}

/// Over the picture: what the mouse does until it has done it, and the newest warning while it is new.
void App::drawHints(const Area& picture) const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const float em = ImGui::GetFontSize();
    if (session_.running() && !everHeld_) {
        const char* hint = "Drag the tool: left button moves, wheel in depth, right button turns. Help says more.";
        const ImVec2 size = ImGui::CalcTextSize(hint);
        list.AddText({picture.position.x + 0.5f * (picture.size.x - size.x),
                      picture.position.y + picture.size.y - size.y - 0.6f * em},
                     ImGui::GetColorU32(ImGuiCol_Text, 0.75f), hint);
    }
    const auto& messages = session_.messages();
    const auto warning = std::find_if(messages.rbegin(), messages.rend(),
                                      [](const Message& m) { return m.kind != Message::Kind::Note; });
    if (warning == messages.rend() || session_.secondsSinceStart() - warning->seconds > kMessageSeconds) return;
    const float width = picture.size.x - 4 * em;
    const ImVec2 size = ImGui::CalcTextSize(warning->text.c_str(), nullptr, false, width);
    const ImVec2 at{picture.position.x + 2 * em, picture.position.y + em};
    list.AddRectFilled({at.x - 0.5f * em, at.y - 0.4f * em}, {at.x + size.x + 0.5f * em, at.y + size.y + 0.4f * em},
                       ImGui::GetColorU32(ImGuiCol_PopupBg, 0.9f), 0.3f * em);
    const bool error = warning->kind == Message::Kind::Error;
    list.AddText(nullptr, 0, at, ImGui::GetColorU32(error ? ImVec4(1, 0.5f, 0.45f, 1) : ImVec4(1, 0.8f, 0.4f, 1)),
                 warning->text.c_str(), nullptr, width);
}

void App::handleMouse(const Area& picture) {
    const ImGuiIO& io = ImGui::GetIO();
    MouseFrame mouse;
    mouse.cursor = {io.MousePos.x - picture.position.x, io.MousePos.y - picture.position.y};
    mouse.viewport = {picture.size.x, picture.size.y};
    mouse.left = io.MouseDown[0];
    mouse.right = io.MouseDown[1];
    mouse.middle = io.MouseDown[2];
    mouse.turnKey = io.KeyShift;
    mouse.wheel = io.MouseWheel;
    const bool inside = ImGui::IsMousePosValid() && mouse.cursor.x >= 0 && mouse.cursor.y >= 0 &&
                        mouse.cursor.x < mouse.viewport.x && mouse.cursor.y < mouse.viewport.y;
    mouse.elsewhere = io.WantCaptureMouse || !inside;

    const TickRecord* record = session_.record();
    const bool byMouse = session_.device() == "mouse";
    GrabTool tool;
    if (record)
        tool = {.tree = viewed_->world->tool.get(),
                .X_WT = record->X_WT,
                .X_WT_device = byMouse ? record->X_WT_device : record->X_WT};
    toolOnScreen_.reset();
    if (record)
        if (const auto at = camera_.project(glm::vec3(toMetres(record->X_WT * tool.tree->center())), mouse.viewport))
            toolOnScreen_ = *at + glm::vec2(picture.position.x, picture.position.y);
    if (ImGui::IsMousePosValid() || !grab_.holding()) grab_.update(mouse, camera_, record ? &tool : nullptr);

    if (grab_.holding()) {
        everHeld_ = true;
        if (!byMouse) session_.chooseDevice("mouse");
        if (MouseTarget* target = session_.mouse()) target->grab(*grab_.wanted());
    } else if (holding_ && session_.mouse()) {
        session_.mouse()->release();
    }
    holding_ = grab_.holding();
    if (grab_.hovering() || holding_) ImGui::SetMouseCursor(ImGuiMouseCursor_Hand);
}

void App::handleKeys() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantTextInput) return;
    const auto pressed = [](int key) { return ImGui::IsKeyPressed(key, false); };
    if (io.KeyCtrl) {
        if (pressed(GLFW_KEY_O)) menu_.openDialog = true;
        if (pressed(GLFW_KEY_Q)) requests_.quit = true;
        return;
    }
    if (pressed(GLFW_KEY_R)) requests_.restart = true;
    if (pressed(GLFW_KEY_F)) requests_.frameCamera = true;
    if (pressed(GLFW_KEY_H)) menu_.panels = !menu_.panels;
    if (pressed(GLFW_KEY_S)) session_.setSettings(withSolversSwapped(session_.settings()));
    for (const DisplaySwitch& which : displaySwitches())
        if (pressed(which.key)) turn(display_, which, !isOn(display_, which));  // GLFW's keys are capital letters
    if (pressed(GLFW_KEY_SPACE)) {
        Settings settings = session_.settings();
        settings.pause = !settings.pause;
        session_.setSettings(settings);
    }
}

void App::carryOut() {
    const PanelRequests requests = std::exchange(requests_, {});
    if (!requests.refusal.empty()) session_.say(Message::Kind::Error, requests.refusal);
    if (requests.open) session_.open({.file = *requests.open, .roles = {}});
    if (requests.reload) session_.reload();
    if (requests.cancelOpening) session_.cancelOpening();
    if (requests.role) session_.giveRole(requests.role->first, requests.role->second);
    if (requests.saveRoles) session_.saveRoles(*requests.saveRoles);
    if (requests.device) session_.chooseDevice(*requests.device);
    if (requests.restart) session_.restart();
    if (requests.device || requests.restart) grab_.reset();
    if (requests.quit) window_.close();
}

}  // namespace

int runWindow(const WindowRunOptions& options) {
    App app(options);
    return app.run();
}

}  // namespace touchstone::system
