#include "haptics/system/app_window.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <thread>
#include <utility>

#include "engine/view/image_file.hpp"
#include "haptics/system/mouse_grab.hpp"
#include "haptics/system/panel_layout.hpp"
#include "haptics/system/presets.hpp"
#include "haptics/system/undo.hpp"
#include "haptics/system/units.hpp"
#include "haptics/system/user_files.hpp"

namespace touchstone::system {
namespace {

using Clock = std::chrono::steady_clock;

// Where the driver does not wait for the monitor; while a scene is opened with nothing to see, the processor is needed
// there.
constexpr auto kShortestFrame = std::chrono::milliseconds(8), kOpeningFrame = std::chrono::milliseconds(60);
constexpr double kMessageSeconds = 8;  // how long a warning stays over the picture

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

/// All that undo goes back to.
struct UserState {
    std::vector<SceneEdit> edits;
    Settings settings;  ///< never paused: pausing is no change
    friend bool operator==(const UserState&, const UserState&) = default;
};

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
    void drawLeftPanel();
    void drawGuideWindow(const Area& picture);
    void drawPull(const Area& picture) const;
    void handleMouse(const Area& picture);
    void handleKeys();
    void carryOut();
    void noteState();
    void goTo(const std::optional<UserState>& state);
    void copyCommand();
    void toggleRecording();
    bool timeIsUp();
    void lookAtAll(const Area& picture);
    void noteCost(double cpuMs);
    ToolPoses toolPoses() const;

    const WindowRunOptions& options_;
    PanelSizes sizes_;  // these two outlive the window, which writes them when it closes
    std::string iniFile_;
    engine::Window window_;
    engine::Renderer renderer_;
    LiveSession session_;
    std::vector<std::filesystem::path> scenes_;
    RecentScenes recent_;

    std::shared_ptr<HapticScene> viewed_;  // outlives the view of it
    std::unique_ptr<SceneView> view_;
    std::uint64_t viewedNumber_ = 0;
    std::filesystem::path viewedFile_;
    std::string title_;
    engine::OrbitCamera camera_;
    Area picture_;
    MouseGrab grab_;
    Selection selection_;
    double strength_ = 1;  // of the hand that the mouse device was told of last
    bool holding_ = false, everHeld_ = false, focused_ = false;

