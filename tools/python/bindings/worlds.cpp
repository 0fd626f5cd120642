// One world that is stepped, and thousands of the same scene.
#include <pybind11/stl.h>

#include <atomic>
#include <thread>
#include <variant>

#include "haptics/builder/workers.hpp"
#include "haptics/loop/distances.hpp"
#include "haptics/surface/surface_overlap.hpp"
#include "tools/python/bindings/bindings.hpp"

namespace touchstone::python {
namespace {

/// A tool among its obstacles, and where both are.
class Copy {
  public:
    Copy(std::shared_ptr<const World> world, const Settings& settings) : world_(std::move(world)), settings_(settings) {
        const PagesOnDemand little;  // nobody waits for this tick
        state_ = std::make_unique<TickState>(*world_);
        reset(world_->X_WT_start);
    }

    /// Tool and device at X_WT at rest, obstacles at their start.
    void reset(const Pose& X_WT) {
        std::vector<Pose> X_WO;
        for (const Obstacle& obstacle : world_->obstacles) X_WO.push_back(obstacle.X_WO);
        state_->begin({.X_WT = X_WT, .X_WT_device = X_WT}, X_WO);
        tick_ = {};
        tick_.X_WT = tick_.X_WT_device = X_WT;
    }

    const TickRecord& step(const Pose& X_WT_device, std::span<const Pose> X_WO = {}) noexcept {
        return tick_ = touchstone::step(*world_, settings_, {X_WT_device, state_->nextMove(X_WO)}, *state_);
    }

    /// Whether the tick would find an overlap with the tool at X_WT: see kOverlapping.
    bool overlaps(const Pose& X_WT) const { return startsInside(*world_, X_WT, state_->obstacles(), settings_); }

    std::atomic<bool>& taken() { return *taken_; }
    const World& world() const { return *world_; }
    const Settings& settings() const { return settings_; }
    /// Throws std::invalid_argument if they contradict each other or touch sphere trees that the world lacks.
    void set(const Settings& settings) {
        if (const std::string wrong = checkSettings(settings); !wrong.empty()) throw std::invalid_argument(wrong);
        if (geometryOf(settings) == Geometry::Spheres && !world_->hasSpheres())
            throw std::invalid_argument("this world was made without sphere trees: make a World with these settings");
        settings_ = settings;
    }
    const TickState& state() const { return *state_; }
    const TickRecord& tick() const { return tick_; }
    RecordedTick recorded() const { return recordedTick(*state_, tick_); }

  private:
    std::shared_ptr<const World> world_;
    std::unique_ptr<TickState> state_;
    Settings settings_;
    TickRecord tick_;
    std::unique_ptr<std::atomic<bool>> taken_ = std::make_unique<std::atomic<bool>>(false);
};

/// While it lives, no other thread of Python steps or resets the same worlds.
class Turn {
  public:
    explicit Turn(std::atomic<bool>& taken) : taken_(taken) {
        if (taken_.exchange(true))
            raise(PyExc_RuntimeError, "another thread is stepping this at the moment: give each thread its own");
    }
    ~Turn() { taken_ = false; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

  private:
    std::atomic<bool>& taken_;
};

/// The device poses are checked only by the tick, as in the program.
py::tuple stepOne(Copy& copy, const Numbers& device, const std::optional<Numbers>& obstacles) {
    const Turn turn(copy.taken());
    requireShape(device, {kPose}, "device");
    std::vector<Pose> X_WO;
    if (obstacles) X_WO = toPoses(*obstacles, "obstacles", py::ssize_t(copy.world().obstacles.size()));
    const TickRecord& tick = copy.step(poseAt(device.data()), X_WO);
    return py::make_tuple(toArray(tick.X_WT), toArray(tick.wrench_o));
}

py::array runOne(Copy& copy, const Numbers& devices) {
    const Turn turn(copy.taken());
    const std::vector<Pose> poses = toPoses(devices, "devices");
    std::vector<RecordedTick> ticks;
    ticks.reserve(poses.size());
    bool interrupted = false;
    {
        const py::gil_scoped_release free;
        for (std::size_t i = 0; i < poses.size() && !interrupted; ++i) {
            copy.step(poses[i]);
            ticks.push_back(copy.recorded());
            interrupted = i % 1024 == 1023 && !noInterrupt();
        }
    }
    if (interrupted) raiseInterrupt();
    return ticksArray(ticks);
}

Pose poseOr(const std::optional<Numbers>& pose, const Pose& otherwise) {
    return pose ? toPose(*pose, "pose") : otherwise;
}

class Batch {
  public:
    Batch(const py::object& sceneObject, std::int64_t worlds,
          const std::variant<std::monostate, Settings, std::vector<Settings>>& given, int threads) {
        SceneHandle& scene = sceneOf(sceneObject);
        if (worlds < 1) throw std::invalid_argument("a batch needs at least one world");
        const auto count = std::size_t(worlds);
        const auto* each = std::get_if<std::vector<Settings>>(&given);
        if (each && each->size() != count)
            throw std::invalid_argument("settings has " + std::to_string(each->size()) + " entries for " +
                                        std::to_string(count) + " worlds");
        const auto* one = std::get_if<Settings>(&given);
        for (std::size_t i = 0; i < count; ++i) {
            const Settings settings = settingsFor(scene, each  ? std::optional((*each)[i])
                                                         : one ? std::optional(*one)
                                                               : std::nullopt);
            // All share what a scene is made of; one that needs the trees makes them for all.
            copies_.emplace_back(scene.world(settings), settings);
        }
        const unsigned cores = std::max(1u, std::thread::hardware_concurrency());
        threads_ = threads > 0 ? threads : int(cores);
    }

