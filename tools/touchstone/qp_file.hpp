#pragma once
// Quadratic programs as lines of JSON, and their answers.
#include <istream>
#include <string>
#include <vector>

#include "haptics/qp/solver.hpp"

namespace touchstone::app {

/// min ½(x-h)'G(x-h) s.t. J x >= -g, as a line holds it: {"G":[6],"J":[[6],…],"g":[…],"h":[6],"ids":[…]}; ids are
/// optional, other keys are ignored.
struct QpLine {
    Vec6 G = Vec6::Zero(), h = Vec6::Zero();
    std::vector<Vec6> J;
    std::vector<double> g;
    std::vector<std::uint64_t> ids;  ///< empty: none given
};

/// Why a line cannot be solved, in one sentence; empty if it can.
struct QpFault {
    std::string why;
    bool broken = false;  ///< the line is malformed; otherwise its numbers are unsuitable
};
/// Accepts NaN and Infinity without quotes, as Python writes them; they are a fault, but do not break the line.
QpFault readQpLine(const std::string& text, QpLine& line);

/// Reads the next line that is not empty, and its number; false at the end.
bool nextLine(std::istream& in, std::string& text, int& number);

/// A problem and its answer in a run, as a line that readQpLine() reads back to the same bits.
std::string toLine(const QpProblem& problem, const SolveResult& result);

/// The answer to a line. The multipliers belong to the rows as given.
struct QpAnswer {
    std::string status = "invalid";  ///< solved, infeasible-elastic, iteration-limit, invalid
    Vec6 x = Vec6::Zero();
    std::vector<double> y;
    int iterations = 0;
    double us = 0;
    KktResiduals kkt;
    std::string why;  ///< of invalid
};
std::string toLine(const QpAnswer& answer);

}  // namespace touchstone::app
