// Surfaces and sphere trees from arrays.
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <cmath>
#include <thread>

#include "haptics/builder/tree_builder.hpp"
#include "haptics/builder/tree_check.hpp"
#include "haptics/builder/tree_file.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "haptics/surface/part.hpp"
#include "haptics/surface/surface_distance.hpp"
#include "haptics/surface/surface_overlap.hpp"
#include "tools/python/bindings/bindings.hpp"

namespace touchstone::python {
namespace {

std::shared_ptr<Surface> surfaceOf(const Numbers& vertices, const py::object& triangles) {
    const TriangleMesh mesh = toMesh(vertices, triangles);
    const py::gil_scoped_release free;
    // Python has no const; a Surface is immutable from there.
    return std::const_pointer_cast<Surface>(Part::fromTriangles(mesh).surface);
}

/// measure(point, i) for each point of (n, 3).
template <class T, class Measure>
py::array_t<T> forPoints(const Numbers& points, Measure&& measure) {
    requireShape(points, {-1, 3}, "points");
    for (py::ssize_t i = 0; i < points.size(); ++i)
        if (!std::isfinite(points.data()[i]))
            throw std::invalid_argument("points[" + std::to_string(i / 3) + "] is not finite");
    py::array_t<T> result(points.shape(0));
    T* to = result.mutable_data();
    const py::gil_scoped_release free;
    for (py::ssize_t i = 0; i < points.shape(0); ++i) to[i] = measure(Vec3(Eigen::Map<const Vec3>(points.data(i, 0))));
    return result;
}

py::object nearest(const Surface& self, const Surface& tool, const Numbers& pose, double atMost) {
    const Pose X = toPose(pose, "pose");
    std::optional<NearestPoints> points;
    {
        const py::gil_scoped_release free;
        points = nearestPoints(tool, self, X, atMost);
    }
    if (!points) return py::none();
    return py::make_tuple(points->distance(), toArray(points->onObstacle), toArray(points->onTool));
}

std::shared_ptr<SphereTree> buildTree(const Numbers& vertices, const py::object& triangles, int leaves, double maxError,
                                      const std::string& quality, const std::string& interior, std::uint64_t seed,
                                      int threads) {
    TreeOptions options{.leaves = leaves, .maxError = maxError, .seed = seed};
    if (leaves < 1 || leaves > TreeOptions::kMaxLeaves)
        throw std::invalid_argument("leaves must be from 1 to " + std::to_string(TreeOptions::kMaxLeaves));
    if (!(maxError >= 0 && std::isfinite(maxError))) throw std::invalid_argument("max_error_mm must be from 0");
    if (quality != "fast" && quality != "best") throw std::invalid_argument("quality must be fast or best");
    if (interior != "shell" && interior != "solid") throw std::invalid_argument("interior must be shell or solid");
    options.quality = quality == "best" ? TreeQuality::Best : TreeQuality::Fast;
    options.interior = interior == "solid" ? Interior::Solid : Interior::Shell;
    options.threads = threads > 0 ? threads : int(std::max(1u, std::thread::hardware_concurrency()));
    const TriangleMesh mesh = toMesh(vertices, triangles);
    try {
        const py::gil_scoped_release free;
        return std::make_shared<SphereTree>(
            buildSphereTree(mesh, options, [](const BuildStatus&) { return noInterrupt(); }));
    } catch (const BuildCancelled&) {
        raiseInterrupt();
    }
}

void save(const SphereTree& tree, const std::filesystem::path& file) {
    const std::filesystem::path folder = std::filesystem::absolute(file).parent_path();
    if (!std::filesystem::is_directory(folder))
        raise(PyExc_FileNotFoundError,
              "there is no folder '" + folder.string() + "' for the sphere tree: make it first");
    try {
        saveTree(tree, file);
    } catch (const std::runtime_error& error) {
        raise(PyExc_OSError, error.what());
    }
}

Numbers leavesOf(const SphereTree& tree) {
    Numbers leaves({py::ssize_t(tree.leafCount()), py::ssize_t(4)});
    for (int i = 0; i < tree.leafCount(); ++i) {
        const Sphere s = tree.leaf(i);
        const float four[] = {s.x, s.y, s.z, s.r};
        std::copy_n(four, 4, leaves.mutable_data(i, 0));
    }
    return leaves;
}

py::dict certificateOf(const SphereTree& tree) {
    const TreeCertificate& c = tree.certificate;
    py::dict dict;
    dict["protrusion_mm"] = c.protrusion;
    dict["diagonal_mm"] = c.diagonal;
    dict["hollow_mm"] = c.hollow < 0 ? py::object(py::none()) : py::object(py::float_(c.hollow));
    dict["covered"] = c.covered;
    dict["closed"] = c.closed;
    dict["note"] = c.note;
    return dict;
}

}  // namespace

void bindShapes(py::module_& module) {
    py::class_<Surface, std::shared_ptr<Surface>>(module, "Surface", R"(A closed mesh as the tick touches it.

Surface(vertices (n, 3) in mm, triangles (m, 3)) repairs the mesh as scenes do: it joins corners, orders orientation.
ValueError says what is open. In its methods another surface stands at a pose (7,) in the frame of this one.)")
        .def(py::init(&surfaceOf), py::arg("vertices"), py::arg("triangles"))
        .def_property_readonly(
            "mesh",
            [](const Surface& s) {
                Indices triangles({py::ssize_t(s.features.faces.size()), py::ssize_t(3)});
                for (std::size_t i = 0; i < s.features.faces.size(); ++i)
                    for (std::size_t k = 0; k < 3; ++k) triangles.mutable_at(i, k) = s.features.faces[i].points[k];
                return py::make_tuple(toArray(std::span<const Vec3>(s.features.points)), triangles);
            },
            "vertices (n, 3) and triangles (m, 3), repaired, counter-clockwise seen from outside.")
        .def_property_readonly("faces", [](const Surface& s) { return s.features.faces.size(); })
        .def_property_readonly("convex_edges", [](const Surface& s) { return s.features.edges.size(); })
        .def_property_readonly(
            "tips", [](const Surface& s) { return s.features.vertices.size(); },
            "Vertices that can touch another part first.")
        .def(
            "overlaps",
            [](const Surface& s, const Surface& other, const Numbers& pose) {
                return overlap(other, s, toPose(pose, "pose"));
            },
            py::arg("other"), py::arg("pose"))
        .def(
            "depth",
            [](const Surface& s, const Surface& other, const Numbers& pose) {
                const Pose X = toPose(pose, "pose");
                const py::gil_scoped_release free;
                return overlapDepth(other, s, X);
            },
            py::arg("other"), py::arg("pose"), "Greatest depth of one in the other, mm; 0 without overlap.")
        .def("nearest", nearest, py::arg("other"), py::arg("pose"), py::arg("at_most") = 1e30,
             "Distance (mm) and the nearest points on this and on the other surface (3,), in the frame of this one; "
             "None if they are farther apart than at_most.")
        .def(
            "contains",
            [](const Surface& s, const Numbers& points) {
                return forPoints<bool>(points, [&](const Vec3& p) { return isInside(s, p); });
            },
            py::arg("points"), "Whether points (n, 3) are inside.")
        .def(
            "distance",
            [](const Surface& s, const Numbers& points) {
                return forPoints<double>(points, [&](const Vec3& p) { return distanceTo(s, p); });
            },
            py::arg("points"), "Distance (n,) of points (n, 3) from the surface, inside or outside, mm.")
        .def("__repr__", [](const Surface& s) { return "<Surface: " + sandbox::meshWords(s) + ">"; });

    py::class_<SphereTree, std::shared_ptr<SphereTree>>(module, "SphereTree", R"(Spheres that cover a mesh, as a tree.

SphereTree(vertices, triangles, leaves=4096, max_error_mm=0, quality="fast", interior="shell", seed=1, threads=0): at most
`leaves` spheres of least protrusion, or as many as a protrusion of max_error_mm needs. The same arguments give the same tree.)")
        .def(py::init(&buildTree), py::arg("vertices"), py::arg("triangles"), py::arg("leaves") = 4096,
             py::arg("max_error_mm") = 0.0, py::kw_only(), py::arg("quality") = "fast", py::arg("interior") = "shell",
             py::arg("seed") = 1, py::arg("threads") = 0)
        .def_static(
            "load", [](const std::filesystem::path& file) { return std::make_shared<SphereTree>(loadTree(file)); },
            py::arg("file"), "Reads a tree that save() or `touchstone tree` wrote.")
        .def("save", save, py::arg("file"), "Writes it for load() and `touchstone tree check`.")
        .def_property_readonly("leaves", leavesOf, "The leaves (n, 4): center and radius, mm.")
        .def_property_readonly(
            "certificate", certificateOf,
            "What is proven: protrusion_mm, diagonal_mm, hollow_mm (None: not measured), covered, closed, note.")
        .def(
            "refute",
            [](const SphereTree& tree, const Numbers& vertices, const py::object& triangles) {
                const TriangleMesh mesh = toMesh(vertices, triangles);
                const py::gil_scoped_release free;
                return refuteCertificate(tree, mesh);
            },
            py::arg("vertices"), py::arg("triangles"),
            "One sentence about the first claim of the certificate that does not hold for this mesh; empty if all "
            "hold.")
        .def("__len__", &SphereTree::leafCount)
        .def("__repr__", [](const SphereTree& tree) { return "<SphereTree: " + sandbox::words(tree) + ">"; });
}

}  // namespace touchstone::python
