#pragma once
// Generates problems on which solvers tend to fail.
#include "tests/haptics/qp/qp_problems.hpp"

namespace touchstone::test {

/// What makes a contact-like problem hard; several bits may be set.
enum Hardness : unsigned {
    kCopies = 1 << 0,            ///< rows repeated, to the bit or at another length
    kNearCopies = 1 << 1,        ///< rows repeated, off by 1e-9
    kZeroRows = 1 << 2,          ///< rows without direction, some with g < 0
    kOpposed = 1 << 3,           ///< slots between a row and its opposite: wide, of zero width, or too narrow
    kSharpWedges = 1 << 4,       ///< two planes that nearly face each other
    kIllLevers = 1 << 5,         ///< contacts 1e4 mm away, and rows of rotation alone
    kMeters = 1 << 6,            ///< lengths in meters
    kRowScales = 1 << 7,         ///< each row times 1e-6 to 1e6
    kLengthScale = 1 << 8,       ///< all lengths times 1e-6 to 1e6
    kStiffnessScale = 1 << 9,    ///< G times 1e-6 to 1e6
    kUnevenStiffness = 1 << 10,  ///< each entry of G times 1e-2 to 1e2
    kInfeasible = 1 << 11,       ///< two planes that contradict each other
    kNotFinite = 1 << 12,        ///< a NaN or an infinity somewhere
};

struct HardProblem {
    Contacts contacts{0};
    unsigned hardness = 0;  ///< bits of Hardness
    double mm = 1,
           N = 1;  ///< one millimeter and one newton in the problem's units; larger if the problem was scaled up
};
/// Up to 60 rows, occasionally 300. The same state of `random` gives the same problem.
HardProblem hardProblem(std::mt19937_64& random);

}  // namespace touchstone::test
