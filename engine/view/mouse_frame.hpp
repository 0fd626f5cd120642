#pragma once
// What the mouse does in one frame of the window.
#include <glm/glm.hpp>

namespace touchstone::engine {

/// State of the mouse in one frame. Pixels from the upper-left corner of the viewport.
struct MouseFrame {
    glm::vec2 cursor{0}, viewport{1};
    bool left = false, middle = false, right = false;  ///< held down
    bool turnKey = false;                              ///< Shift: left turns the tool, or pans the camera
    float wheel = 0;                                   ///< steps since the last frame, positive away from the user
    float depthKeys = 0;                               ///< wheel steps by keys, only used while the tool is held
    glm::vec3 turnKeys{0};   ///< rotation by keys about the view's right, up and forward axes, rad
    bool elsewhere = false;  ///< over a panel: start no drag and ignore the wheel
};

}  // namespace touchstone::engine
