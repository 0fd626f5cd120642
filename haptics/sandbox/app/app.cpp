#include "haptics/sandbox/app/app.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <thread>
#include <utility>

#include "engine/view/image_file.hpp"
#include "haptics/device/emergency_stop.hpp"
#include "haptics/sandbox/session/device_choice.hpp"

namespace touchstone::sandbox {
namespace {

// Shortest frame times. The first limits the frame rate if the driver does not wait for the monitor. The second leaves
// the processor to the opening of a scene while nothing is shown yet.
constexpr auto kShortestFrame = std::chrono::milliseconds(8), kOpeningFrame = std::chrono::milliseconds(60);

}  // namespace

App::App(const WindowRunOptions& options)
    : options_(options),
      window_(options.window),
      session_([&] {
          SessionOptions session = options.session;
          session.configFolder = options.configFolder;
          return session;
      }()),
      recent_(options.configFolder),
      display_(options.display),
      openDialog_(options.configFolder, options.session.treeCache) {
    if (std::error_code error; !options.configFolder.empty()) {
        std::filesystem::create_directories(options.configFolder, error);
        iniFile_ = options.configFolder / "window.ini";
        ImGui::GetIO().IniFilename = iniFile_.c_str();
        sizes_.remember();
    }
    scenes_ = engine::findScenes(options.sceneFolders);
    window_.onDrop([this](const std::vector<std::filesystem::path>& files) {
        requests_.open = files.front();
        if (files.size() > 1)
            session_.log().say(Message::Kind::Warning,
                               "Only the first of the dropped files was opened: " + files.front().filename().string());
    });
    window_.onClose([this] { requests_.quit = true; });
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
        std::filesystem::path shot;
        if (options_.onFrame) {
            const ImVec2 low = picture_.position, size = picture_.size;
            WindowFrame frame{
                window_,     session_,      display_, measure_,
                drawnItems_, toolOnScreen_, camera_,  glm::vec4(low.x, low.y, low.x + size.x, low.y + size.y),
                selection_,  number,        cost_,    {}};
            options_.onFrame(frame);
            shot = frame.screenshot;
        }
        last = timeIsUp();
        if (!beginFrame(last)) break;
        rememberSize(number == 0);
        session_.update();
        refreshScene();

        const float top = ImGui::GetFrameHeight();  // of the menu bar
        const glm::vec2 aboveBar = glm::vec2(window_.size()) - glm::vec2(0, statusBarHeight());
        const engine::Layout layout(aboveBar, top, ImGui::GetFontSize(), sizes_, menu_.panels);
        picture_ = layout.picture;
        items_.clear();
        if (viewedNumber_ != session_.sceneNumber()) {
            viewedNumber_ = session_.sceneNumber();
            if (viewedFile_ != session_.request().file) frameAll(layout.picture);  // an edited scene keeps the view
            viewedFile_ = session_.request().file;
        }
        // The user may not be watching any more, so motors must not push.
        const bool focused = glfwGetWindowAttrib(window_.handle(), GLFW_FOCUSED);
        if (focused_ && !focused && session_.device().facts.limits.motors) session_.stop();
        focused_ = focused;
        handleKeys();
        handleMouse(layout.picture);
        if (last && !options_.screenshot.empty()) shot = options_.screenshot;
        const bool wanted = !shot.empty();
        drawPicture(layout.picture, wanted || measure_.wantsPicture());
        drawPanels(layout);
        if (requests_.frameCamera) frameAll(layout.picture);
        carryOut();
        noteState();
        noteStuck();

        engine::Image picture;
        ImGui::EndFrame();
        draw([&] { window_.endFrame(wanted || measure_.wantsPicture() ? &picture : nullptr); });
        if (measure_.wantsPicture()) measure_.savePicture(picture, window_.size(), session_);
        std::swap(items_, drawnItems_);
        noteCost(1e-3 * (threadCpuMicroseconds() - cpuBegan));
        if (wanted) engine::writePng(shot, picture);
    }
    if (options_.onEnd) options_.onEnd(session_);
    return options_.scene.empty() || session_.scene() ? 0 : 1;
}

void App::noteStuck() {
    if (!session_.running() || !viewed_ || !viewed_->roles.goal) return;
    const TickRecord& record = session_.snapshot()->record;
    // A motion may rest against a part on its way.
    if (traitsOf(session_.device().choice).followsMotion && !session_.snapshot()->finished) return;
    if (!stuck_.add(*viewed_->roles.goal, record, 1e-6 * double(steadyNanoseconds()))) return;
    const std::string sentence = stuckSentence(*viewed_, record, session_.settings(), false);
    if (sentence.empty()) return;
    const FitCheck* fit = measure_.fit(session_).result();
    session_.log().say(Message::Kind::Warning, "The tool is " + sentence +
                                                   (!fit          ? "; \"Check fit\" says whether it fits"
                                                    : fit->fits() ? ""
                                                                  : ": " + fit->cause));
}

