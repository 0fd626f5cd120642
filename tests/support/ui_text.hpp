#pragma once
// Finds text that a user cannot read in what ImGui has drawn.
#include <glm/glm.hpp>
#include <string>
#include <vector>

namespace touchstone::test {

struct TextFaults {
    std::vector<std::string> cut;      ///< letters that are cut off at the left or right
    std::vector<std::string> halved;   ///< letters that are cut off at the top or bottom, as in a list that scrolls
    std::vector<std::string> covered;  ///< letters over other letters of the same window
};

/// The faults of the frame that ImGui has rendered last, each as "WINDOW at X, Y". The 3D view's own text is left out.
/// `window`: only windows whose name contains it.
TextFaults textFaults(const std::string& window = {});

/// The text of the last frame in windows whose name contains `window`, in the order of drawing and without spaces. "?"
/// stands for letters outside ASCII.
std::string shownText(const std::string& window);

/// Number of letters drawn inside a rectangle (x, y, x + width, y + height).
int lettersIn(const glm::vec4& area);

}  // namespace touchstone::test
