#include "haptics/sandbox/panels/panel_plots.hpp"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <utility>

#include "engine/scene/text.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/sandbox/measure/pareto.hpp"
#include "haptics/sandbox/panels/panels.hpp"

namespace touchstone::sandbox {
namespace {

constexpr glm::vec4 kBlue{0.40f, 0.68f, 1.00f, 1}, kOrange{1.00f, 0.62f, 0.25f, 1}, kViolet{0.74f, 0.58f, 1.00f, 1},
    kGreen{0.45f, 0.85f, 0.52f, 1}, kRed{1.00f, 0.42f, 0.36f, 1}, kGray{0.62f, 0.64f, 0.67f, 1},
    kYellow{1.00f, 0.90f, 0.45f, 1}, kWhite{1};
constexpr double kShortest = 0.01;  // s: shortest time span across the width
constexpr double kReadable = 0.25;  // s between updates of the numbers, so that one can read them

/// Draws the panel in one frame.
class Panel {
  public:
    Panel(const PlotsView& view, PlotsPanelState& state, PlotsRequests& requests, engine::ItemRects* items)
        : view_(view), state_(state), requests_(requests), items_(items), history_(&shown()) {}

    void draw() {
        drawControls();
        history_ = &shown();
        stretch_ = shownStretch(*history_, state_, view_.settings.rate);
        ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {ImGui::GetStyle().ItemSpacing.x, 2});
        ImGui::BeginGroup();
        if (std::exchange(state_.width, ImGui::GetWindowWidth()) != ImGui::GetWindowWidth()) state_.textHeight = {};
        const bool open = narrow([] { return ImGui::BeginTabBar("plots"); });
        if (open) {
            tab(PlotsTab::Time, "Time", &Panel::drawTime);
            tab(PlotsTab::Contact, "Contact", &Panel::drawContact);
            tab(PlotsTab::Friction, "Friction", &Panel::drawFriction);
            tab(PlotsTab::Trade, "Speed vs. error", &Panel::drawTrade);
            ImGui::EndTabBar();
        }
        ImGui::EndGroup();
        const ImVec2 low = ImGui::GetItemRectMin(), high = ImGui::GetItemRectMax();
        state_.area = {low.x, low.y, high.x, high.y};
        ImGui::PopStyleVar();
        state_.bring.reset();
        state_.cursor = mouse_.cursor;
        follow();
    }

  private:
    const TickHistory& shown() const { return state_.held ? *state_.held : view_.history; }
    double rate() const { return view_.settings.rate; }

    void hold(bool on) {
        state_.held = on ? std::make_shared<const TickHistory>(view_.history) : nullptr;
        state_.behind = 0;
    }

    /// Draws with less space beside labels, so that all of them fit.
    static bool narrow(const std::function<bool()>& draw) {
        const ImVec2 padding = ImGui::GetStyle().FramePadding;
        ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {0.6f * padding.x, padding.y});
        const bool result = draw();
        ImGui::PopStyleVar();
        return result;
    }

