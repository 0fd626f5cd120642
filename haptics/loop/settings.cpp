#include "haptics/loop/settings.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>
#include <system_error>
#include <variant>
#include <vector>

#include "haptics/loop/setting_table.hpp"
#include "haptics/math/nearest_name.hpp"
#include "haptics/math/numbers.hpp"
#include "haptics/qp/friction_table.hpp"

namespace touchstone {
namespace {

struct SolverName {
    std::string_view Settings::*name;
    bool mayBeNone;
    bool friction = false;  ///< of frictionSolverTable()
};

using Field = std::variant<double Settings::*, int Settings::*, std::int64_t Settings::*, bool Settings::*,
                           Mode Settings::*, Geometry Settings::*, Screening Settings::*, SolverName>;

struct Row {
    SettingInfo info;
    Field field;
};

// The row limits are those of the tick's memory (step_state.hpp). The work limit is more than any tick has time for.
constexpr double kMaxPaperRows = 1024, kMaxShadowRows = 4096, kMaxWork = 1e12;

constexpr Row kRows[] = {
    {{"mode", "",
      "default: the method that a hand should feel; paper: the paper's method as written, with its failures; penalty: "
      "the tool sinks in and is pushed back, without a solver; god-object: the tool stops wherever a new pair touches",
      0, 0, SettingGroup::Mode, "Mode"},
     &Settings::mode},
    {{"geometry", "",
      "by what parts touch in default mode: mesh: their triangles, if both are closed; spheres: their sphere trees, as "
      "in the paper",
      0, 0, SettingGroup::Mode, "Geometry"},
     &Settings::geometry},
    {{"solver", "", "solver that moves the tool; the answer of an approximate one is projected onto the constraints", 0,
      0, SettingGroup::Solvers, "Solver"},
     SolverName{&Settings::solver, false}},
    {{"shadow", "",
      "second solver, run on the same rows to measure its time and error without changing the result; none saves its "
      "time",
      0, 0, SettingGroup::Solvers, "Shadow"},
     SolverName{&Settings::shadow, true}},
    {{"stiffness", "N/mm", "force per mm between hand and tool; a value too high for device and rate vibrates", 0.001,
      100, SettingGroup::Coupling, "Stiffness", 0.05, 5},
     &Settings::stiffness},
    {{"torsion", "mN·m/rad", "torque per rad between hand and tool; a value too high for device and rate vibrates", 1,
      1e6, SettingGroup::Coupling, "Torsion", 50, 5000},
     &Settings::torsion},
    {{"tolerance", "N",
      "error at which an approximate solver stops (N·mm in paper mode); a larger value is faster and less accurate",
      1e-9, 100, SettingGroup::Approximate, "Tolerance", 1e-6, 1},
     &Settings::tolerance},
    {{"iteration_cap", "",
      "maximum iterations of an approximate solver in default mode; with too few the tool lags behind", 1, 1e6,
      SettingGroup::Approximate, "Iteration cap", 10, 100'000},
     &Settings::iterationCap},
    {{"screening", "",
      "rows removed before an approximate solver in default mode: none; screen: redundant rows, exact within trust; "
      "cluster: similar rows, faster and less accurate",
      0, 0, SettingGroup::Approximate, "Screening"},
     &Settings::screening},
    {{"contact_distance", "mm",
      "distance that is kept between meshes; a larger value is felt sooner, a smaller one leaves less room for "
      "rounding",
      1e-4, 0.1, SettingGroup::More, "Contact distance", 0.0005, 0.02},
     &Settings::contactDistance},
    {{"margin", "mm",
      "pairs of leaves within this distance become rows; a larger value costs time, a smaller one slows the tool near "
      "contact; between meshes it has no effect",
      0.01, 20, SettingGroup::Contact, "Margin", 0.02, 2},
     &Settings::margin},
    {{"trust", "mm",
      "maximum travel of the tool in a linearization; must not exceed the margin, or pairs are missed; between meshes "
      "0.25 mm, whatever this is",
      0.01, 20, SettingGroup::Contact, "Trust radius", 0.02, 2},
     &Settings::trust},
    {{"slack", "mm",
      "travel after which the list of near pairs is rebuilt; a larger value makes fewer but longer lists", 0, 20,
      SettingGroup::More, "List slack", 0.02, 4},
     &Settings::slack},
    {{"travel_budget", "mm/ms",
      "travel of the tool beyond the device's own while in contact; a larger value lets the force drop faster", 0, 1000,
      SettingGroup::Contact, "Travel budget", 0, 5},
     &Settings::travelBudget},
    {{"linearizations", "",
      "maximum linearizations in a tick while in contact; more of them follow a fast hand better, and each costs time; "
      "0: 64 between meshes, 2 between spheres",
      0, kMostLinearizations, SettingGroup::Contact, "Linearizations", 0, 16},
     &Settings::linearizations},
    {{"friction", "",
      "on: parts whose materials have friction stick and slip, in default mode; off: every part is frictionless", 0, 0,
      SettingGroup::Friction, "Friction"},
     &Settings::friction},
    {{"friction_coefficient", "",
      "coefficient of friction of every pair of parts, at rest and sliding, instead of that of their materials; with a "
      "larger value parts stick and jam sooner; 0: the materials' own",
      0, 1000, SettingGroup::Friction, "Coefficient of friction", 0, 1},
     &Settings::frictionCoefficient},
    {{"friction_scale", "", "factor on all coefficients of friction; with a larger value parts stick and jam sooner", 0,
      100, SettingGroup::Friction, "Friction scale", 0, 3},
     &Settings::frictionScale},
    {{"friction_solver", "",
      "solver that moves the tool where there is friction; the others are baselines, whose answers are projected onto "
      "the constraints",
      0, 0, SettingGroup::Friction, "Friction solver"},
     SolverName{&Settings::frictionSolver, false, true}},
    {{"friction_shadow", "",
      "second solver where there is friction, run on the same contacts to measure its time and error; it does not run "
      "if the setting shadow is none",
      0, 0, SettingGroup::Friction, "Friction shadow"},
     SolverName{&Settings::frictionShadow, false, true}},
    {{"adaptive_margin", "",
      "on: solve only with the rows that the step would cross; off: with the rows of all pairs within the margin, "
      "which "
      "is slower",
      0, 0, SettingGroup::More, "Adaptive margin"},
     &Settings::adaptiveMargin},
    {{"elastic_weight", "", "weight of the violation when contacts contradict each other; a larger value violates less",
      1, 1e9, SettingGroup::More, "Elastic weight", 1, 1e6},
     &Settings::elasticWeight},
    {{"paper_rows", "", "maximum number of pairs in paper mode; the deepest are kept", 1, kMaxPaperRows,
      SettingGroup::More, "Paper rows", 1, kMaxPaperRows},
     &Settings::paperRows},
    {{"paper_work", "", "maximum rows² x iterations of the solver in a tick of paper mode", 1, kMaxWork,
      SettingGroup::More, "Paper work", 1e5, 1e10},
     &Settings::paperWork},
    {{"solver_work", "", "maximum rows x iterations of an approximate solver in a tick", 1, kMaxWork,
      SettingGroup::More, "Solver work", 1e4, 1e9},
     &Settings::solverWork},
    {{"shadow_work", "", "maximum rows x iterations of the shadow in a tick", 1, kMaxWork, SettingGroup::More,
      "Shadow work", 1e4, 1e8},
     &Settings::shadowWork},
    {{"shadow_rows", "", "maximum number of rows of the shadow; the deepest are kept", 1, kMaxShadowRows,
      SettingGroup::More, "Shadow rows", 1, 1000},
     &Settings::shadowRows},
    {{"penalty_stiffness", "N/mm",
      "stiffness of each overlapping pair in penalty mode; with a smaller value the tool sinks in deeper", 0.001, 1e6,
      SettingGroup::More, "Penalty stiffness", 0.1, 1000},
     &Settings::penaltyStiffness},
    {{"rate", "Hz",
      "ticks per second; a higher rate allows a higher stiffness without vibration and leaves less time for a tick",
      250, 10000, SettingGroup::Contact, "Tick rate", 250, 10'000},
     &Settings::rate},
    {{"pause", "", "hold the tool with zero force", 0, 0}, &Settings::pause},
    {{"dead_man", "", "button of the device, from 1, that must be held for any force; 0: no button", 0, 32,
      SettingGroup::More, "Dead-man button", 0, 8},
     &Settings::deadMan},
};

constexpr auto kInfos = [] {
    std::array<SettingInfo, std::size(kRows)> infos;
    std::transform(std::begin(kRows), std::end(kRows), infos.begin(), [](const Row& row) { return row.info; });
    return infos;
}();

constexpr std::string_view kModeNames[] = {"default", "paper", "penalty", "god-object"};
constexpr std::string_view kGeometryNames[] = {"mesh", "spheres"};
constexpr std::string_view kScreeningNames[] = {"none", "screen", "cluster"};

std::span<const std::string_view> namesOf(Mode Settings::*) { return kModeNames; }
std::span<const std::string_view> namesOf(Geometry Settings::*) { return kGeometryNames; }
std::span<const std::string_view> namesOf(Screening Settings::*) { return kScreeningNames; }
template <class E>
concept Enumeration = std::is_enum_v<E>;

template <class... F>
struct Overload : F... {
    using F::operator()...;
};
template <class... F>
Overload(F...) -> Overload<F...>;

constexpr EarlierKey kEarlierKeys[] = {{"linearisations", "linearizations"}, {"loop", ""}};

const Row* findRow(std::string_view key) {
    const auto row = std::find_if(std::begin(kRows), std::end(kRows),
                                  [now = settingKey(key)](const Row& r) { return r.info.key == now; });
    return row == std::end(kRows) ? nullptr : row;
}

std::string text(auto number) {
    char buffer[32];
    return {buffer, std::to_chars(buffer, std::end(buffer), number).ptr};
}

std::string unknownKey(std::string_view key) {
    std::string sentence = "there is no setting '" + std::string(key) + "': ";
    std::vector<std::string_view> keys;
    for (const Row& row : kRows) keys.push_back(row.info.key);
    if (const std::string nearest = nearestName(key, keys); !nearest.empty())
        return sentence + "did you mean '" + nearest + "'?";
    sentence += "the settings are ";
    for (const std::string_view known : keys) sentence += (known == keys.front() ? "" : ", ") + std::string(known);
    return sentence;
}

/// "a, b or c".
std::string alternatives(std::span<const std::string_view> names) {
    std::string all;
    for (std::size_t i = 0; i < names.size(); ++i)
        all += (i == 0 ? "" : i + 1 < names.size() ? ", " : " or ") + std::string(names[i]);
    return all;
}

/// As the tables have them: they live as long as the program.
std::vector<std::string_view> namesOf(const SolverName& setting) {
    std::vector<std::string_view> names;
    const auto add = [&](const auto& table) {
        for (const auto& solver : table) names.push_back(solver.name);
    };
    setting.friction ? add(frictionSolverTable()) : add(solverTable());
    if (setting.mayBeNone) names.push_back(kNoSolver);
    return names;
}

std::string oneOf(const SolverName& setting) {
    std::string all;
    for (const std::string_view name : namesOf(setting)) all += (all.empty() ? "one of " : ", ") + std::string(name);
    return all;
}

std::string range(const SettingInfo& info, bool whole) { return rangeWords(info.min, info.max, info.unit, whole); }

std::string refuse(const SettingInfo& info, std::string_view value, const std::string& accepted) {
    return std::string(info.key) + " must be " + accepted + ", not '" + std::string(value) + "'";
}

}  // namespace

std::span<const SettingInfo> settingTable() { return kInfos; }
std::span<const EarlierKey> earlierSettingKeys() { return kEarlierKeys; }
std::string_view settingKey(std::string_view key) {
    for (const auto& [earlier, now] : kEarlierKeys)
        if (key == earlier) return now;
    return key;
}
std::span<const std::string_view> modeNames() { return kModeNames; }
std::span<const std::string_view> geometryNames() { return kGeometryNames; }

std::string setSetting(Settings& settings, std::string_view key, std::string_view value) {
    const Row* row = findRow(key);
    if (!row) return unknownKey(key);
    const SettingInfo& info = row->info;

    const auto setWhole = [&](auto member) -> std::string {
        const auto number = readNumber(value, info.min, info.max);  // read as a double, so that 1e8 is a valid count
        if (!number || *number != std::floor(*number)) return refuse(info, value, range(info, true));
        settings.*member = static_cast<std::remove_reference_t<decltype(settings.*member)>>(*number);
        return {};
    };
    return std::visit(Overload{
                          [&](double Settings::*member) -> std::string {
                              const auto number = readNumber(value, info.min, info.max);
                              if (!number) return refuse(info, value, range(info, false));
                              settings.*member = *number;
                              return {};
                          },
                          [&](int Settings::*member) { return setWhole(member); },
                          [&](std::int64_t Settings::*member) { return setWhole(member); },
                          [&](bool Settings::*member) -> std::string {
                              const bool on = value == "on" || value == "true";
                              if (!on && value != "off" && value != "false") return refuse(info, value, "on or off");
                              settings.*member = on;
                              return {};
                          },
                          [&]<Enumeration E>(E Settings::*member) -> std::string {
                              const auto names = namesOf(member);
                              const auto found = std::find(names.begin(), names.end(), value);
                              if (found == names.end()) return refuse(info, value, alternatives(names));
                              settings.*member = static_cast<E>(found - names.begin());
                              return {};
                          },
                          [&](SolverName solver) -> std::string {
                              const auto names = namesOf(solver);
                              const auto found = std::find(names.begin(), names.end(), value);
                              if (found == names.end()) return refuse(info, value, oneOf(solver));
                              settings.*solver.name = *found;
                              return {};
                          },
                      },
                      row->field);
}

std::vector<std::string> settingChoices(std::string_view key) {
    const Row* row = findRow(key);
    assert(row);
    const auto names = [](std::span<const std::string_view> of) {
        return std::vector<std::string>(of.begin(), of.end());
    };
    return std::visit(Overload{[&]<Enumeration E>(E Settings::*member) { return names(namesOf(member)); },
                               [&](SolverName setting) { return names(namesOf(setting)); },
                               [](auto) { return std::vector<std::string>(); }},
                      row->field);
}

std::string getSetting(const Settings& settings, std::string_view key) {
    const Row* row = findRow(key);
    assert(row);
    return std::visit(Overload{
                          [&](bool Settings::*member) -> std::string { return settings.*member ? "on" : "off"; },
                          [&]<Enumeration E>(E Settings::*member) {
                              return std::string(namesOf(member)[static_cast<std::size_t>(settings.*member)]);
                          },
                          [&](SolverName solver) { return std::string(settings.*solver.name); },
                          [&](auto member) { return text(settings.*member); },
                      },
                      row->field);
}

SolverSettings solverSettings(const Settings& settings) {
    SolverSettings s;
    s.paperForm = settings.mode == Mode::Paper;
    s.tolerance = settings.tolerance;
    if (!s.paperForm && settings.solver != kExactSolver) s.maxIterations = settings.iterationCap;
    s.workLimit = s.paperForm ? settings.paperWork : settings.solverWork;
    s.elasticWeight = settings.elasticWeight;
    s.longestWait = settings.solverWait;
    return s;
}

std::string checkAskedFriction(const Settings& settings, std::string_view key) {
    const bool asked =
        settings.friction && (key == "friction" || (key == "friction_coefficient" && settings.frictionCoefficient > 0));
    if (!asked || settings.mode == Mode::Default) return {};
    return std::string(kModeNames[static_cast<std::size_t>(settings.mode)]) + " mode is frictionless: leave out " +
           std::string(key) + ", or choose default mode";
}

std::string checkSettings(const Settings& settings) {
    for (const auto& [info, field] : kRows) {
        const auto number = [&, &info = info](auto member, bool whole) -> std::string {
            if (isWithin(static_cast<double>(settings.*member), info.min, info.max)) return {};
            return refuse(info, text(settings.*member), range(info, whole));
        };
        const std::string wrong =
            std::visit(Overload{
                           [&](double Settings::*member) { return number(member, false); },
                           [&](int Settings::*member) { return number(member, true); },
                           [&](std::int64_t Settings::*member) { return number(member, true); },
                           [&, &info = info](SolverName solver) -> std::string {
                               const auto names = namesOf(solver);
                               if (std::find(names.begin(), names.end(), settings.*solver.name) != names.end())
                                   return {};
                               return refuse(info, settings.*solver.name, oneOf(solver));
                           },
                           [](auto) { return std::string(); },
                       },
                       field);
        if (!wrong.empty()) return wrong;
    }
    // Pairs beyond the margin are not listed, so the tool could hit one if it traveled further.
    if (settings.trust > settings.margin)
        return "trust is " + text(settings.trust) + " mm but must be at most the margin of " + text(settings.margin) +
               " mm: lower trust or raise margin";
    return {};
}

}  // namespace touchstone
