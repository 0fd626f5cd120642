#pragma once
// Everything a user can tune, in one struct and one table.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "haptics/qp/row_screen.hpp"
#include "haptics/qp/solver.hpp"

namespace touchstone {

enum class Mode : std::uint8_t {
    Default,  ///< pairs with margin, half-space rows, trust cap: what a hand should feel
    Paper,    ///< Yu, Wang and Zhang as written, to be measured against
    Penalty,  ///< springs against overlaps behind a virtual coupling, to be measured against
};
/// In the order of the enumeration, as on the command line.
std::span<const std::string_view> modeNames();

/// Constant within a tick. A plain struct: it travels by value from the panels to the loop.
struct Settings {
    Mode mode = Mode::Default;
    int solver = kExactSolver;  ///< index into solverTable()
    int shadow = 1;             ///< likewise; -1 for none
    double stiffness = 1;       ///< k_t, N/mm
    double torsion = 1000;      ///< k_r, mN·m/rad
    double tolerance = 0.01;    ///< of the rendering or shadowing approximate solver: N; N·mm in paper mode
    Screening screening = Screening::None;  ///< before an approximate solver, in default mode
    int iterationCap = 1000;                ///< of the approximate solvers in default mode
    double margin = 0.5;                    ///< m, mm: pairs this near become rows
    double trust = 0.5;                     ///< t, mm: greatest travel of any leaf per linearisation
    double slack = 0.75;                    ///< mm of travel before the neighbor list is built anew
    double travelBudget = 0.5;              ///< v, mm/ms: travel beyond the device's own while in contact
    int linearisations = 2;
    bool adaptiveMargin = true;  ///< solve with the rows that the step would cross
    double elasticWeight = 1000;
    int paperRows = 1024;                  ///< deepest pairs kept in paper mode
    std::int64_t paperWork = 100'000'000;  ///< rows² x iterations a tick in paper mode
    std::int64_t solverWork = 20'000'000;  ///< rows x iterations a tick of an approximate rendering solver
    std::int64_t shadowWork = 5'000'000;   ///< rows x iterations a tick of the shadow
    int shadowRows = 300;                  ///< deepest rows the shadow takes
    double penaltyStiffness = 10;          ///< N/mm of each pair in penalty mode
    double rate = 1000;                    ///< Hz
    bool pause = false;                    ///< hold the tool where it is, force zero
    int deadMan = 0;                       ///< button of the device without which there is no force, from 1; 0: none

    friend bool operator==(const Settings&, const Settings&) = default;
};

/// What the solver that moves the tool is given in these settings' mode.
SolverSettings solverSettings(const Settings& settings);

/// One tunable value by name: the row that the command line, scene files, panels and help all read.
struct SettingInfo {
    std::string_view key;   ///< as in --set KEY=VALUE
    std::string_view unit;  ///< "" for counts and names
    std::string_view help;  ///< one sentence: what it does and what breaks
    double min, max;        ///< accepted range of numbers; both 0 for names and switches
};

std::span<const SettingInfo> settingTable();

/// Sets one value from text. Returns an empty string, or one sentence that says what is wrong and what is accepted;
/// `settings` is then untouched.
std::string setSetting(Settings& settings, std::string_view key, std::string_view value);
/// The value as text that setSetting() reads back to the same bits. Pre: key is in the table.
std::string getSetting(const Settings& settings, std::string_view key);
/// Whether the values go together and lie in their ranges, whoever set them. Returns an empty string, or one sentence.
std::string checkSettings(const Settings& settings);

}  // namespace touchstone
