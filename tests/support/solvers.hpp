#pragma once
// Indices into the solver table for tests that hold for a whole kind of solver, so that a new row needs no edit.
#include <vector>

#include "haptics/qp/solver.hpp"

namespace touchstone::test {

/// All rows of solverTable().
inline std::vector<int> allSolvers() {
    std::vector<int> indices;
    for (int i = 0; i < static_cast<int>(solverTable().size()); ++i) indices.push_back(i);
    return indices;
}

/// The rows whose answers the tick projects onto the constraints.
inline std::vector<int> approximateSolvers() {
    std::vector<int> indices;
    for (const int i : allSolvers())
        if (!solverTable()[static_cast<std::size_t>(i)].exact) indices.push_back(i);
    return indices;
}

}  // namespace touchstone::test
