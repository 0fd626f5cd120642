// Scenes with their parts, goals and motions.
#include <pybind11/stl.h>

#include <cmath>

#include "haptics/sandbox/measure/fit_check.hpp"
#include "haptics/sandbox/scene/baked_mesh.hpp"
#include "tools/python/bindings/bindings.hpp"

namespace touchstone::python {
namespace {

/// One of the bodies of a scene: 0 is the tool.
struct PartHandle {
    std::shared_ptr<const sandbox::HapticScene> scene;
    std::size_t body = 0;

    engine::Entity node() const { return body == 0 ? scene->roles.tool : scene->roles.obstacles[body - 1]; }
    std::string name() const { return scene->scene.registry.get<engine::Name>(node()).value; }
};

py::tuple meshArrays(const TriangleMesh& mesh) {
    Indices triangles({py::ssize_t(mesh.triangles.size()), py::ssize_t(3)});
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) triangles.mutable_at(i, k) = mesh.triangles[i][k];
    return py::make_tuple(toArray(std::span<const Vec3>(mesh.vertices)), triangles);
}

Numbers posesOf(const NamedMotion& motion, const Numbers& times) {
    std::vector<py::ssize_t> shape(times.shape(), times.shape() + times.ndim());
    shape.push_back(kPose);
    Numbers poses(shape);
    for (py::ssize_t i = 0; i < times.size(); ++i)
        writePose(motion.motion->at(times.data()[i]), poses.mutable_data() + i * kPose);
    return poses;
}

py::dict toolPoseOf(const SceneHandle& handle, const Numbers& pose) {
    const auto file = sandbox::toolFile(handle.scene());
    const sandbox::FileFrame frame = file.value_or(sandbox::FileFrame());
    const auto rows = sandbox::matrixInFile(frame, toPose(pose, "pose"));
    Numbers matrix({py::ssize_t(4), py::ssize_t(4)});
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j) matrix.mutable_at(i, j) = rows[i][j];
    py::dict dict;
    dict["matrix"] = matrix;
    dict["unit_m"] = frame.unit;
    dict["frame"] = file ? "file" : "scene";
    return dict;
}

py::object roomDict(const sandbox::HapticScene& scene, const std::optional<sandbox::FitRoom>& room) {
    if (!room) return py::none();
    py::dict dict;
    dict["clearance_mm"] = room->clearance;
    dict["as_placed_mm"] = room->asPlaced;
    dict["before_goal_mm"] = room->depth;
    dict["obstacle"] = scene.world->obstacles[room->obstacle].name;
    dict["at_mm"] = toArray(room->p_W);
    dict["pose"] = toArray(room->X_WT);
    return dict;
}

py::dict fitOf(SceneHandle& handle, const std::optional<Settings>& given) {
    const Settings settings = settingsFor(handle, given);
    handle.world(settings);
    const auto scene = handle.shared();
    std::optional<sandbox::FitCheck> fit;
    {
        const py::gil_scoped_release free;
        fit = sandbox::checkFit(sandbox::fitQuestion(*scene), settings, [](double) { return noInterrupt(); });
    }
    if (!fit) raiseInterrupt();
    py::dict dict, advice;
    for (const auto& [key, value] : fit->advice) advice[py::str(key)] = value;
    dict["fits"] = fit->fits();
    dict["verdict"] = fit->verdict;
    dict["goal"] = roomDict(*scene, fit->goal);
    dict["least"] = roomDict(*scene, fit->least);
    dict["thread_rise"] = fit->thread ? py::cast(std::pair(fit->thread->least, fit->thread->most)) : py::none();
    dict["error_mm"] = fit->error;
    dict["geometry"] = fit->spheres ? "spheres" : "mesh";
    dict["settings"] = advice;
    return dict;
}

}  // namespace

SceneHandle::SceneHandle(const std::string& file, int leaves, bool trees) : leaves_(leaves) {
    if (leaves != 0 && (leaves < sandbox::kMinLeaves || leaves > TreeOptions::kMaxLeaves))
        throw std::invalid_argument("leaves must be from " + std::to_string(sandbox::kMinLeaves) + " to " +
                                    std::to_string(TreeOptions::kMaxLeaves) + ", or 0 for the scene's own");
    scene_ = open(file, trees);
}

