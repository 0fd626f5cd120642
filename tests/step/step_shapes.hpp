#pragma once
// Solids with drawn clearances, for parts that tests write as STEP files. Lengths in mm; pairs are drawn assembled: the
// tool comes out along +z, and the obstacle's top is the plane z = 0.
#include <TopoDS_Shape.hxx>

namespace touchstone {

TopoDS_Shape shoulderPeg(double diameter, double length);
/// A block with a hole through it.
TopoDS_Shape holedBlock(double diameter, double length);
/// A shaft with a flat at 0.35 diameters from its axis, and a hub with a hole of that section, larger by `clearance`
/// everywhere.
TopoDS_Shape flatShaft(double diameter, double length);
TopoDS_Shape flatHub(double diameter, double length, double clearance);
/// A shaft with straight keys, and its hub, whose section is larger by `clearance` everywhere.
TopoDS_Shape splineShaft(double diameter, double length, int keys);
TopoDS_Shape splineHub(double diameter, double length, int keys, double clearance);
/// A plug with two pins, in its locked position, and a socket with slots that turn by 45°.
TopoDS_Shape bayonetPlug(double diameter);
TopoDS_Shape bayonetSocket(double diameter, double clearance);
/// An involute spur gear on the z axis, from -`width` to 0, with a bore.
TopoDS_Shape spurGear(double module, int teeth, double width, double bore, double backlash);
/// A plate below z = -`width` with pins for two gears, the first on the z axis.
TopoDS_Shape gearPins(double distance, double width, double pin);
/// A screw with a cylindrical head above z = 0 whose thread is drawn as a cylinder.
TopoDS_Shape plainScrew(double diameter, double length);
/// A box below z = 0 with two rows of three holes, `pitch` apart.
TopoDS_Shape holedHousing(double hole, double depth, double pitch);
/// A ball about the origin, on a rod along +z if `rod`, its diameter, is above 0; and a block with a hollow half of a
/// ball, whose top is the plane through its center.
TopoDS_Shape ball(double diameter, double rod);
TopoDS_Shape ballSocket(double diameter);
/// A ring of round wire about z, and a shaft about z with a groove for it at z = 0.
TopoDS_Shape wireRing(double diameter, double wire);
TopoDS_Shape groovedShaft(double diameter, double wire);
/// A plate that has no plane of symmetry, with a hole.
TopoDS_Shape bracket();

}  // namespace touchstone
