#pragma once
// A bolt and a thin nut with the basic profile of ISO metric threads (ISO 68-1).
#include <cmath>
#include <numbers>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::app {

/// Lengths in mm; those that are not given follow from the diameter, about as in ISO 4014. The bolt has the basic
/// profile: flanks at 30° to the radial planes, crests an eighth and roots a quarter of the pitch wide. With another
/// flank or depth the roots have the remaining width. The nut has the same profile, moved outward by the clearance on
/// crests, roots and flanks, measured in a section along the axis. Each section lies on its profile; the bolt is
/// inscribed between its sections and the nut circumscribed, so that they keep the clearance in any phase: with the
/// default counts to 1 µm, and to 4 µm where the nut surrounds the bolt's chamfer.
struct ThreadFit {
    double diameter = 16, pitch = 2;
    double clearance = 0.05;  ///< of the flanks, crests and roots
    double height = 8;        ///< of the nut, as ISO 4035 has it for M16
    double flank = 30;        ///< degrees from the flanks to the radial planes; a square thread has nearly none
    double depth = 0;         ///< from crest to root; 0: that of the basic profile
    bool left = false;        ///< a left-handed thread
    int starts = 1;           ///< threads side by side, each of which climbs by all their pitches in a turn
    int segments = 156;       ///< sections of the bolt around the axis
    int nutSegments = 0;      ///< sections of the nut; 0: twelve more than the bolt has

    double acrossFlats() const { return 1.5 * diameter; }   ///< of nut and head
    double standing() const { return 0.78125 * diameter; }  ///< height of the bolt's tip above the plate
    double threaded() const { return 1.125 * diameter; }    ///< from the bolt's tip to the end of the run-out
    double runOut() const { return 0.1875 * diameter; }     ///< length of the cone at the end of the thread
    double plate() const { return 0.75 * diameter; }        ///< thickness of the plate between nut and head
    double head() const { return 0.625 * diameter; }        ///< height of the bolt's head
    double spacing() const { return 0.125 * diameter; }     ///< of the points of flat ends
    int nutSections() const { return nutSegments ? nutSegments : segments + 12; }
    double lead() const { return starts * pitch; }
    /// Height of the fundamental triangle, H.
    double triangle() const { return std::sqrt(3.0) / 2 * pitch; }
    double cut() const { return depth > 0 ? depth : 0.625 * triangle(); }
    double minorDiameter() const { return diameter - 2 * cut(); }
    /// Half of what crest and flanks leave of the pitch.
    double rootHalf() const { return pitch / 2 - pitch / 16 - cut() * std::tan(flankAngle()); }
    double flankAngle() const { return flank * std::numbers::pi / 180; }
    /// From the middle of the nut's axial play to either end, and the turn that covers it, rad.
    double play() const { return clearance / std::cos(flankAngle()); }
    double playAngle() const { return 2 * std::numbers::pi * play() / lead(); }
};

/// The bolt about the y axis with its head below: the plate's top is the plane y = 0. The thread has
/// the middle of a crest at +x in that plane, a chamfer of 45° at the tip and a conical run-out into the shank.
/// Throws std::invalid_argument with one sentence when the dimensions are impossible.
engine::MeshData bolt(const ThreadFit& fit);

/// The nut about the y axis, from y = 0 to its height, countersunk by 45° at both ends. In the bolt's frame it is in
/// the middle of its play, and on the plate.
engine::MeshData nut(const ThreadFit& fit);

}  // namespace touchstone::app
