#pragma once
// A bolt and a thin nut with the basic profile of ISO metric threads (ISO 68-1).
#include <cmath>
#include <numbers>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Lengths in mm. The bolt has the basic profile: flanks at 30° to the radial planes, crests an eighth and roots a
/// quarter of the pitch wide. The nut has the same profile, moved outward by the clearance on crests, roots and flanks
/// alike, measured in a section along the axis. Each section lies on its profile; the bolt is inscribed between its
/// sections and the nut circumscribed, so that they keep the clearance in any phase: with the default counts to 1 µm,
/// and to 4 µm where the nut surrounds the bolt's chamfer.
struct ThreadFit {
    double diameter = 16, pitch = 2;
    double clearance = 0.05;  ///< of the flanks, crests and roots
    double height = 8;        ///< of the nut, as ISO 4035 has it for M16
    double acrossFlats = 24;  ///< of nut and head
    double standing = 12.5;   ///< height of the bolt's tip above the plate
    double threaded = 18;     ///< from the bolt's tip to the end of the thread's run-out
    double plate = 12;        ///< thickness of the plate between nut and head
    double head = 10;         ///< height of the bolt's head
    double spacing = 2;       ///< of the points of flat ends
    bool left = false;        ///< a left-handed thread
    int segments = 156;       ///< sections of the bolt around the axis
    int nutSegments = 0;      ///< sections of the nut; 0: twelve more than the bolt has

    int nutSections() const { return nutSegments ? nutSegments : segments + 12; }
    /// Height of the fundamental triangle, H.
    double triangle() const { return std::sqrt(3.0) / 2 * pitch; }
    double minorDiameter() const { return diameter - 1.25 * triangle(); }
    /// From the middle of the nut's axial play to either end, and the turn that covers it, rad.
    double play() const { return clearance / std::cos(std::numbers::pi / 6); }
    double playAngle() const { return 2 * std::numbers::pi * play() / pitch; }
};

/// The bolt about the y axis with its head below: the plate's top is the plane y = 0. The thread has
/// the middle of a crest at +x in that plane, a chamfer of 45° at the tip and a conical run-out into the shank.
/// Throws std::invalid_argument with one sentence when the dimensions are impossible.
engine::MeshData bolt(const ThreadFit& fit);

/// The nut about the y axis, from y = 0 to its height, countersunk by 45° at both ends. In the bolt's frame it is in
/// the middle of its play, and on the plate.
engine::MeshData nut(const ThreadFit& fit);

}  // namespace touchstone::app
