#pragma once
// "Sweep this contact": runs every solver with a range of tolerances on the rows of one tick, outside the loop.
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "haptics/loop/step.hpp"
#include "haptics/qp/row_screen.hpp"
#include "haptics/sandbox/measure/background.hpp"

namespace touchstone::sandbox {

struct SweepOptions {
    bool allRows =
        false;  ///< rows of every pair within the margin; else only those that the tick's adaptive margin needs
    bool warm =
        false;  ///< in default mode: solvers start from the answer for the device pose one tick earlier; else cold
};

/// The largest problem that the exact solver solves in a tick.
struct FrozenContact {
    RowSet rows{0};
    /// With friction: the contacts that carry force or are crossed, without the forces of earlier ticks; then there are
    /// no rows.
    std::vector<FrictionContact> contacts = {};
    Vec6 stiffness, wanted;
    Vec6 wantedBefore;  ///< for the device pose one tick earlier
    SweepOptions options;
    Settings settings;
    double reach = 0;  ///< reach of the tool, mm, for screening
    std::uint64_t tick = 0;

    bool rubs() const { return !contacts.empty(); }
};

/// Repeats the tick `now`, which follows `before`, with memory of its own, so that the loop is not involved. It knows
/// nothing of earlier ticks: with friction, contacts begin at rest. Nothing if there are no rows, or with friction no
/// contacts. Takes tens of milliseconds.
std::optional<FrozenContact> freezeContact(const World& world, const Settings& settings, const TickRecord& before,
                                           const TickRecord& now, const SweepOptions& options);

/// The result of one solver at one tolerance.
struct SweepPoint {
    std::string_view solver;                 ///< its name in the table
    double tolerance = 0;                    ///< as in Settings; 0 if the solver is exact, and with friction
    double us = 0;                           ///< median of the repetitions
    double forceError = 0, torqueError = 0;  ///< N, mN·m, against the exact answer, before any projection
    int iterations = 0;
    SolveStatus status = SolveStatus::Solved;  ///< Invalid too if the solver left the answer to another
    bool onFront = false;                      ///< no other point is both faster and more accurate
};

struct Sweep {
    std::uint64_t tick = 0;
    int rows = 0;  ///< with friction: contacts
    Mode mode = Mode::Default;
    bool friction = false;
    std::vector<SweepPoint> points;  ///< in the order of the table, for each solver from coarse to fine
};

/// Whether this machine can use the solver in a tick: not on a card whose round trip is longer, as that of an emulated
/// one.
bool fitsTick(const SolverInfo& info, const Settings& settings);

/// Runs every solver that this machine can use, with friction every friction solver, with the limits of the settings.
/// `progress` receives 0 to 1 and cancels by returning false; then there is no result. slowCards: also cards that do
/// not fit a tick.
std::optional<Sweep> sweepContact(const FrozenContact& contact, const std::function<bool(double)>& progress = {},
                                  bool slowCards = true);

/// Time and error of a solver at any tolerance, interpolated on logarithmic axes; nothing without points.
std::optional<SweepPoint> pointAt(const Sweep& sweep, std::string_view solver, double tolerance);

/// Writes CSV, one line for each point. Throws std::runtime_error with one sentence if the file cannot be written.
void writeSweep(const Sweep& sweep, const std::filesystem::path& file);

/// A sweep on its own thread.
class SweepRun : public Background<Sweep> {
  public:
    void start(std::shared_ptr<const World> world, const Settings& settings, const TickRecord& before,
               const TickRecord& now, const SweepOptions& options);
};

}  // namespace touchstone::sandbox