    void drawControls() {
        constexpr std::array kWindows{0.25, 1.0, 4.0, 16.0};
        for (const double seconds : kWindows) {
            const std::string label = engine::formatted("%g s", seconds);
            if (seconds != kWindows.front()) ImGui::SameLine(0, 2);
            const bool chosen = state_.seconds == seconds;
            if (!chosen) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_FrameBg));
            if (narrow([&] { return ImGui::Button(label.c_str()); })) state_.seconds = seconds;
            if (!chosen) ImGui::PopStyleColor();
            engine::noteItem(items_, label);
            engine::tooltip("Time span of the plots. The wheel over a plot zooms; a drag scrolls back in time.");
        }
        ImGui::SameLine();
        if (ImGui::Button(state_.held ? "Resume" : "Hold")) hold(!state_.held);
        engine::noteItem(items_, "hold plots");
        engine::tooltip("Holds the plots while the loop runs on. Zoom with the wheel, drag to scroll back in time.");
        ImGui::SameLine();
        if (ImGui::Button("Export")) ImGui::OpenPopup("export");
        engine::noteItem(items_, "export");
        engine::tooltip("Saves the ticks shown as a table or the plots as a picture.");
        if (ImGui::BeginPopup("export")) {
            drawExport();
            ImGui::EndPopup();
        }
    }

    void drawExport() {
        ImGui::TextUnformatted("File name without extension");
        ImGui::SetNextItemWidth(20 * ImGui::GetFontSize());
        ImGui::InputText("##name", state_.exportName.data(), state_.exportName.size());
        engine::noteItem(items_, "export name");
        const std::string name = state_.exportName.data();
        const auto button = [&](const char* label, const char* ending, bool possible, std::filesystem::path& file) {
            ImGui::BeginDisabled(!possible || name.empty());
            if (ImGui::Button(label)) {
                file = name + ending;
                ImGui::CloseCurrentPopup();
            }
            ImGui::EndDisabled();
            engine::noteItem(items_, label);
            ImGui::SameLine();
        };
        button("Ticks, CSV", ".csv", history_->size() > 0, requests_.ticksCsv);
        button("Plots, PNG", ".png", true, requests_.png);
        button("Sweep, CSV", "-sweep.csv", view_.sweep != nullptr, requests_.sweepCsv);
        ImGui::NewLine();
    }

    void tab(PlotsTab which, const char* label, void (Panel::*body)()) {
        const bool bring = state_.bring == which;
        const bool open =
            narrow([&] { return ImGui::BeginTabItem(label, nullptr, bring ? ImGuiTabItemFlags_SetSelected : 0); });
        engine::noteItem(items_, std::string("tab ") + label);
        if (!open) return;
        tab_ = which;
        (this->*body)();
        const float between = ImGui::GetCursorPosY() - plotsTop_ - plotsHeight_;
        textHeight() = std::max(textHeight(), between);
        ImGui::EndTabItem();
    }

    float& textHeight() { return state_.textHeight[static_cast<std::size_t>(tab_)]; }

    /// Height of each of `plots` plots that share the space left by the text between them, measured in earlier frames.
    float heightOf(int plots) {
        const float least = 2.2f * ImGui::GetTextLineHeightWithSpacing(), count = static_cast<float>(plots);
        const float height = std::max((ImGui::GetContentRegionAvail().y - textHeight()) / count, least);
        plotsTop_ = ImGui::GetCursorPosY();
        plotsHeight_ = count * height;
        return height;
    }

    engine::RingView of(Channel channel) const { return history_->view(channel); }

    void plot(const char* title, const char* unit, float height, std::initializer_list<engine::Series> series,
              bool logarithmic = false, std::optional<float> budget = {}) {
        engine::PlotOptions options;
        options.unit = unit;
        options.logarithmic = logarithmic;
        options.budget = budget;
        options.height = height;
        options.stretch = stretch_;
        options.samplePeriodMs = static_cast<float>(1000 / rate());
        if (budget) options.marks = of(Channel::Late);
        options.cursor = state_.cursor;
        options.showValues = state_.showValues;
        const engine::PlotMouse mouse = engine::drawSeries(title, {series.begin(), series.size()}, options);
        engine::noteItem(items_, std::string("plot ") + title);
        if (mouse.cursor || mouse.dragging) mouse_ = mouse;
    }

    void drawTime() {
        StretchTimes& times = state_.times;
        if (ImGui::GetTime() - state_.timesAt > kReadable || state_.timesAt < 0) {
            times = stretchTimes(*history_, stretch_);
            state_.timesAt = ImGui::GetTime();
        }
        ImGui::Text("%zu ticks,", times.ticks);
        ImGui::SameLine(0, 0.3f * ImGui::GetFontSize());
        ImGui::TextColored(times.late ? kAttentionColor : ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled), "%zu late",
                           times.late);
        engine::tooltip("Ticks that ended after their deadline, shown as red marks at the top of the plot.");
        engine::noteItem(items_, "late");
        if (times.ticks > 0)
            ImGui::Text("p50 %.1f, p99 %.1f, max %.1f µs", double(times.p50), double(times.p99), double(times.most));
        else
            ImGui::TextDisabled("no times yet");
        engine::noteItem(items_, "tick times");
        engine::tooltip("CPU time of the ticks shown, including the shadow solver. The list worker is not included.");

        const float height = heightOf(4);
        plot("Tick time", "µs", height, {{"total", of(Channel::TotalUs), kBlue}}, true,
             static_cast<float>(1e6 / rate()));
        plot("Stage times", "µs", height,
             {{"collision", of(Channel::CollisionUs), kGreen},
              {"solve", of(Channel::SolveUs), kOrange},
              {"shadow", of(Channel::ShadowUs), kViolet}},
             true);
        const float other = std::max(times.total - times.collision - times.solve - times.shadow, 0.f);
        const std::array<engine::Share, 4> shares{{{"collision", times.collision, kGreen},
                                                   {"solve", times.solve, kOrange},
                                                   {"shadow", times.shadow, kViolet},
                                                   {"other", other, kGray}}};
        engine::drawShares("Mean stage times", shares, "µs");
        const std::array<std::pair<const char*, float>, 3> levels{
            {{"p50", times.p50}, {"p99", times.p99}, {"max", times.most}}};
        engine::drawHistogram("Tick-time histogram", of(Channel::TotalUs), stretch_, kBlue,
                              {.unit = "µs",
                               .low = 0.1f,
                               .high = 10000,
                               .bins = 100,
                               .height = height,
                               .levels = levels,
                               .showValues = state_.showValues});
        engine::noteItem(items_, "plot Tick-time histogram");
        plot("Tick period", "µs", height, {{"period", of(Channel::PeriodUs), kBlue}});
    }

    void drawContact() {
        const float height = heightOf(6);
        plot("Force", "N", height, {{"tick", of(Channel::Force), kBlue}, {"output", of(Channel::ForceOut), kOrange}});
        plot("Torque about C", "mN·m", height, {{"tick", of(Channel::Torque), kBlue}});
        plot("Near pairs and rows", "", height,
             {{"pairs", of(Channel::Pairs), kBlue}, {"rows", of(Channel::Rows), kOrange}});
        plot("Iterations", "", height,
             {{"solver", of(Channel::Iterations), kOrange}, {"shadow", of(Channel::ShadowIterations), kViolet}});
        plot("Solver residuals", "", height,
             {{"violation, mm", of(Channel::ResidualGap), kRed},
              {"stationarity, N", of(Channel::ResidualForce), kOrange}},
             true);
        plot("Distances", "mm", height,
             {{"tool to device", of(Channel::Separation), kBlue},
              {"hover gap", of(Channel::Hover), kGreen},
              {"penetration", of(Channel::Penetration), kRed}},
             true);
    }

    void drawFriction() {
        const float height = heightOf(4);
        plot("Contacts with friction", "", height,
             {{"stick", of(Channel::Sticking), kGreen}, {"slide", of(Channel::Sliding), kViolet}});
        plot("Friction force", "N", height, {{"sum", of(Channel::FrictionForce), kBlue}});
        plot("Slip", "mm", height, {{"greatest", of(Channel::Slip), kOrange}}, true);
        plot("Distance from Coulomb's law", "", height,
             {{"cone, N", of(Channel::ConeViolation), kRed},
              {"complementarity, mJ", of(Channel::Complementarity), kOrange}},
             true);
    }

    /// An exact shadow is the reference for the rendering solver, so the rendering solver's time is plotted then.
    bool shadowIsExact() const {
        const Settings& settings = view_.settings;
        if (settings.shadow == kNoSolver) return false;
        return view_.friction ? findFrictionSolver(settings.frictionShadow)->exact : findSolver(settings.shadow)->exact;
    }

    engine::Layer cloud() const {
        const Settings& settings = view_.settings;
        engine::Layer layer{.name = {}, .points = {}, .color = kViolet};
        if (settings.shadow == kNoSolver) return layer;
        const char* shadow = view_.friction ? "friction_shadow" : "shadow";
        const char* solver = view_.friction ? "friction_solver" : "solver";
        layer.name = "ticks: " + getSetting(settings, shadowIsExact() ? solver : shadow);
        // Leave out ticks of other solvers.
        const std::uint64_t since = history_->pushed() - std::min(state_.firstCloudTick, history_->pushed());
        engine::Stretch stretch = stretch_;
        stretch.window = std::min<std::uint64_t>(stretch.window, since - std::min<std::uint64_t>(since, stretch.skip));
        const auto times = engine::samplesIn(of(shadowIsExact() ? Channel::SolveUs : Channel::ShadowUs), stretch);
        const auto errors = engine::samplesIn(of(Channel::ShadowForceError), stretch);
        const auto shadows = engine::samplesIn(of(Channel::ShadowUs), stretch);
        for (std::size_t piece = 0; piece < times.size(); ++piece)
            for (std::size_t i = 0; i < times[piece].size(); ++i)
                if (shadows[piece][i] > 0) layer.points.emplace_back(times[piece][i], errors[piece][i]);
        return layer;
    }

    std::string note(const SweepPoint& p) const {
        std::string words(p.solver);
        if (p.tolerance > 0)
            words += engine::formatted(" at %.3g %s", p.tolerance, view_.sweep->mode == Mode::Paper ? "N·mm" : "N");
        words += engine::formatted("\n%.3g µs, %.3g N, %.3g mN·m, %d iterations", p.us, p.forceError, p.torqueError,
                                   p.iterations);
        if (p.status != SolveStatus::Solved) words += std::string("\n") + name(p.status);
        if (p.onFront) words += "\non the Pareto front: no point is both faster and more accurate";
        return words;
    }

    std::vector<engine::Layer> sweepLayers() const {
        std::vector<engine::Layer> layers;
        if (!view_.sweep) return layers;
        const auto place = [](const SweepPoint& p) {
            return glm::vec2(static_cast<float>(p.us), static_cast<float>(p.forceError));
        };
        engine::Layer front{.name = "Pareto front", .points = {}, .color = kYellow};
        front.style = engine::Layer::Style::Steps;
        std::vector<const SweepPoint*> best;
        for (const SweepPoint& p : view_.sweep->points)
            if (p.onFront) best.push_back(&p);
        std::sort(best.begin(), best.end(), [](auto* a, auto* b) { return a->us < b->us; });
        for (const SweepPoint* p : best) front.points.push_back(place(*p));
        layers.push_back(front);

        constexpr std::array kColors{kGreen, kOrange, kBlue, kRed, kWhite, kGray};
        const bool friction = view_.sweep->friction;
        const std::size_t solvers = friction ? frictionSolverTable().size() : solverTable().size();
        std::vector<engine::Layer> markers;
        for (std::size_t solver = 0; solver < solvers; ++solver) {
            const std::string_view name = friction ? frictionSolverTable()[solver].name : solverTable()[solver].name;
            engine::Layer curve{.name = std::string(name), .points = {}, .color = kColors[solver % kColors.size()]};
            curve.style = engine::Layer::Style::Line;
            for (const SweepPoint& p : view_.sweep->points) {
                if (p.solver != name || p.status == SolveStatus::Invalid) continue;
                curve.points.push_back(place(p));
                curve.notes.push_back(note(p));
            }
            if (curve.points.empty()) continue;
            layers.push_back(curve);
            if (friction || solverTable()[solver].exact) continue;
            engine::Layer& marker = markers.emplace_back(engine::Layer{.name = {}, .points = {}, .color = kWhite});
            marker.style = engine::Layer::Style::Marker;
            if (const auto at = pointAt(*view_.sweep, name, view_.settings.tolerance)) {
                marker.name = engine::formatted("%s at its tolerance: %.3g µs, %.2g N", curve.name.c_str(), at->us,
                                                at->forceError);
                marker.points.push_back(place(*at));
                marker.notes.push_back("at the current tolerance\n" + note(*at));
            }
        }
        layers.insert(layers.end(), markers.begin(), markers.end());
        return layers;
    }

    void drawTrade() {
        drawSweepControls();
        std::vector<engine::Layer> layers = sweepLayers();
        layers.insert(layers.begin(), cloud());
        const float height = heightOf(5);
        ImGui::BeginGroup();
        engine::drawChart("Solver time vs. force error", layers,
                          {.xName = "solver time",
                           .xUnit = "µs",
                           .yName = "force error vs. exact",
                           .yUnit = "N",
                           .xFloor = 1e-2f,
                           .yFloor = static_cast<float>(kLeastError),
                           .height = 3 * height,
                           .showValues = state_.showValues});
        ImGui::EndGroup();
        engine::noteItem(items_, "plot speed against error");
        plot("Shadow force error", "N", height, {{"error", of(Channel::ShadowForceError), kViolet}}, true);
        plot("Shadow solve time", "µs", height, {{"shadow", of(Channel::ShadowUs), kViolet}}, true);
    }

    void drawSweepControls() {
        if (view_.sweepProgress) {
            if (ImGui::Button("Cancel")) requests_.cancelSweep = true;
            engine::noteItem(items_, "cancel sweep");
            ImGui::SameLine();
            ImGui::ProgressBar(static_cast<float>(*view_.sweepProgress), {-1, 0}, "sweeping");
        } else {
            if (ImGui::Button("Sweep contact")) requests_.sweep = true;
            engine::noteItem(items_, "sweep");
            engine::tooltip(
                "Runs every solver at all its tolerances on the rows of the newest tick, in parallel to the loop. "
                "Where there is friction, runs every friction solver on its contacts. Times are medians of repeated "
                "solves.");
            ImGui::Checkbox("all rows", &state_.sweep.allRows);
            engine::noteItem(items_, "all rows");
            engine::tooltip(
                "Uses the rows of all pairs of leaves within the margin instead of the few that the tick's adaptive "
                "margin needed. Between meshes there are no other rows.");
            ImGui::SameLine();
            ImGui::Checkbox("warm start", &state_.sweep.warm);
            engine::noteItem(items_, "warm");
            engine::tooltip(
                "Solvers start from their solution of the previous tick, as in the loop. Without it they start cold. "
                "In paper mode they always start cold.");
        }
        std::string words = view_.refusal;
        if (words.empty() && view_.sweep)
            words = engine::formatted("Sweep of tick %llu, %d %s", static_cast<unsigned long long>(view_.sweep->tick),
                                      view_.sweep->rows, view_.sweep->friction ? "contacts with friction" : "rows");
        else if (words.empty())
            words = engine::formatted("Each point is a tick. A sweep adds one %s per solver.",
                                      view_.friction ? "point" : "curve");
        ImGui::PushStyleColor(
            ImGuiCol_Text, view_.refusal.empty() ? ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled) : kAttentionColor);
        ImGui::TextWrapped("%s", words.c_str());
        ImGui::PopStyleColor();
    }

    /// Applies zoom and drag of the mouse over the plots.
    void follow() {
        const double kept = static_cast<double>(history_->size()) / rate();
        if (mouse_.dragging && mouse_.drag != 0 && !state_.held) hold(true);
        if (mouse_.zoom != 1) {
            const double longest = static_cast<double>(TickHistory::kCapacity) / rate();
            const double seconds =
                std::clamp(state_.seconds * static_cast<double>(mouse_.zoom), kShortest, std::max(longest, kShortest));
            // Held plots zoom about the time under the mouse; live plots keep the newest tick at the edge.
            if (state_.held)
                state_.behind += (1 - static_cast<double>(mouse_.cursor.value_or(1))) * (state_.seconds - seconds);
            state_.seconds = seconds;
        }
        if (state_.held) state_.behind += static_cast<double>(mouse_.drag) * state_.seconds;
        state_.behind = std::clamp(state_.behind, 0.0, std::max(kept - state_.seconds, 0.0));
    }

    const PlotsView& view_;
    PlotsPanelState& state_;
    PlotsRequests& requests_;
    engine::ItemRects* items_;
    const TickHistory* history_;
    engine::Stretch stretch_;
    engine::PlotMouse mouse_;
    PlotsTab tab_ = PlotsTab::Time;  // tab being drawn
    float plotsTop_ = 0, plotsHeight_ = 0;
};

}  // namespace

engine::Stretch shownStretch(const TickHistory& history, const PlotsPanelState& state, double rate) {
    const auto ticks = [&](double seconds) {
        return static_cast<std::size_t>(std::clamp(seconds * rate, 0.0, double(TickHistory::kCapacity)));
    };
    return {.window = std::max<std::size_t>(ticks(state.seconds), 1),
            .skip = std::min(ticks(state.behind), history.size())};
}

void drawPlotsPanel(const PlotsView& view, PlotsPanelState& state, PlotsRequests& requests, engine::ItemRects* items) {
    Panel(view, state, requests, items).draw();
}

}  // namespace touchstone::sandbox
