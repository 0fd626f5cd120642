#pragma once
// A solid with a helical thread, for parts that tests write as STEP files.
#include <TopoDS_Shape.hxx>

namespace touchstone {

/// Lengths in mm. The basic profile of ISO 68-1: crests an eighth and roots a quarter of the pitch wide, flanks at 30°
/// to the radial planes.
struct ThreadedPart {
    double diameter = 16, pitch = 2;
    int starts = 1;
    double inward = 0;  ///< the profile is drawn nearer to the axis by this; the flanks then lie half as far apart
    double length = 20;
    double acrossFlats = 24;
    double head = 10;  ///< height of the bolt's head
    bool left = false;
};

/// A bolt about the z axis: thread from 0 to `length`, hexagonal head below.
TopoDS_Shape threadedBolt(const ThreadedPart& part);
/// A hexagonal nut about the z axis from 0 to `length`, in phase with the bolt.
TopoDS_Shape threadedNut(const ThreadedPart& part);

}  // namespace touchstone
