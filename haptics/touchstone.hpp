#pragma once
// The door of the library: haptic rendering of rigid contact for another program, in one header.
//
//     Part        a rigid part, made from triangles
//     World       a tool and its obstacles, which are parts
//     Settings    everything that a user can change
//     TickState   the memory of the tick
//     step        one tick: from a device pose to a tool pose and a wrench
//     TickRecord  its result
//     Device      gives the pose of a hand and takes the wrench
//     HapticLoop  a thread that reads a device, steps and writes the device, a thousand times a second
//
// Units are mm, N, mN·m, rad and ms. X_WT is the pose of frame T in frame W, and p_TC the point C in frame T. An
// installed copy is one file without other headers of the project. It has no SIMD type: every processor of x86-64 has
// the same layouts, so a program may be compiled with other options than the library.
#include "haptics/math/rigid.hpp"

#include "haptics/surface/part.hpp"

#include "haptics/loop/settings.hpp"

#include "haptics/loop/world.hpp"

#include "haptics/loop/tick.hpp"

#include "haptics/device/device.hpp"

#include "haptics/loop/haptic_loop.hpp"
