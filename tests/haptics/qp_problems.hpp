#pragma once
// Problems for the solver tests: small ones with answers derived by hand, random contact-like ones, and a reference.
#include <random>
#include <string>
#include <vector>

#include "haptics/qp/solver.hpp"

namespace touchstone::test {

/// A problem that owns its rows.
struct Contacts {
    Vec6 stiffness = (Vec6() << 1, 1, 1, 1000, 1000, 1000).finished();
    Vec6 wanted = Vec6::Zero();
    RowSet rows{1};

    explicit Contacts(int capacity) : rows(capacity) {}
    /// Adds the row (n, r x n) of a contact at r; ids ascend by ten, so that tests can put one between.
    Contacts& wall(const Vec3& n, double gap, const Vec3& r = Vec3::Zero());
    Contacts& row(const Vec6& j, double gap);
    QpProblem problem() const { return {stiffness, wanted, &rows}; }
};

/// A problem whose answer is known.
struct KnownProblem {
    std::string name;
    Contacts contacts;
    SolveStatus status = SolveStatus::Solved;
    Vec6 x = Vec6::Zero();  ///< the optimum
    double rowLength = 1;   ///< of the translational part
};
std::vector<KnownProblem> knownProblems();

/// How contact-like problems vary, within |r| <= 50 mm, h up to 5 mm inside. The first three are feasible.
enum class Kind { Slide, Wedge, Pinch, Scattered, Degenerate, Squeeze };
inline constexpr Kind kKinds[] = {Kind::Slide,     Kind::Wedge,      Kind::Pinch,
                                  Kind::Scattered, Kind::Degenerate, Kind::Squeeze};
Contacts randomContacts(std::mt19937_64& random, Kind kind, int m);

/// The answer in 113-bit arithmetic, by another path than any solver's: dense normal equations anew at every pivot.
struct Reference {
    bool feasible = false;   ///< else x and slack are those of the elastic problem
    bool certified = false;  ///< the KKT conditions hold to 1e-20, recomputed from scratch
    Vec6 x = Vec6::Zero();
    double slack = 0;
    double force = 0;  ///< sum of the multipliers, on rows of unit length in the metric of G
};
Reference referenceAnswer(const QpProblem& problem, double elasticWeight);

/// Residuals recomputed here, in long double, from the result alone.
struct Residuals {
    double primal, dual, stationarity, complementarity;
};
Residuals residualsOf(const QpProblem& problem, const SolveResult& result);

/// Distance of two increments in mm: rotations count through the lever at which the springs are equally stiff.
double distanceMm(const QpProblem& problem, const Vec6& a, const Vec6& b);

}  // namespace touchstone::test
