#pragma once
// Problems for the solver tests: small ones with answers derived by hand, random contact-like ones, and a reference.
#include <random>
#include <string>
#include <vector>

#include "haptics/qp/random_contacts.hpp"
#include "haptics/qp/solver.hpp"

namespace touchstone::test {

/// A problem whose answer is known.
struct KnownProblem {
    std::string name;
    Contacts contacts;
    SolveStatus status = SolveStatus::Solved;
    Vec6 x = Vec6::Zero();  ///< the optimum
    double rowLength = 1;   ///< of the translational part
};
std::vector<KnownProblem> knownProblems();

/// The answer in 113-bit arithmetic, by a method that no solver uses: it builds dense normal equations at every pivot.
struct Reference {
    bool feasible = false;   ///< if false, x and slack are those of the elastic problem
    bool certified = false;  ///< the KKT conditions hold to 1e-20, recomputed from scratch
    Vec6 x = Vec6::Zero();
    double slack = 0;
    double force = 0;      ///< sum of the multipliers, on rows of unit length in the metric of G
    double condition = 1;  ///< of the normals of the rows that push, on the same rows
};
/// Starts without active rows, or with the rows of `start`, whose answer then only has to be proven: that path is
/// shorter, and the answer and its certificate are the same.
Reference referenceAnswer(const QpProblem& problem, double elasticWeight, std::span<const Multiplier> start = {});

/// The largest KKT residual in 113-bit arithmetic, in the metric of G with rows of unit length: a violation, a negative
/// force, the imbalance of forces, or a force times its gap over 1 + that force. With result.slack, the residuals are
/// those of the elastic problem.
double certificateOf(const QpProblem& problem, const SolveResult& result, double elasticWeight);

/// Residuals in long double, recomputed from the result alone.
struct Residuals {
    double primal, dual, stationarity, complementarity;
};
Residuals residualsOf(const QpProblem& problem, const SolveResult& result);

/// Distance of two increments in mm. Rotations are multiplied by the lever at which both springs are equally stiff.
double distanceMm(const QpProblem& problem, const Vec6& a, const Vec6& b);

}  // namespace touchstone::test