    DisplayOptions display_;
    ScenePanelState scenePanel_;
    LiveMeasure measure_;
    InspectorState inspector_;
    engine::Entity pageNode_;  // that the left panel's pages were of
    std::string pageDevice_;
    HapticsPanelState hapticsPanel_;
    DevicePanelState devicePanel_;
    MenuState menu_;
    PanelRequests requests_;
    UndoStack<UserState> undo_;
    std::filesystem::path undoFile_;  // that the states are of
    ItemRects items_, drawnItems_;
    FrameCost cost_, shownCost_;
    std::optional<glm::vec2> toolOnScreen_;
    std::optional<Clock::time_point> runningSince_;
};

App::App(const WindowRunOptions& options)
    : options_(options),
      window_(options.window),
      session_([&] {
          SessionOptions session = options.session;
          session.configFolder = options.configFolder;
          return session;
      }()),
      recent_(options.configFolder),
      display_(options.display) {
    if (std::error_code error; !options.configFolder.empty()) {
        std::filesystem::create_directories(options.configFolder, error);
        iniFile_ = options.configFolder / "window.ini";
        ImGui::GetIO().IniFilename = iniFile_.c_str();
        sizes_.remember();
    }
    scenes_ = findScenes(options.sceneFolders);
    window_.onDrop([this](const std::vector<std::filesystem::path>& files) { requests_.open = files.front(); });
    if (options.scene.empty())
        menu_.openDialog = true;
    else
        session_.open({.file = options.scene});
}

int App::run() {
    Clock::time_point began = Clock::now();
    bool last = false;
    for (long number = 0; !last; ++number) {
        std::this_thread::sleep_until(began + (viewed_ || !session_.opening() ? kShortestFrame : kOpeningFrame));
        began = Clock::now();
        const double cpuBegan = threadCpuMicroseconds();
        if (options_.onFrame) {
            const ImVec2 low = picture_.position, size = picture_.size;
            WindowFrame frame{
                window_,     session_,      display_, measure_,
                drawnItems_, toolOnScreen_, camera_,  glm::vec4(low.x, low.y, low.x + size.x, low.y + size.y),
                selection_,  number,        cost_};
            options_.onFrame(frame);
        }
        last = timeIsUp();
        if (!beginFrame(last)) break;
        session_.update();
        refreshScene();

        const float top = ImGui::GetFrameHeight();  // of the menu bar
        const glm::vec2 aboveBar = glm::vec2(window_.size()) - glm::vec2(0, statusBarHeight());
        const Layout layout(aboveBar, top, ImGui::GetFontSize(), sizes_, menu_.panels);
        picture_ = layout.picture;
        items_.clear();
        if (viewedNumber_ != session_.sceneNumber()) {
            viewedNumber_ = session_.sceneNumber();
            if (viewedFile_ != session_.request().file) lookAtAll(layout.picture);  // else it was only changed
            viewedFile_ = session_.request().file;
        }
        // Nobody looks: motors are not to push.
        const bool focused = glfwGetWindowAttrib(window_.handle(), GLFW_FOCUSED);
        if (focused_ && !focused && session_.deviceFacts().limits.motors) session_.stop();
        focused_ = focused;
        handleKeys();
        handleMouse(layout.picture);
        drawPicture(layout.picture);
        drawPanels(layout);
        if (requests_.frameCamera) lookAtAll(layout.picture);
        carryOut();
        noteState();

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
    if (viewed_ && viewedFile_ == session_.request().file)
        selection_.moveTo(viewed_->scene, session_.scene()->scene);
    else
        selection_.select({});
    viewed_ = session_.scene();
    view_ = std::make_unique<SceneView>(renderer_, *viewed_);
    grab_.reset();
    recent_.add(session_.request().file);
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
    const MenuView menu{.scenes = scenes_,
                        .recent = recent_.list(),
                        .file = session_.request().file,
                        .device = device,
                        .running = session_.running(),
                        .hasScene = viewed_ != nullptr,
                        .hasDemonstration = viewed_ && viewed_->demonstration,
                        .hasSelection = bool(selection_.node()),
                        .canUndo = undo_.canUndo(),
                        .canRedo = undo_.canRedo(),
                        .recording = session_.recorder() != nullptr};
    const bool wasOpen = menu_.openDialog;
    drawMenuBar(menu, menu_, display_, requests_, &items_);
    if (menu_.openDialog && !wasOpen) scenes_ = findScenes(options_.sceneFolders);

    if (menu_.panels) {
        if (beginPanel("Scene", layout.scene)) {
            if (viewed_) {
                scenePanel_.selected = selection_.node();
                drawScenePanel(*viewed_, display_, scenePanel_, &items_);
                selection_.select(scenePanel_.selected);
            } else {
                ImGui::TextDisabled("No scene is open.");
            }
        }
        endPanel();
        if (beginPanel("Haptics", layout.haptics)) drawLeftPanel();
        endPanel();
        if (beginPanel("Plots", layout.plots)) measure_.draw(session_, &items_);
        endPanel();
        if (beginPanel("Log", layout.log)) drawLogPanel(session_.messages(), &items_);
        endPanel();
        drawSplitters(layout, ImGui::GetFontSize(), sizes_);
    }
    drawBar();
    drawGuideWindow(layout.picture);
    drawHints(layout.picture);
    if (options_.panel) {
        const ImVec2 low = layout.picture.position, size = layout.picture.size;
        options_.panel(session_, {low.x, low.y, low.x + size.x, low.y + size.y}, items_);
    }
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
    const Gauge* gauge = viewed_ && viewed_->roles.gauge ? &*viewed_->roles.gauge : nullptr;
    if (drawStatusBar({session_.snapshot(), session_.realTime(), session_.device(), session_.deviceFacts(), shownCost_,
                       session_.recorder(), gauge},
                      &items_))
        requests_.stopOrEngage = true;
    ImGui::End();
    ImGui::PopStyleVar(2);
}

/// Over the picture: what the mouse does until it has done it, and the newest warning while it is new.
void App::drawHints(const Area& picture) const {
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const float em = ImGui::GetFontSize();
    if (session_.running() && !everHeld_) {
        const char* hint = "Drag the tool: left moves it, right turns it. F1 tells all.";
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

/// The settings; a device with hardware behind it, and what is selected, have pages beside them.
void App::drawLeftPanel() {
    const auto drawSettings = [&] {
        Settings settings = session_.settings();
        const Settings& own = viewed_ ? viewed_->settings : settings;
        if (drawHapticsPanel(own, settings, hapticsPanel_, requests_, &items_)) session_.setSettings(settings);
    };
    const engine::Entity node = selection_.node();
    const bool isNew = node != pageNode_;
    pageNode_ = node;
    const bool selected = viewed_ && viewed_->scene.registry.alive(node);
    const bool device = session_.deviceControl() || !session_.deviceTrouble().empty();
    const std::string hardware = device ? session_.device() + session_.deviceTrouble() : "";
    const bool isNewDevice = hardware != std::exchange(pageDevice_, hardware);
    if (!selected && !device) {
        drawSettings();
        return;
    }
    if (!ImGui::BeginTabBar("pages")) return;
    if (ImGui::BeginTabItem("Settings")) {
        drawSettings();
        ImGui::EndTabItem();
    }
    noteItem(&items_, "page settings");
    if (device &&
        ImGui::BeginTabItem("Device", nullptr, isNewDevice ? ImGuiTabItemFlags_SetSelected : ImGuiTabItemFlags_None)) {
        drawDevicePanel({session_.device(), session_.deviceFacts(), session_.settings(), session_.deviceControl(),
                         session_.deviceTrouble()},
                        devicePanel_, requests_, &items_);
        ImGui::EndTabItem();
    }
    if (device) noteItem(&items_, "page device");
    if (selected &&
        ImGui::BeginTabItem("Selected", nullptr, isNew ? ImGuiTabItemFlags_SetSelected : ImGuiTabItemFlags_None)) {
        drawInspector(*viewed_, node, inspector_, requests_, &items_);
        ImGui::EndTabItem();
    }
    if (selected) noteItem(&items_, "page selected");
    ImGui::EndTabBar();
}

void App::drawGuideWindow(const Area& picture) {
    if (!viewed_ || viewed_->missing.empty() || session_.opening()) return;
    const float em = ImGui::GetFontSize();
    ImGui::SetNextWindowPos({picture.position.x + 0.7f * em, picture.position.y + 0.7f * em});
    ImGui::SetNextWindowSize({18 * em, 0});
    ImGui::Begin("Roles", nullptr,
                 ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                     ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing);
    drawGuide(*viewed_, selection_.node(), requests_, &items_);
    ImGui::End();
}

/// While the tool is held: from the point that is held to where the mouse wants it. It lengthens where the tool is held
/// back.
void App::drawPull(const Area& picture) const {
    const TickRecord* record = session_.record();
    if (!grab_.holding() || !record) return;
    const glm::vec2 viewport(picture.size.x, picture.size.y);
    const auto a = camera_.project(glm::vec3(toMetres(record->X_WT * grab_.heldPoint())), viewport);
    const auto b = camera_.project(glm::vec3(toMetres(grab_.anchor())), viewport);
    if (!a || !b) return;
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    const ImVec2 from{picture.position.x + a->x, picture.position.y + a->y},
        to{picture.position.x + b->x, picture.position.y + b->y};
    constexpr ImU32 kColor = IM_COL32(255, 215, 110, 230);
    list.AddLine(from, to, kColor, 2);
    list.AddCircleFilled(from, 4, kColor);
    list.AddCircle(to, 6, kColor, 0, 2);
}

ToolPoses App::toolPoses() const {
    const TickRecord* record = session_.record();
    if (!record) return {};
    return {record->X_WT, session_.device() == "mouse" ? record->X_WT_device : record->X_WT, true};
}

void App::handleMouse(const Area& picture) {
    const ImGuiIO& io = ImGui::GetIO();
    const auto down = [](int key) { return ImGui::IsKeyDown(key); };
    const auto between = [&](int less, int more) { return float(down(more)) - float(down(less)); };
    MouseFrame mouse;
    mouse.cursor = {io.MousePos.x - picture.position.x, io.MousePos.y - picture.position.y};
    mouse.viewport = {picture.size.x, picture.size.y};
    mouse.left = io.MouseDown[0];
    mouse.right = io.MouseDown[1];
    mouse.middle = io.MouseDown[2];
    mouse.turnKey = io.KeyShift;
    mouse.wheel = io.MouseWheel;
    if (!io.WantTextInput) {
        constexpr float kStepsPerSecond = 15, kRadiansPerSecond = 1;
        mouse.depthKeys = kStepsPerSecond * io.DeltaTime * between(GLFW_KEY_PAGE_DOWN, GLFW_KEY_PAGE_UP);
        mouse.turnKeys = kRadiansPerSecond * io.DeltaTime *
                         glm::vec3(between(GLFW_KEY_UP, GLFW_KEY_DOWN), between(GLFW_KEY_LEFT, GLFW_KEY_RIGHT),
                                   between(GLFW_KEY_COMMA, GLFW_KEY_PERIOD));
    }
    const bool inside = ImGui::IsMousePosValid() && mouse.cursor.x >= 0 && mouse.cursor.y >= 0 &&
                        mouse.cursor.x < mouse.viewport.x && mouse.cursor.y < mouse.viewport.y;
    mouse.elsewhere = io.WantCaptureMouse || !inside;

    const TickRecord* record = session_.record();
    const ToolPoses poses = toolPoses();
    GrabTool tool;
    if (record) tool = {.tree = viewed_->world->tool.get(), .X_WT = poses.X_WT, .X_WT_device = poses.X_WT_device};
    toolOnScreen_.reset();
    if (record)
        if (const auto at = camera_.project(glm::vec3(toMetres(record->X_WT * tool.tree->center())), mouse.viewport))
            toolOnScreen_ = *at + glm::vec2(picture.position.x, picture.position.y);

    std::optional<Pose> wanted;  // where the hand is to go
    if (viewed_ && !grab_.holding()) {
        const Selection::Wish wish = selection_.update(mouse, camera_, *viewed_, poses, inspector_.ownAxes,
                                                       5.5f * ImGui::GetFontSize(), io.KeyCtrl);
        if (wish.edit) requests_.edits = {*wish.edit};
        wanted = wish.hand;
    }
    if (wanted) grab_.reset();  // the next grab goes on from where the handles left the hand
    if (selection_.busy()) mouse.elsewhere = true;
    if (!selection_.dragging() && (ImGui::IsMousePosValid() || !grab_.holding()))
        grab_.update(mouse, camera_, record ? &tool : nullptr);
    if (grab_.holding()) wanted = grab_.wanted();
    if (viewed_ && grab_.clicked()) selection_.click(*viewed_, poses, camera_.ray(mouse.cursor, mouse.viewport));

    if (wanted) {
        everHeld_ = true;
        if (session_.device() != "mouse") session_.chooseDevice("mouse");
        if (MouseTarget* target = session_.mouse()) target->grab(*wanted, hapticsPanel_.strength);
    } else if (session_.mouse() && (holding_ || strength_ != hapticsPanel_.strength)) {
        session_.mouse()->release(hapticsPanel_.strength);
        strength_ = hapticsPanel_.strength;
    }
    holding_ = wanted.has_value();
    if (grab_.hovering() || selection_.busy() || holding_) ImGui::SetMouseCursor(ImGuiMouseCursor_Hand);
    const glm::vec2 corner(picture.position.x, picture.position.y);
    ImDrawList& list = *ImGui::GetBackgroundDrawList();
    list.PushClipRect(picture.position, {picture.position.x + picture.size.x, picture.position.y + picture.size.y});
    if (viewed_) selection_.draw(list, camera_, corner, mouse.viewport, *viewed_, poses);
    drawPull(picture);
    list.PopClipRect();
}

void App::handleKeys() {
    const ImGuiIO& io = ImGui::GetIO();
    if (io.WantTextInput) return;
    const auto pressed = [](int key) { return ImGui::IsKeyPressed(key, false); };
    if (pressed(GLFW_KEY_F1) || (io.KeyShift && pressed(GLFW_KEY_SLASH))) menu_.helpDialog = true;
    using engine::StandardView;
    if (pressed(GLFW_KEY_KP_1)) requests_.view = io.KeyCtrl ? StandardView::Back : StandardView::Front;
    if (pressed(GLFW_KEY_KP_3)) requests_.view = io.KeyCtrl ? StandardView::Left : StandardView::Right;
    if (pressed(GLFW_KEY_KP_7)) requests_.view = io.KeyCtrl ? StandardView::Bottom : StandardView::Top;
    if (io.KeyCtrl) {
        if (pressed(GLFW_KEY_O)) menu_.openDialog = true;
        if (pressed(GLFW_KEY_S)) menu_.saveDialog = viewed_ != nullptr;
        if (pressed(GLFW_KEY_Q)) requests_.quit = true;
        if (pressed(GLFW_KEY_Z)) (io.KeyShift ? requests_.redo : requests_.undo) = true;
        if (pressed(GLFW_KEY_Y)) requests_.redo = true;
        if (io.KeyShift && pressed(GLFW_KEY_C)) requests_.copyCommand = true;
        return;
    }
    if (pressed(GLFW_KEY_ESCAPE) && viewed_)
        selection_.dragging() ? selection_.cancel(*viewed_) : selection_.select({});
    if (pressed(GLFW_KEY_R)) requests_.restart = true;
    if (pressed(GLFW_KEY_F)) (selection_.node() ? requests_.frameSelection : requests_.frameCamera) = true;
    if (pressed(GLFW_KEY_A) || pressed(GLFW_KEY_HOME)) requests_.frameCamera = true;
    if (pressed(GLFW_KEY_E)) inspector_.ownAxes = !inspector_.ownAxes;
    if (pressed(GLFW_KEY_H)) menu_.panels = !menu_.panels;
    if (pressed(GLFW_KEY_S)) session_.setSettings(withSolversSwapped(session_.settings()));
    for (const DisplaySwitch& which : displaySwitches())
        if (pressed(which.key)) turn(display_, which, !isOn(display_, which));  // GLFW's keys are capital letters
    if (pressed(GLFW_KEY_SPACE)) requests_.stopOrEngage = true;
}

void App::noteState() {
    const std::string name = session_.request().file.stem().string();
    const std::string title =
        viewed_ ? "Touchstone - " + name + (session_.newest().edits.empty() ? "" : " *") : "Touchstone";
    if (title != title_) window_.setTitle(title_ = title);
    if (!viewed_ || session_.opening()) return;
    if (undoFile_ != session_.request().file) {
        undo_.clear();
        undoFile_ = session_.request().file;
    }
    UserState now{session_.newest().edits, session_.settings()};
    now.settings.pause = false;
    undo_.note(now, !ImGui::IsAnyItemActive() && !selection_.dragging());
}

void App::goTo(const std::optional<UserState>& state) {
    if (!state) return;
    Settings settings = state->settings;
    settings.pause = session_.settings().pause;
    session_.setSettings(settings);
    if (state->edits != session_.newest().edits) session_.setEdits(state->edits);
}

void App::copyCommand() {
    if (!session_.running()) return;
    if (!session_.newest().edits.empty()) {
        session_.say(Message::Kind::Warning,
                     "The command would run the file without your changes: save the scene first");
        return;
    }
    std::string device = session_.device();
    if (device == "mouse") {
        if (!viewed_->demonstration) {
            session_.say(Message::Kind::Warning,
                         "A hand on the mouse cannot be repeated, and the scene has no demonstration: replay a motion");
            return;
        }
        device = "demo";
    }
    const std::string line =
        commandLine(std::filesystem::absolute(session_.request().file), device, viewed_->settings, session_.settings());
    ImGui::SetClipboardText(line.c_str());
    session_.say(Message::Kind::Note, "Copied: " + line);
}

void App::toggleRecording() {
    if (session_.recorder()) return session_.stopRecording();
    const std::time_t now = std::time(nullptr);
    char when[32] = "";
    std::strftime(when, sizeof when, "-%Y%m%d-%H%M%S", std::localtime(&now));
    session_.record(options_.recordings / (session_.request().file.stem().string() + when));
}

void App::carryOut() {
    const PanelRequests requests = std::exchange(requests_, {});
    if (!requests.refusal.empty()) session_.say(Message::Kind::Error, requests.refusal);
    if (requests.open) session_.open({.file = *requests.open});
    if (requests.reload) {
        if (!session_.newest().edits.empty())
            session_.say(Message::Kind::Warning, "Opened again without your changes: Ctrl+Z brings them back");
        session_.reload();
    }
    if (requests.cancelOpening) session_.cancelOpening();
    if (!requests.edits.empty()) session_.edit(requests.edits);
    if (requests.save && session_.save(*requests.save, requests.saveSettings)) {
        viewedFile_ = session_.request().file;
        recent_.add(viewedFile_);
    }
    if (requests.undo && session_.opening())
        session_.cancelOpening();
    else if (requests.undo)
        goTo(undo_.undo());
    if (requests.redo && !session_.opening()) goTo(undo_.redo());
    if (requests.view) camera_.look(*requests.view);
    if (requests.frameSelection && viewed_)
        fitPoints(camera_, selection_.corners(*viewed_, toolPoses()), picture_.size.x / picture_.size.y);
    if (requests.copyCommand) copyCommand();
    if (requests.record) toggleRecording();
    if (requests.device) session_.chooseDevice(*requests.device);
    if (requests.workspace) session_.setWorkspace(*requests.workspace);
    if (requests.alignWithView && session_.deviceControl()) {
        Workspace workspace = session_.deviceControl()->workspace();
        workspace.q_WD = toEigen(glm::dquat(glm::quat_cast(glm::transpose(glm::mat3(camera_.view())))));
        session_.setWorkspace(workspace);
    }
    if (requests.reconnect) session_.reconnectDevice();
    if (requests.restart) session_.restart();
    if (requests.stopOrEngage) session_.engaged() ? session_.stop() : session_.engage();
    if (requests.device || requests.restart) grab_.reset();
    if (requests.quit) window_.close();
}

}  // namespace

int runWindow(const WindowRunOptions& options) {
    App app(options);
    return app.run();
}

}  // namespace touchstone::system