    std::size_t size() const { return copies_.size(); }

    py::array_t<bool> reset(const std::optional<Numbers>& poses, const py::object& worlds) {
        const Turn turn(taken_);
        const std::vector<std::size_t> chosen = chosenWorlds(worlds, size());
        std::optional<std::vector<Pose>> to;
        if (poses) {
            requireShape(*poses, {py::ssize_t(chosen.size()), kPose}, "poses");
            to.emplace();
            for (std::size_t i = 0; i < chosen.size(); ++i)
                to->push_back(
                    toPose(Numbers(kPose, poses->data(py::ssize_t(i), 0)), "poses[" + std::to_string(i) + "]"));
        }
        py::array_t<bool> overlapping{py::ssize_t(chosen.size())};
        for (std::size_t i = 0; i < chosen.size(); ++i) {
            Copy& copy = copies_[chosen[i]];
            copy.reset(to ? (*to)[i] : copy.world().X_WT_start);
            overlapping.mutable_data()[i] = copy.overlaps(copy.tick().X_WT);
        }
        return overlapping;
    }

    py::tuple step(const Numbers& devices) {
        requireShape(devices, {py::ssize_t(size()), kPose}, "devices");
        Numbers poses({py::ssize_t(size()), kPose}), wrenches({py::ssize_t(size()), kWrench});
        advance(devices.data(), 1, poses.mutable_data(), wrenches.mutable_data());
        return py::make_tuple(poses, wrenches);
    }

    py::tuple run(const Numbers& devices) {
        requireShape(devices, {-1, py::ssize_t(size()), kPose}, "devices");
        const py::ssize_t ticks = devices.shape(0);
        Numbers poses({ticks, py::ssize_t(size()), kPose}), wrenches({ticks, py::ssize_t(size()), kWrench});
        advance(devices.data(), std::size_t(ticks), poses.mutable_data(), wrenches.mutable_data());
        return py::make_tuple(poses, wrenches);
    }

    py::array ticks() const {
        std::vector<RecordedTick> all;
        for (const Copy& copy : copies_) all.push_back(copy.recorded());
        return ticksArray(all);
    }
    Numbers poses() const {
        std::vector<Pose> all;
        for (const Copy& copy : copies_) all.push_back(copy.tick().X_WT);
        return toArray(std::span<const Pose>(all));
    }

  private:
    /// All worlds by some ticks. Arrays are (ticks, worlds, ...). A core keeps a world for a stretch of ticks, so that
    /// its memory stays in the cache.
    void advance(const double* devices, std::size_t ticks, double* poses, double* wrenches) {
        const std::size_t n = size();
        const Turn turn(taken_);
        const std::size_t grain = std::max<std::size_t>(1, n / (8 * std::size_t(threads_)));
        const py::gil_scoped_release free;
        try {
            Workers(threads_, [] {
                if (!noInterrupt()) throw Interrupt{};
            }).eachRange(n, grain, [&](std::size_t first, std::size_t last) {
                for (std::size_t i = first; i < last; ++i)
                    for (std::size_t t = 0; t < ticks; ++t) {
                        if (t % 4096 == 4095 && !noInterrupt()) throw Interrupt{};
                        const std::size_t at = t * n + i;
                        const TickRecord& tick = copies_[i].step(poseAt(devices + at * kPose));
                        writePose(tick.X_WT, poses + at * kPose);
                        writeWrench(tick.wrench_o, wrenches + at * kWrench);
                    }
            });
        } catch (const Interrupt&) {
            const py::gil_scoped_acquire lock;
            raiseInterrupt();
        }
    }

    std::vector<Copy> copies_;
    int threads_;
    std::atomic<bool> taken_ = false;
};

constexpr const char* kWorldHelp =
    R"(A tool among its obstacles, stepped tick by tick: the program's tick without device and safety stage.

World(scene, settings=None): settings of the scene unless others are given. Each tick depends only on the poses given
since the last reset(), to the bit. Settings may be replaced at any time; nothing fades or ramps.)";

constexpr const char* kStepHelp =
    R"(One tick. device: where the device wants the tool, pose (7,). obstacles: where obstacles should move, poses (k, 7).

Returns the tool's pose (7,) and the wrench (6,) on the hand about the tool's origin, N and mN·m, scene axes. A device
pose that is not valid holds the tool without force; `tick` tells.)";

}  // namespace

