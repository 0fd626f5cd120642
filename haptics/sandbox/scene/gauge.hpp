#pragma once
// How deep the tool reaches: in a pocket, in a hole.
#include <algorithm>
#include <cmath>
#include <string>

#include "haptics/math/rigid.hpp"

namespace touchstone::sandbox {

/// Reads the depth of one point of the tool below a plane.
struct Gauge {
    std::string name;          ///< name of the node, for reports
    Pose X_WG;                 ///< the plane is y = 0 of this frame and +y points outwards; scene frame, mm
    Vec3 p_TP = Vec3::Zero();  ///< the point, in the frame of the tool node, mm

    /// Depth in mm along the frame's -y; negative while the point is above the plane.
    double depth(const Pose& X_WT) const { return -(X_WG.inverse() * (X_WT * p_TP)).y(); }
};

/// The readings of a gauge in a run, mm.
struct GaugeReading {
    double last = NAN, deepest = -INFINITY;

    void add(double depth) {
        last = depth;
        deepest = std::max(deepest, depth);
    }
};

}  // namespace touchstone::sandbox
