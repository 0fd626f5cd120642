#pragma once
// All settings that a user can change, in one struct and one table.
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "haptics/qp/row_screen.hpp"
#include "haptics/qp/solver.hpp"

namespace touchstone {

enum class Mode : std::uint8_t {
    Default,    ///< pairs within a margin, half-space rows, trust cap: what a hand should feel
    Paper,      ///< Yu, Wang and Zhang as written, for comparison
    Penalty,    ///< springs against overlaps behind a virtual coupling, for comparison
    GodObject,  ///< constrained by the pairs that touch, up to where the next one does, for comparison
};
/// The names on the command line, in the order of the enumeration.
std::span<const std::string_view> modeNames();

/// By what the tool touches in default mode.
enum class Geometry : std::uint8_t {
    Mesh,     ///< the triangles of closed parts; spheres for others
    Spheres,  ///< the leaves of the sphere trees, as in the paper
};
/// Likewise.
std::span<const std::string_view> geometryNames();

/// Constant within a tick. A plain struct: it travels by value from the panels to the loop. The table in settings.cpp
/// says for each value what happens if it is larger or smaller.
struct Settings {
    Mode mode = Mode::Default;
    Geometry geometry = Geometry::Mesh;
    double contactDistance = 0.002;  ///< δ, mm: distance that is kept between the features of meshes
    int solver = kExactSolver;       ///< index into solverTable()
    int shadow = 1;                  ///< likewise; -1 for none
    int frictionSolver = 0;          ///< index into frictionSolverTable(): moves the tool where there is friction
    int frictionShadow = 3;          ///< likewise: the shadow where there is friction, unless `shadow` is none
    double stiffness = 1;            ///< k_t, N/mm; the paper's value
    double torsion = 1000;           ///< k_r, mN·m/rad; the paper's value
    double tolerance = 0.01;  ///< of an approximate solver or shadow: N; in paper mode N·mm, where it is the paper's
    Screening screening = Screening::None;  ///< before an approximate solver in default mode
    /// Maximum iterations of an approximate solver in default mode. In a static hold of 3.235 N, pqp gave 3.049 N with
    /// 10 iterations, 3.132 N with chatter with 100, and the exact force with 1,000 and a tolerance of 1e-6.
    int iterationCap = 1000;
    /// m, mm: pairs of spheres within it become rows. Measured on bodies of 100 mm; close fits use 0.4 x clearance.
    double margin = 0.5;
    /// t, mm: maximum travel of any leaf in a linearization; t <= m. It bounds the speed that the tool can follow in
    /// contact: linearisations x trust in a tick.
    double trust = 0.5;
    double slack = 0.75;  ///< travel after which the neighbor list is rebuilt, mm; close fits use 0.1
    /// v, mm/ms: travel of the tool beyond the device's own while in contact. It bounds the force of a slip-off: a drop
    /// into a keyway had 7.2 N in one ms without the budget and 0.54 N with 0.5 mm/ms.
    double travelBudget = 0.5;
    /// Maximum number of linearizations in a tick that begins with force; 0: linearizationsOf(). Spelled as the key in
    /// scene files and recordings.
    int linearisations = 0;
    bool friction = true;            ///< friction of the parts' materials, in default mode
    double frictionCoefficient = 0;  ///< µ of every pair, instead of the materials'; 0: the materials'
    double frictionScale = 1;        ///< factor on all coefficients of friction
    bool adaptiveMargin = true;      ///< solve only with the rows that the step would cross
    /// w of ½ w s² when rows contradict each other, for rows of unit length in the metric of G. Chosen by measurement.
    double elasticWeight = 1000;
    int paperRows = 1024;  ///< maximum number of pairs, the deepest, in paper mode
    /// rows² x iterations a tick in paper mode: the only bound of that mode's time, since rows that contradict each
    /// other never converge.
    std::int64_t paperWork = 100'000'000;
    std::int64_t solverWork = 20'000'000;  ///< rows x iterations a tick of an approximate solver that moves the tool
    std::int64_t shadowWork = 5'000'000;   ///< rows x iterations a tick of the shadow
    int shadowRows = 300;                  ///< maximum number of rows of the shadow, those with the smallest gaps
    double penaltyStiffness = 10;          ///< N/mm of each pair in penalty mode
    double rate = 1000;                    ///< Hz
    bool pause = false;                    ///< the tool is held with zero force
    double solverWait = std::numeric_limits<double>::infinity();  ///< SolverSettings::longestWait; see limitWork()
    int deadMan = 0;  ///< button of the device that must be held for any force, from 1; 0: none

    friend bool operator==(const Settings&, const Settings&) = default;
};

/// By what the tool touches in the mode of these settings: only default mode touches meshes.
inline Geometry geometryOf(const Settings& settings) {
    return settings.mode == Mode::Default ? settings.geometry : Geometry::Spheres;
}

/// The maximum number of linearizations in a tick that begins with force. Between meshes the nearest pose is found by
/// more steps, and each costs less: of 7,670 ticks of two bunnies, 1.5 % did not arrive with eight and 0.05 % with
/// twelve, apart from those that the travel budget ended.
inline int linearizationsOf(const Settings& settings, Geometry geometry) {
    return settings.linearisations > 0 ? settings.linearisations : geometry == Geometry::Mesh ? 12 : 2;
}

/// Settings of the solver that moves the tool, in the mode of these settings.
SolverSettings solverSettings(const Settings& settings);

/// Where the haptics panel shows a setting, in the order of the table.
enum class SettingGroup : std::uint8_t { None, Mode, Coupling, Solvers, Approximate, Contact, Friction, More };

/// One setting by name: the table row that the command line, scene files, panels and help read.
struct SettingInfo {
    std::string_view key;   ///< as in --set KEY=VALUE
    std::string_view unit;  ///< "" for counts and names
    std::string_view help;  ///< what it does, and what happens if it is larger or smaller
    double min, max;        ///< accepted range of numbers; both 0 for names and switches
    SettingGroup group = SettingGroup::None;
    const char* label = "";    ///< of its control
    double low = 0, high = 0;  ///< range of its slider: where a number is usually tuned
};

std::span<const SettingInfo> settingTable();

/// Names that a setting accepts; empty for numbers and switches. Pre: key is in the table. Allocates.
std::vector<std::string> settingChoices(std::string_view key);

/// Sets one value from text. Returns an empty string, or one sentence that says what is wrong and what is accepted; in
/// that case `settings` is unchanged.
std::string setSetting(Settings& settings, std::string_view key, std::string_view value);
/// The value as text that setSetting() reads back to the same bits. Pre: key is in the table.
std::string getSetting(const Settings& settings, std::string_view key);
/// One sentence if a setting asks for friction in a mode that has none; empty otherwise. Only where a user names the
/// setting is that a mistake: a scene's materials have no effect in such a mode.
std::string checkAskedFriction(const Settings& settings, std::string_view key);
/// Checks that all values are in their ranges and consistent. Returns an empty string, or one sentence that says what
/// is wrong.
std::string checkSettings(const Settings& settings);

}  // namespace touchstone
