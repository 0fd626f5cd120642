#pragma once
// All settings that a user can change, in one struct.
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "haptics/qp/solver_values.hpp"

namespace touchstone {

enum class Mode : std::uint8_t {
    Default,    ///< pairs within a margin, half-space rows, trust cap: what a hand should feel
    Paper,      ///< Yu, Wang and Zhang as written, for comparison
    Penalty,    ///< springs against overlaps behind a virtual coupling, for comparison
    GodObject,  ///< constrained by the pairs that touch, up to where the next one does, for comparison
};

/// By what the tool touches in default mode.
enum class Geometry : std::uint8_t {
    Mesh,     ///< the triangles of closed parts; spheres for others
    Spheres,  ///< the leaves of the sphere trees, as in the paper
};

/// Constant within a tick. A plain struct: it travels by value from the panels to the loop. The table in settings.cpp
/// says for each value what happens if it is larger or smaller.
struct Settings {
    Mode mode = Mode::Default;
    Geometry geometry = Geometry::Mesh;
    double contactDistance = 0.002;  ///< δ, mm: distance that is kept between the features of meshes
    // Solvers by name, as literals or as solverTable() and frictionSolverTable() have them.
    std::string_view solver = kExactSolver;                  ///< moves the tool
    std::string_view shadow = "pqp";                         ///< measured on the same rows; kNoSolver: none
    std::string_view frictionSolver = kExactFrictionSolver;  ///< moves the tool where there is friction
    std::string_view frictionShadow = "convex";  ///< the shadow where there is friction, unless `shadow` is none
    double stiffness = 1;                        ///< k_t, N/mm; the paper's value
    double torsion = 1000;                       ///< k_r, mN·m/rad; the paper's value
    double tolerance = 0.01;  ///< of an approximate solver or shadow: N; in paper mode N·mm, where it is the paper's
    Screening screening = Screening::None;  ///< before an approximate solver in default mode
    /// Maximum iterations of an approximate solver in default mode. In a static hold of 3.235 N, pqp gave 3.049 N with
    /// 10 iterations, 3.132 N with chatter with 100, and the exact force with 1,000 and a tolerance of 1e-6.
    int iterationCap = 1000;
    /// m, mm: pairs of spheres within it become rows. Measured on bodies of 100 mm; close fits use 0.4 x clearance.
    double margin = 0.5;
    /// t, mm: maximum travel of any leaf in a linearization; t <= m. It bounds the speed that the tool can follow in
    /// contact: linearizations x trust in a tick.
    double trust = 0.5;
    double slack = 0.75;  ///< travel after which the neighbor list is rebuilt, mm; close fits use 0.1
    /// v, mm/ms: travel of the tool beyond the device's own while in contact. It bounds the force of a slip-off: a drop
    /// into a keyway had 7.2 N in one ms without the budget and 0.54 N with 0.5 mm/ms.
    double travelBudget = 0.5;
    /// Maximum number of linearizations in a tick that begins with force; 0: linearizationsOf().
    int linearizations = 0;
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

/// Maximum of the setting `linearizations`, and its value between meshes, where ticks end with their work long before.
inline constexpr int kMostLinearizations = 64;

/// By what the tool touches in the mode of these settings: only default mode touches meshes.
inline Geometry geometryOf(const Settings& settings) {
    return settings.mode == Mode::Default ? settings.geometry : Geometry::Spheres;
}

/// The maximum number of linearizations in a tick that begins with force. Between meshes the nearest pose is found by
/// more steps, and each costs less.
inline int linearizationsOf(const Settings& settings, Geometry geometry) {
    return settings.linearizations > 0 ? settings.linearizations : geometry == Geometry::Mesh ? kMostLinearizations : 2;
}

/// Fractions of the tick period that the solvers of a live loop may use. The remaining 0.3 is for collision, the exact
/// solver and the system. With larger fractions ticks end late; with smaller ones a solver stops before its tolerance.
struct WorkShares {
    double solver = 0.4;  ///< an approximate solver that moves the tool
    double shadow = 0.3;  ///< the shadow
};

/// Sets one value from text. Returns an empty string, or one sentence that says what is wrong and what is accepted; in
/// that case `settings` is unchanged.
std::string setSetting(Settings& settings, std::string_view key, std::string_view value);
/// Checks that all values are in their ranges and consistent. Returns an empty string, or one sentence that says what
/// is wrong.
std::string checkSettings(const Settings& settings);

}  // namespace touchstone
