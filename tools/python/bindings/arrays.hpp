#pragma once
// NumPy arrays and the values of the core. A pose is x, y, z (mm), qw, qx, qy, qz; a wrench is force (N), torque
// (mN·m).
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <span>
#include <string>
#include <vector>

#include "haptics/builder/triangle_mesh.hpp"
#include "haptics/loop/step.hpp"

namespace touchstone::python {

namespace py = pybind11;

/// Any numbers, converted to double where they are of another type.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Indices = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;

inline constexpr py::ssize_t kPose = 7, kWrench = 6;

/// Throws std::invalid_argument, "NAME must have the shape (n, 7), not (3,)", unless the shape is that; -1: any size.
void requireShape(const py::array& array, const std::vector<py::ssize_t>& shape, const std::string& name);

/// From seven numbers, which are not checked: the tick does.
Pose poseAt(const double* seven);
void writePose(const Pose& pose, double* seven);
void writeWrench(const Wrench& wrench, double* six);

/// Takes shape (7,), valid and with a unit quaternion, or throws std::invalid_argument.
Pose toPose(const Numbers& array, const std::string& name);
/// Takes shape (n, 7), unchecked as the tick takes them.
std::vector<Pose> toPoses(const Numbers& array, const std::string& name, py::ssize_t count = -1);
Vec6 toVec6(const Numbers& array, const std::string& name);

Numbers toArray(const Pose& pose);
Numbers toArray(const Wrench& wrench);
Numbers toArray(const Vec3& vector);
Numbers toArray(const Vec6& vector);
Numbers toArray(std::span<const Pose> poses);
Numbers toArray(std::span<const Vec3> vectors);

/// Throws std::invalid_argument for wrong shapes, corners that are no vertex, and coordinates that are not finite.
TriangleMesh toMesh(const Numbers& vertices, const py::object& triangles);

/// Worlds that a user chose: None: all `count`; a mask (count,) of truth values; or indices (m,), each once.
/// Throws std::invalid_argument, or IndexError for a world that is not there.
std::vector<std::size_t> chosenWorlds(const py::object& worlds, std::size_t count);

/// The NumPy type of a tick's row, as in recordings.
py::dtype tickType();
/// Rows of that type.
py::array ticksArray(std::span<const RecordedTick> ticks);

/// JSON text as Python objects.
py::object fromJson(const std::string& text);

/// For progress callbacks of long work without the interpreter lock: false after Ctrl-C, which then raises
/// KeyboardInterrupt when the work is left by raiseInterrupt().
bool noInterrupt();
/// For work that ends by an exception.
struct Interrupt {};
[[noreturn]] void raiseInterrupt();

/// Raises an exception of Python with one sentence.
[[noreturn]] void raise(PyObject* type, const std::string& sentence);

}  // namespace touchstone::python
