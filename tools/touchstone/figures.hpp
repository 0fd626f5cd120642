#pragma once
// The figures of what a command has measured, drawn by the Python script tools/plot with matplotlib.
#include <filesystem>
#include <string>
#include <vector>

namespace touchstone::app {

/// NAME.svg and NAME.png in the folder of the results.
struct Figure {
    std::string name, caption;
};

/// Draws the figures of the tables in `folder`; `kind` is the name of the command that wrote them. If no python3 on
/// PATH has matplotlib, says so in one sentence on the error stream and draws none. Throws std::runtime_error with one
/// sentence when a figure cannot be drawn for another reason.
std::vector<Figure> drawFigures(const std::string& kind, const std::filesystem::path& folder);

}  // namespace touchstone::app
