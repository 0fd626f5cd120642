#pragma once
// Plots by gnuplot, all in one look, as SVG and PNG.
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "haptics/sandbox/measure/pareto.hpp"

namespace touchstone::app {

/// Throws std::runtime_error with one sentence when there is no gnuplot.
void requireGnuplot();
/// Runs the commands and draws NAME.svg and NAME.png into the folder. Throws std::runtime_error with one sentence.
void gnuplot(const std::filesystem::path& folder, const std::string& name, const std::string& commands,
             int height = 440);

/// The i-th colour of a plot, and a number as plots have it.
std::string colour(std::size_t i);
std::string text(double value);

using Points = std::vector<sandbox::TimeAndError>;

/// Data blocks and the plot command of lines through points.
class Lines {
  public:
    void add(const std::string& title, const Points& points, const std::string& style = "linespoints pointtype 7",
             const std::string& colourName = "");
    bool empty() const { return count_ == 0; }
    const std::string& data() const { return data_; }
    std::string plot() const { return plot_ + "\n"; }

  private:
    std::string data_, plot_;
    std::size_t count_ = 0;
};

/// Bars, one group a row.
std::string bars(const std::vector<std::pair<std::string, std::vector<double>>>& groups,
                 const std::vector<std::string>& names);

}  // namespace touchstone::app
