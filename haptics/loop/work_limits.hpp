#pragma once
// Converts time to counts: the work that an approximate solver may do in a tick of a live loop.
#include <string>
#include <vector>

#include "haptics/collision/search_budget.hpp"
#include "haptics/loop/settings.hpp"
#include "haptics/math/tick_tuning.hpp"

namespace touchstone {

/// What the searches of a tick may do.
inline constexpr SearchBudget::Limits kSearchLimits{
    .tick = kTestsOfTick, .flight = kTestsOfFlight, .list = kTestsOfList};

/// Minimum number of rows that the limits assume, since an iteration has a cost that does not depend on the rows. With
/// a smaller number the iteration cap allows too many iterations for problems of few rows, and ticks end late; with a
/// larger one the cap stops a solver early.
inline constexpr int kFewRows = 32;

/// Measures the time of one row in one iteration of pqp on this machine, ns: the larger value of kFewRows and of 300
/// rows. Takes some milliseconds of processor time, so it must not be called on the loop.
double calibrateWork();

/// Updates that must fit a tick for a solver on another device to be used in a live loop.
inline constexpr int kLeastUpdates = 20;

/// Replaces a solver on another device than the processor by pqp if that device cannot be used, or if kLeastUpdates and
/// the way there and back do not fit the share of a tick. Returns a sentence for each. Starts the device; not for the
/// loop.
std::vector<std::string> keepRoundTripsInTick(Settings& settings, const WorkShares& shares = {});

/// The settings with solverWork, shadowWork and iterationCap lowered to what fits the shares at the settings' rate, so
/// that in default mode neither solver makes a late tick. The tick itself is bounded by counts and never by a clock.
/// Paper mode keeps its own bound, paperWork, even if its ticks are late. Headless runs use the settings unchanged, so
/// that they are bit-reproducible. A solver on another device gets the updates that fit its round trip, and its share
/// of the tick as its longest wait.
Settings limitWork(Settings settings, double nanosecondsPerRowIteration, const WorkShares& shares = {});

}  // namespace touchstone
