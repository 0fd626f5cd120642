#include "haptics/sandbox/app/live_measure.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "engine/view/image_file.hpp"

namespace touchstone::sandbox {
namespace {

/// Crops a picture to `area`, a rectangle as in ItemRects (screen units). `scale`: pixels per screen unit.
engine::Image cropped(const engine::Image& whole, const glm::vec4& area, glm::vec2 scale) {
    const auto pixel = [](float v, int most) { return std::clamp(static_cast<int>(std::lround(v)), 0, most); };
    const int left = pixel(area.x * scale.x, whole.width), right = pixel(area.z * scale.x, whole.width);
    const int top = pixel(area.y * scale.y, whole.height), bottom = pixel(area.w * scale.y, whole.height);
    engine::Image part;
    part.width = std::max(right - left, 0);
    part.height = std::max(bottom - top, 0);
    for (int y = top; y < bottom; ++y) {
        const auto row = whole.rgba.begin() + 4 * (static_cast<std::ptrdiff_t>(y) * whole.width + left);
        part.rgba.insert(part.rgba.end(), row, row + 4 * static_cast<std::ptrdiff_t>(part.width));
    }
    return part;
}

}  // namespace

void LiveMeasure::draw(LiveSession& session, engine::ItemRects* items) {
    const Settings& settings = session.settings();
    sweeps_.poll();
    if (scene_ != session.sceneNumber()) {  // earlier measurements belong to another scene
        scene_ = session.sceneNumber();
        sweeps_.forget();
        panel.held.reset();
        panel.behind = 0;
    }
    const auto solvers = [](const Settings& s) {
        return std::tuple(s.solver, s.shadow, s.frictionSolver, s.frictionShadow, s.friction, s.mode);
    };
    if (solvers(settings) != solvers(drawn_)) panel.firstCloudTick = session.history().pushed();
    drawn_ = settings;

    drawing_ = !png_.empty();
    panel.showValues = !drawing_;
    PlotsRequests requests;
    const std::optional<double> progress = sweeps_.running() ? std::optional(sweeps_.progress()) : std::nullopt;
    const auto& scene = session.scene();
    const bool friction = scene && scene->world && hasFriction(*scene->world, settings);
    drawPlotsPanel({session.history(), settings, sweeps_.result(), progress, sweeps_.refusal(), friction}, panel,
                   requests, items);
    carryOut(requests, session);
}

void LiveMeasure::sweep(LiveSession& session) {
    const TickHistory& history = panel.held ? *panel.held : session.history();
    if (!session.running() || !history.newest()) {
        session.log().say(Message::Kind::Warning, "There is no tick to sweep yet: open a scene and let it run first");
        return;
    }
    sweeps_.start(worldNow(*session.scene()), session.snapshot()->settings, *history.before(), *history.newest(),
                  panel.sweep);
}

void LiveMeasure::checkFit(LiveSession& session) {
    if (!session.scene()) return;
    try {
        fit_.start([question = fitQuestion(*session.scene()), settings = session.settings()](
                       const MeasureProgress& progress) { return sandbox::checkFit(question, settings, progress); });
    } catch (const std::runtime_error& e) {
        session.log().say(Message::Kind::Warning, e.what());
    }
}

const Background<FitCheck>& LiveMeasure::fit(const LiveSession& session) {
    if (std::exchange(fitScene_, session.sceneNumber()) != session.sceneNumber()) fit_.forget();
    fit_.poll();
    return fit_;
}

void LiveMeasure::carryOut(const PlotsRequests& requests, LiveSession& session) {
    if (requests.sweep) sweep(session);
    if (requests.cancelSweep) sweeps_.cancel();
    if (!requests.png.empty()) png_ = requests.png;
    try {
        if (const auto& file = requests.ticksCsv; !file.empty()) {
            const TickHistory& history = panel.held ? *panel.held : session.history();
            writeTicks(history, shownStretch(history, panel, session.settings().rate), file);
            session.log().say(Message::Kind::Note, "Saved the ticks shown to " + file.string());
        }
        if (const auto& file = requests.sweepCsv; !file.empty() && sweeps_.result()) {
            writeSweep(*sweeps_.result(), file);
            session.log().say(Message::Kind::Note, "Saved the sweep to " + file.string());
        }
    } catch (const std::exception& e) {
        session.log().say(Message::Kind::Error, e.what());
    }
}

void LiveMeasure::savePicture(const engine::Image& frame, glm::vec2 size, LiveSession& session) {
    const std::filesystem::path file = std::exchange(png_, {});
    drawing_ = false;
    try {
        const glm::vec2 scale = glm::vec2(frame.width, frame.height) / glm::max(size, glm::vec2(1));
        engine::writePng(file, cropped(frame, panel.area, scale));
        session.log().say(Message::Kind::Note, "Saved the plots to " + file.string());
    } catch (const std::exception& e) {
        session.log().say(Message::Kind::Error, e.what());
    }
}

}  // namespace touchstone::sandbox
