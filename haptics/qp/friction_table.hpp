#pragma once
// One table for every solver of FrictionProblem.
#include <memory>
#include <span>
#include <string_view>

#include "haptics/qp/friction.hpp"

namespace touchstone {

/// What a solver aims at, which its answers can be checked for.
struct FrictionLaw {
    int facets = 0;          ///< of the pyramid in place of each cone; 0: the cone
    bool hovers = false;     ///< a contact that slides by u hovers at µ |u|, as in the convex relaxation
    double accuracy = 1e-9;  ///< N and mm, of answers of about 1; direct methods round at 1e-13
    int sweeps = 0;          ///< iterations after which it ends with its last iterate; 0: it has an answer or none
};

struct FrictionSolverInfo {
    std::string_view name;     ///< as on the command line
    std::string_view summary;  ///< one sentence for help and tooltips
    bool exact;                ///< its answers obey Coulomb's law to rounding where their status is Exact
    std::unique_ptr<FrictionSolver> (*make)(int capacity);  ///< capacity: maximum number of contacts
    FrictionLaw law = {};
};

/// The solvers in the order in which users see them. The first one renders; the others are baselines to compare with.
std::span<const FrictionSolverInfo> frictionSolverTable();
/// Row of frictionSolverTable(), or null.
const FrictionSolverInfo* findFrictionSolver(std::string_view name);

}  // namespace touchstone