void App::noteCost(double cpuMs) {
    const Clock::time_point ended = Clock::now(), before = std::exchange(frameEnded_, ended);
    const double periodMs =
        before == Clock::time_point() ? 0 : std::chrono::duration<double, std::milli>(ended - before).count();
    cost_ = {.cpuMs = cpuMs,
             .drawingMs = std::exchange(drawingMs_, 0),
             .drawCalls = (view_ ? renderer_.cost().calls : 0) + window_.interfaceDrawCalls(),
             .periodMs = periodMs,
             .software = window_.drawsInSoftware()};
    constexpr double kShare = 0.1;  // weight of the newest frame: smooths the display enough to be read
    const auto smooth = [](double shown, double now) { return shown + kShare * (now - shown); };
    shownCost_ = {.cpuMs = smooth(shownCost_.cpuMs, cost_.cpuMs),
                  .drawingMs = smooth(shownCost_.drawingMs, cost_.drawingMs),
                  .drawCalls = cost_.drawCalls,
                  .periodMs = smooth(shownCost_.periodMs, cost_.periodMs),
                  .software = cost_.software};
}

/// Returns false once the window is closed. A requested screenshot keeps it open for one more frame, with `last` set.
bool App::beginFrame(bool& last) {
    if (window_.beginFrame()) return true;
    if (last || options_.screenshot.empty()) return false;
    last = true;
    glfwSetWindowShouldClose(window_.handle(), GLFW_FALSE);
    return window_.beginFrame();
}

/// Restores the window size of the last run in the first frame and keeps track of it afterwards.
void App::rememberSize(bool first) {
    if (first && sizes_.window.x > 0) return window_.setSize(sizes_.window);
    sizes_.keepWindow(window_.size());
}

bool App::timeIsUp() {
    if (StopRequest::signal() != 0) return true;
    if (!options_.seconds) return false;
    const bool stuck = !options_.scene.empty() && !session_.scene() && !session_.opening();
    if (session_.running() && !runningSince_) runningSince_ = Clock::now();
    return stuck || (runningSince_ && Clock::now() - *runningSince_ > std::chrono::duration<double>(*options_.seconds));
}

void App::refreshScene() {
    if (viewed_ == session_.scene()) return;
    view_.reset();
    const bool first = !viewed_;
    if (viewed_ && viewedFile_ == session_.request().file)
        selection_.moveTo(viewed_->scene, session_.scene()->scene);
    else
        selection_.select({});
    viewed_ = session_.scene();
    if (first && options_.select && session_.request().file == options_.scene &&
        *options_.select < viewed_->scene.nodes.size())
        selection_.select(viewed_->scene.nodes[*options_.select]);
    view_ = std::make_unique<SceneView>(renderer_, *viewed_);
    grab_.reset();
    recent_.add(session_.request().file);
}

void App::frameAll(const engine::Area& picture) {
    if (!view_) return;
    const TickRecord* record = session_.record();
    const Pose* X_WT = record ? &record->X_WT : viewed_->world ? &viewed_->world->X_WT_start : nullptr;
    // By the panel of a study, or by the guide.
    const float left = options_.study ? 16 * ImGui::GetFontSize() : guideWidth();
    const float covered = std::min(left, 0.5f * picture.size.x);
    const float aspect = (picture.size.x - covered) / picture.size.y;
    if (requests_.frameCamera)  // keep the direction of view
        view_->fit(camera_, X_WT, aspect);
    else
        camera_ = view_->look(options_.view, record, session_.settings(), aspect);
    // Show all of a demonstration, unless the options name a view.
    if (!requests_.frameCamera && options_.view.empty() && viewed_->demonstration &&
        followsDemonstration(session_.device().choice))
        view_->fit(camera_, *viewed_->demonstration, aspect);
    camera_.pan({0.5f * covered, 0}, picture.size.y);
}

/// Draws the scene if its picture has changed. Without a graphics card that is coarse while it changes, unless it is to
/// be drawn fully, for a picture that is kept.
void App::drawPicture(const engine::Area& area, bool fully) {
    constexpr auto kSettled = std::chrono::milliseconds(400);  // without a change: then the user looks at it
    engine::Frame frame;
    frame.camera = camera_;
    const glm::vec2 pixels(window_.framebufferSize()), units(window_.size());
    frame.pixelScale = units.x > 0 ? window_.scale() * pixels.x / units.x : 1;
    frame.hiddenOpacity = kHiddenOpacity;
    if (view_)
        view_->fill(frame, session_.record(), session_.settings(), display_);
    else
        frame.grid.visible = false;

    if (units.x <= 0 || units.y <= 0) return;
    const glm::vec2 scale = pixels / units;
    const auto whole = [](float v) { return static_cast<int>(std::lround(v)); };
    const engine::Viewport viewport{.x = whole(scale.x * area.position.x),
                                    .y = whole(scale.y * (units.y - area.position.y - area.size.y)),
                                    .width = whole(scale.x * area.size.x),
                                    .height = whole(scale.y * area.size.y)};
    const Clock::time_point now = Clock::now();
    const engine::Detail before = drawn_ ? std::exchange(drawn_->frame.detail, frame.detail) : engine::Detail::Full;
    const bool same = drawn_ && drawn_->viewport == viewport && drawn_->frame == frame;
    if (!same) changed_ = now;
    if (window_.drawsInSoftware() && !fully)
        frame.detail = now - changed_ < kSettled ? engine::Detail::Draft : engine::Detail::Plain;
    draw([&] { same&& frame.detail == before ? renderer_.showAgain(viewport) : renderer_.draw(frame, viewport); });
    drawn_ = {std::move(frame), viewport};
}

}  // namespace touchstone::sandbox