std::shared_ptr<sandbox::HapticScene> SceneHandle::open(const std::filesystem::path& file, bool trees) const {
    sandbox::SceneOptions options;
    options.treeCache = sandbox::treeCacheFolder();
    options.progress = [](const sandbox::SceneStatus&) { return noInterrupt(); };
    options.leaves = leaves_;
    options.allTrees = trees;
    std::shared_ptr<sandbox::HapticScene> opened;
    try {
        const py::gil_scoped_release free;
        opened = std::make_shared<sandbox::HapticScene>(sandbox::openScene(file, options));
    } catch (const BuildCancelled&) {
        raiseInterrupt();
    }
    if (!opened->world) throw engine::SceneError(opened->scene.file.string() + ": " + opened->missing);
    return opened;
}

void SceneHandle::buildTrees() {
    if (!scene_->world->hasSpheres()) scene_ = open(scene_->scene.file, true);
}

std::shared_ptr<const World> SceneHandle::world(const Settings& settings) {
    if (geometryOf(settings) == Geometry::Spheres) buildTrees();
    return scene_->world;
}

SceneHandle& sceneOf(const py::object& scene) {
    if (py::isinstance<SceneHandle>(scene)) return scene.cast<SceneHandle&>();
    raise(PyExc_TypeError, "scene must be a Scene, as Scene(\"bunnies\"), not " +
                               py::type::of(scene).attr("__name__").cast<std::string>());
}