void bindWorlds(py::module_& module) {
    py::class_<Copy>(module, "World", kWorldHelp)
        .def(py::init([](const py::object& sceneObject, const std::optional<Settings>& given) {
                 SceneHandle& scene = sceneOf(sceneObject);
                 const Settings settings = settingsFor(scene, given);
                 return std::make_unique<Copy>(scene.world(settings), settings);
             }),
             py::arg("scene"), py::arg("settings") = py::none())
        .def("step", stepOne, py::arg("device"), py::arg("obstacles") = py::none(), kStepHelp)
        .def("run", runOne, py::arg("devices"),
             "One tick for each of the device poses (n, 7). Returns their ticks as an array (n,) of `tick_type`, the "
             "columns of recordings.")
        .def(
            "reset",
            [](Copy& copy, const std::optional<Numbers>& pose) {
                const Turn turn(copy.taken());
                copy.reset(poseOr(pose, copy.world().X_WT_start));
                return copy.overlaps(copy.tick().X_WT);
            },
            py::arg("pose") = py::none(),
            "Tool and device at rest at this pose (7,), by default the scene's start; obstacles at their start. "
            "Returns True if the tool overlaps an obstacle there by more than the distance that is kept: it passes "
            "through "
            "what it is in until it is out, feels all else, and its ticks have Flag.OVERLAPPING.")
        .def_property(
            "settings", [](const Copy& copy) { return copy.settings(); }, &Copy::set,
            "A copy of the settings; assign to change them.")
        .def_property_readonly(
            "pose", [](const Copy& copy) { return toArray(copy.tick().X_WT); }, "Pose (7,) of the tool.")
        .def_property_readonly(
            "device", [](const Copy& copy) { return toArray(copy.tick().X_WT_device); },
            "The last valid device pose (7,).")
        .def_property_readonly(
            "wrench", [](const Copy& copy) { return toArray(copy.tick().wrench_o); },
            "Wrench (6,) of the last tick, as step() returns it.")
        .def_property_readonly(
            "obstacles", [](const Copy& copy) { return toArray(copy.state().obstacles()); },
            "Poses (k, 7) of the obstacles.")
        .def_property_readonly(
            "tick",
            [](const Copy& copy) -> py::object {
                const RecordedTick tick = copy.recorded();
                return ticksArray({&tick, 1})[py::int_(0)];
            },
            "Everything about the last tick: a record of `tick_type`.")
        .def(
            "penetration",
            [](const Copy& copy, const std::optional<Numbers>& pose) {
                PenetrationMeter meter(copy.world());
                return meter.depth(poseOr(pose, copy.tick().X_WT), copy.state().obstacles(),
                                   geometryOf(copy.settings()));
            },
            py::arg("pose") = py::none(),
            "Depth of the tool in obstacles at a pose, by default its own, mm; found apart from the tick. 0 without "
            "overlap.")
        .def(
            "clearance",
            [](const Copy& copy, const std::optional<Numbers>& pose, double atMost) {
                return trueClearance(copy.world(), poseOr(pose, copy.tick().X_WT), atMost, copy.state().obstacles(),
                                     geometryOf(copy.settings()));
            },
            py::arg("pose") = py::none(), py::arg("at_most") = 1e30,
            "Distance to the nearest obstacle, mm, at most `at_most`; 0 or less if they overlap.");

    py::class_<Batch>(module, "Batch",
                      R"(Many worlds of one scene, stepped together on all cores without the interpreter lock.

Batch(scene, count, settings=None, threads=0): settings for all, or a list of one for each. World i is the same, to the
bit, as a World that gets the same poses. threads=0: one for each core.)")
        .def(py::init<const py::object&, std::int64_t,
                      const std::variant<std::monostate, Settings, std::vector<Settings>>&, int>(),
             py::arg("scene"), py::arg("count"), py::arg("settings") = py::none(), py::arg("threads") = 0)
        .def("__len__", &Batch::size)
        .def("reset", &Batch::reset, py::arg("poses") = py::none(), py::arg("worlds") = py::none(),
             "As World.reset(), of all worlds or of those with these indices (m,) or in this mask (n,), each at its "
             "pose of "
             "(m, 7). Returns which of them (m,) overlap an obstacle.")
        .def(
            "_chosen", [](const Batch& batch, const py::object& worlds) { return chosenWorlds(worlds, batch.size()); },
            py::arg("worlds") = py::none())
        .def("step", &Batch::step, py::arg("devices"),
             "One tick of each world, device poses (n, 7). Returns poses (n, 7) and wrenches (n, 6).")
        .def("run", &Batch::run, py::arg("devices"),
             "Ticks of each world, device poses (t, n, 7). Returns poses (t, n, 7) and wrenches (t, n, 6). Faster than "
             "step(), since a core keeps a world for all its ticks.")
        .def_property_readonly("poses", &Batch::poses, "Poses (n, 7) of the tools.")
        .def_property_readonly("ticks", &Batch::ticks, "The last tick of each world, an array (n,) of `tick_type`.");
}

}  // namespace touchstone::python
