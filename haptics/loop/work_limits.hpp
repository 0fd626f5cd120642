#pragma once
// From time to counts: how much work an approximate solver may do in a tick of a live loop.
#include "haptics/loop/settings.hpp"

namespace touchstone {

/// Shares of the tick's period; what is left is for collision, the exact solver and the system.
struct WorkShares {
    double solver = 0.4;  ///< of an approximate solver that renders
    double shadow = 0.3;
};

/// A solver's iteration costs something even with few rows; limits count it as if it had this many.
inline constexpr int kFewRows = 32;

/// Time of one row in one iteration of pqp on this machine, ns: the slower of kFewRows rows and many. Takes some
/// milliseconds of processor time, so call it off the loop.
double calibrateWork();

/// The settings with solverWork, shadowWork and iterationCap lowered to what fits the shares at the settings' rate, so
/// that in default mode neither solver makes a late tick. Counts, not clocks, bound the tick itself. Paper mode renders
/// with the bound that it states, paperWork, late or not. Headless runs leave the settings as they are and so repeat.
Settings limitWork(Settings settings, double nanosecondsPerRowIteration, const WorkShares& shares = {});

}  // namespace touchstone