void bindScenes(py::module_& module) {
    py::class_<NamedMotion>(
        module, "Motion",
        "A motion of the tool. Call it with a time in ms, or an array of any shape, for poses (..., 7).")
        .def_readonly("name", &NamedMotion::name)
        .def_property_readonly("duration_ms", [](const NamedMotion& m) { return m.motion->duration(); })
        .def("__call__", posesOf, py::arg("time_ms"))
        .def(
            "poses",
            [](const NamedMotion& motion, double rate) {
                const double ticks = std::ceil(motion.motion->duration() * rate / 1000);
                if (!(rate > 0 && ticks < 1e8))
                    throw std::invalid_argument("rate_hz must be above 0, and give fewer than 100 million poses");
                // As the program reads it: up to the first tick at or after the end.
                Numbers times(py::ssize_t(ticks) + 1);
                for (py::ssize_t n = 0; n < times.size(); ++n) times.mutable_at(n) = double(n) * 1000 / rate;
                return posesOf(motion, times);
            },
            py::arg("rate_hz") = 1000.0,
            "The device poses (n, 7) of a whole run at this rate, as the program's demo device gives them.")
        .def("__repr__", [](const NamedMotion& m) {
            return "<Motion '" + m.name + "', " + std::to_string(std::lround(m.motion->duration())) + " ms>";
        });

    py::class_<GoalRegion>(module, "Goal",
                           "Where the tool should come to rest: a pose (7,) and how near, for how long.")
        .def_property_readonly("pose", [](const GoalRegion& g) { return toArray(g.X_WT); })
        .def_readonly("tolerance_mm", &GoalRegion::tolerance)
        .def_readonly("tolerance_rad", &GoalRegion::toleranceAngle)
        .def_readonly("hold_ms", &GoalRegion::hold)
        .def_readonly("depth_mm", &GoalRegion::depth, "Length of the hole along `out`; 0 where it is unknown.")
        .def_readonly("fold", &GoalRegion::fold, "Number of equivalent orientations about `out`; 0: all.")
        .def_property_readonly(
            "out", [](const GoalRegion& g) { return toArray(Vec3(g.X_WT.q * g.outAtGoal())); },
            "Unit direction (3,) out of the hole, scene axes.")
        .def(
            "distance", [](const GoalRegion& g, const Numbers& p) { return g.distance(toPose(p, "pose")); },
            py::arg("pose"), "Between the origins, mm.")
        .def(
            "angle", [](const GoalRegion& g, const Numbers& p) { return g.angle(toPose(p, "pose")); }, py::arg("pose"),
            "To the nearest equivalent orientation, rad.")
        .def(
            "contains", [](const GoalRegion& g, const Numbers& p) { return g.contains(toPose(p, "pose")); },
            py::arg("pose"), "Whether the pose is within both tolerances.");

    py::class_<PartHandle>(module, "Part", "The tool or an obstacle. Its own frame is that of its node, in mm.")
        .def_property_readonly("name", &PartHandle::name)
        .def_property_readonly(
            "mesh", [](const PartHandle& p) { return meshArrays(sandbox::bakedTriangles(p.scene->scene, p.node())); },
            "vertices (n, 3) in mm and triangles (m, 3), as in the file, in the part's own frame.")
        .def_property_readonly(
            "closed", [](const PartHandle& p) { return p.scene->defects[p.body].empty(); },
            "Whether its mesh is closed, so that it can be touched by it.")
        .def_property_readonly(
            "defect", [](const PartHandle& p) { return p.scene->defects[p.body]; },
            "What is wrong with its mesh, in words; empty if it is closed.")
        .def_property_readonly(
            "pose",
            [](const PartHandle& p) {
                return toArray(p.body == 0 ? p.scene->world->X_WT_start : p.scene->world->obstacles[p.body - 1].X_WO);
            },
            "Pose (7,) at the start, scene frame.")
        .def_property_readonly(
            "surface",
            [](const PartHandle& p) -> std::shared_ptr<Surface> {
                const World& world = *p.scene->world;
                // Python has no const; a Surface is immutable from there.
                return std::const_pointer_cast<Surface>(p.body == 0 ? world.tool.surface
                                                                    : world.obstacles[p.body - 1].part.surface);
            },
            "Its mesh as the tick touches it; None if it is not closed.")
        .def_property_readonly(
            "tree",
            [](const PartHandle& p) -> std::shared_ptr<SphereTree> {
                const World& world = *p.scene->world;
                return std::const_pointer_cast<SphereTree>(p.body == 0 ? world.tool.spheres
                                                                       : world.obstacles[p.body - 1].part.spheres);
            },
            "Its sphere tree; None unless the scene was opened with trees=True or something needed them.")
        .def("__repr__", [](const PartHandle& p) { return "<Part '" + p.name() + "'>"; });

    py::class_<SceneHandle>(module, "SceneFile", "A glTF scene that is ready to run.")
        .def(py::init<const std::string&, int, bool>(), py::arg("file"), py::kw_only(), py::arg("leaves") = 0,
             py::arg("trees") = false)
        .def_property_readonly("name", [](const SceneHandle& s) { return sandbox::sceneName(s.scene()); })
        .def_property_readonly("file", [](const SceneHandle& s) { return s.scene().scene.file.string(); })
        .def_property_readonly(
            "settings", [](const SceneHandle& s) { return s.scene().settings; }, "A copy of the scene's settings.")
        .def_property_readonly(
            "start", [](const SceneHandle& s) { return toArray(sandbox::startPose(s.scene())); },
            "Pose (7,) of the tool at the start.")
        .def_property_readonly("tool",
                               [](const SceneHandle& s) {
                                   return PartHandle{s.shared(), 0};
                               })
        .def_property_readonly("obstacles",
                               [](const SceneHandle& s) {
                                   std::vector<PartHandle> parts;
                                   for (std::size_t i = 0; i < s.scene().world->obstacles.size(); ++i)
                                       parts.push_back({s.shared(), i + 1});
                                   return parts;
                               })
        .def_property_readonly(
            "goal", [](const SceneHandle& s) { return s.scene().roles.goal; }, "None if the scene has none.")
        .def_property_readonly(
            "motions", [](const SceneHandle& s) { return s.scene().motions; }, "The first is the demonstration.")
        .def_property_readonly("warnings", [](const SceneHandle& s) { return s.scene().warnings; })
        .def(
            "tool_pose", toolPoseOf, py::arg("pose"),
            "The motion that takes the tool from its place in its file to a pose (7,) in the scene: a dict with matrix "
            "(4, 4), its unit_m, and frame: 'file', or 'scene' for a tool that has no file of its own.")
        .def("fit", fitOf, py::arg("settings") = py::none(),
             "Whether the tool fits where it should go, as `touchstone fit --json`: a dict with fits, verdict, the "
             "rooms `goal` and `least`, error_mm, geometry and settings to take instead.")
        .def("__repr__", [](const SceneHandle& s) { return "<Scene '" + sandbox::sceneName(s.scene()) + "'>"; });
}

}  // namespace touchstone::python
