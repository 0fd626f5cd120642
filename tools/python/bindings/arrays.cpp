#include "tools/python/bindings/arrays.hpp"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "haptics/sandbox/record/tick_fields.hpp"

namespace touchstone::python {
namespace {

std::string shapeWords(const std::vector<std::string>& sizes) {
    std::string words = "(";
    for (std::size_t i = 0; i < sizes.size(); ++i) words += (i > 0 ? ", " : "") + sizes[i];
    return words + (sizes.size() == 1 ? ",)" : ")");
}

template <class Write>
Numbers rowsOf(std::size_t count, py::ssize_t width, Write&& write) {
    Numbers array({py::ssize_t(count), width});
    for (std::size_t i = 0; i < count; ++i) write(i, array.mutable_data() + py::ssize_t(i) * width);
    return array;
}

/// Anything that NumPy makes an array of. Throws std::invalid_argument.
py::array arrayOf(const py::object& object, const std::string& name) {
    py::array array = py::array::ensure(object);
    if (array) return array;
    PyErr_Clear();
    throw std::invalid_argument(name + " must be an array");
}

/// Throws std::invalid_argument with this sentence unless the array is of whole numbers or empty.
Indices wholeNumbers(const py::array& array, const char* sentence) {
    const char kind = array.dtype().kind();
    if (array.size() > 0 && kind != 'i' && kind != 'u') throw std::invalid_argument(sentence);
    return Indices::ensure(array);
}

}  // namespace

void requireShape(const py::array& array, const std::vector<py::ssize_t>& shape, const std::string& name) {
    bool same = array.ndim() == py::ssize_t(shape.size());
    for (std::size_t i = 0; same && i < shape.size(); ++i)
        same = shape[i] < 0 || array.shape(py::ssize_t(i)) == shape[i];
    if (same) return;
    std::vector<std::string> wanted, found;
    for (const py::ssize_t size : shape) wanted.push_back(size < 0 ? "n" : std::to_string(size));
    for (py::ssize_t i = 0; i < array.ndim(); ++i) found.push_back(std::to_string(array.shape(i)));
    throw std::invalid_argument(name + " must have the shape " + shapeWords(wanted) + ", not " + shapeWords(found));
}

Pose poseAt(const double* p) { return {Vec3(p[0], p[1], p[2]), Quat(p[3], p[4], p[5], p[6])}; }

void writePose(const Pose& pose, double* to) {
    const double seven[] = {pose.p.x(), pose.p.y(), pose.p.z(), pose.q.w(), pose.q.x(), pose.q.y(), pose.q.z()};
    std::copy_n(seven, kPose, to);
}

void writeWrench(const Wrench& wrench, double* to) {
    for (int k = 0; k < 3; ++k) to[k] = wrench.force[k], to[k + 3] = wrench.torque[k];
}

Pose toPose(const Numbers& array, const std::string& name) {
    requireShape(array, {kPose}, name);
    Pose pose = poseAt(array.data());
    if (!pose.isValid() || std::abs(pose.q.norm() - 1) > 1e-3)
        throw std::invalid_argument(name +
                                    " is no pose: it needs x, y, z in mm, each below 1 km, and a quaternion qw, "
                                    "qx, qy, qz of length 1");
    pose.q.normalize();
    return pose;
}

std::vector<Pose> toPoses(const Numbers& array, const std::string& name, py::ssize_t count) {
    requireShape(array, {count, kPose}, name);
    std::vector<Pose> poses;
    for (py::ssize_t i = 0; i < array.shape(0); ++i) poses.push_back(poseAt(array.data(i, 0)));
    return poses;
}

Vec6 toVec6(const Numbers& array, const std::string& name) {
    requireShape(array, {6}, name);
    return Eigen::Map<const Vec6>(array.data());
}

Numbers toArray(const Pose& pose) {
    Numbers array(kPose);
    writePose(pose, array.mutable_data());
    return array;
}

Numbers toArray(const Wrench& wrench) {
    Numbers array(kWrench);
    writeWrench(wrench, array.mutable_data());
    return array;
}

Numbers toArray(const Vec3& vector) { return Numbers(3, vector.data()); }
Numbers toArray(const Vec6& vector) { return Numbers(6, vector.data()); }

Numbers toArray(std::span<const Pose> poses) {
    return rowsOf(poses.size(), kPose, [&](std::size_t i, double* to) { writePose(poses[i], to); });
}

Numbers toArray(std::span<const Vec3> vectors) {
    return rowsOf(vectors.size(), 3, [&](std::size_t i, double* to) { std::copy_n(vectors[i].data(), 3, to); });
}

TriangleMesh toMesh(const Numbers& vertices, const py::object& faces) {
    const py::array indices = arrayOf(faces, "triangles");
    requireShape(vertices, {-1, 3}, "vertices");
    requireShape(indices, {-1, 3}, "triangles");
    const Indices triangles = wholeNumbers(indices, "triangles must be indices of vertices, whole numbers");
    TriangleMesh mesh;
    for (py::ssize_t i = 0; i < vertices.shape(0); ++i)
        mesh.vertices.emplace_back(Eigen::Map<const Vec3>(vertices.data(i, 0)));
    for (py::ssize_t i = 0; i < triangles.shape(0); ++i) {
        auto& corners = mesh.triangles.emplace_back();
        for (py::ssize_t k = 0; k < 3; ++k) {
            const std::int64_t corner = triangles.at(i, k);
            if (corner < 0 || corner >= vertices.shape(0))
                throw std::invalid_argument("triangles[" + std::to_string(i) + "] names vertex " +
                                            std::to_string(corner) + " of " + std::to_string(vertices.shape(0)));
            corners[std::size_t(k)] = std::uint32_t(corner);
        }
    }
    return mesh;
}

std::vector<std::size_t> chosenWorlds(const py::object& worlds, std::size_t count) {
    std::vector<std::size_t> chosen;
    if (worlds.is_none()) {
        for (std::size_t i = 0; i < count; ++i) chosen.push_back(i);
        return chosen;
    }
    const py::array array = arrayOf(worlds, "worlds");
    if (array.dtype().kind() == 'b') {
        requireShape(array, {py::ssize_t(count)}, "a mask of worlds");
        const py::array_t<bool> mask(array);
        for (std::size_t i = 0; i < count; ++i)
            if (mask.at(py::ssize_t(i))) chosen.push_back(i);
        return chosen;
    }
    requireShape(array, {-1}, "worlds");
    const Indices indices = wholeNumbers(array, "worlds must be indices (m,), whole numbers, or a mask of booleans");
    std::vector<bool> seen(count);
    for (py::ssize_t i = 0; i < indices.size(); ++i) {
        const std::int64_t index = indices.at(i);
        const std::string name = std::to_string(index);
        if (index < 0 || index >= std::int64_t(count))
            throw py::index_error("there is no world " + name + " in a batch of " + std::to_string(count));
        if (seen[std::size_t(index)]) throw std::invalid_argument("worlds names world " + name + " twice");
        seen[std::size_t(index)] = true;
        chosen.push_back(std::size_t(index));
    }
    return chosen;
}

py::dtype tickType() {
    py::list fields;
    for (const sandbox::TickField& field : sandbox::tickFields())
        fields.append(py::make_tuple(field.name, field.type()));
    return py::dtype::from_args(fields);
}

py::array ticksArray(std::span<const RecordedTick> ticks) {
    py::array rows(tickType(), std::vector<py::ssize_t>{py::ssize_t(ticks.size())});
    auto* to = static_cast<char*>(rows.mutable_data());
    for (std::size_t i = 0; i < ticks.size(); ++i) sandbox::packTick(ticks[i], to + i * sandbox::tickRowBytes());
    return rows;
}

py::object fromJson(const std::string& text) { return py::module_::import("json").attr("loads")(text); }

bool noInterrupt() {
    const py::gil_scoped_acquire lock;
    return PyErr_CheckSignals() == 0;
}

void raiseInterrupt() { throw py::error_already_set(); }

void raise(PyObject* type, const std::string& sentence) {
    PyErr_SetString(type, sentence.c_str());
    throw py::error_already_set();
}

}  // namespace touchstone::python
