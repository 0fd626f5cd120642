// touchstone referee: the same device motions through Touchstone and through physics engines, scored by one judge.
#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "engine/view/image_file.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/loop/work_limits.hpp"
#include "haptics/math/statistics.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "haptics/surface/surface_distance.hpp"
#include "haptics/surface/surface_overlap.hpp"
#include "haptics/threads/rt_thread.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/csv.hpp"
#include "tools/touchstone/figures.hpp"
#include "tools/touchstone/referee/page.hpp"
#include "tools/touchstone/referee/passivity.hpp"
#include "tools/touchstone/referee/rigid_engine.hpp"
#include "tools/touchstone/scene_path.hpp"

namespace touchstone::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct RefereeCommand {
    fs::path out;
    std::string given;                 ///< a recording or a scene of the user; empty: the bundled motions
    std::string device;                ///< demo:NAME of that scene; empty: its first motion
    fs::path scene;                    ///< of a recording; empty: it is found
    double friction = 0;               ///< of it
    std::vector<std::string> motions;  ///< of the bundled ones; empty: all
    double seconds = 4;                ///< of each motion at most
    double limit = 120;                ///< s of processor time for a system and motion
    /// Rates at which the greatest stiffness that stays passive is measured, Hz.
    std::vector<int> rates{250, 500, 1000, 2000, 5000, 10'000, 20'000, 40'000};
};

/// A motion of a scene, or a recording.
struct JudgedMotion {
    std::string name, scene, motion;  ///< motion: empty for the first
    double friction;
    bool spheres;                   ///< its fit is wide enough for sphere trees
    std::optional<double> picture;  ///< s: the moment of the pictures; nothing: the middle
    std::optional<fs::path> recording = {};
};

const std::vector<JudgedMotion>& bundledMotions() {
    static const std::vector<JudgedMotion> motions{
        {"bunnies", "bunnies", "demonstration", 0, true, 2},
        {"bunnies-friction", "bunnies", "demonstration", 0.4, true, 2},
        {"teleport", "bunnies", "hard-05-teleport", 0, true, 1},
        {"teleport-friction", "bunnies", "hard-05-teleport", 0.4, true, 1},
        {"plate-1", "plate", "hard-04-plate-1", 0, true, 0.1},
        {"plate-10", "plate", "hard-04-plate-10", 0, true, 0.1},
        {"plate-10-friction", "plate", "hard-04-plate-10", 0.4, true, 0.1},
        {"wedge", "wedge", "hard-09-wedge", 0, true, 1},
        {"wedge-friction", "wedge", "hard-09-wedge", 0.4, true, 1},
        {"spline-0.2", "spline", "demonstration", 0, true, 3},
        {"spline-0.2-friction", "spline", "demonstration", 0.2, true, 3},
        {"spline-0.02", "spline-002", "demonstration", 0, false, 3},
        {"spline-0.02-friction", "spline-002", "demonstration", 0.2, false, 3},
        {"nut", "nut", "demonstration", 0, false, 3},
        {"nut-friction", "nut", "demonstration", 0.2, false, 3},
    };
    return motions;
}

/// A mode, geometry and solver of Touchstone.
struct Choice {
    std::string name;
    Settings settings;
};

constexpr std::string_view kDemo = "demo:";
constexpr int kRest = 300;        // ticks for which the device rests at the end
constexpr int kFiner = 8;         // ticks of the reference in one of the others
constexpr double kMass = 50;      // g of the tool in engines
constexpr double kMargin = 0.04;  // mm, Bullet's own; less in a close fit
constexpr int kDepths = 3;        // the depth is measured in one of this many ticks

/// What the hand would feel, as Touchstone defines it: springs between the device and the tool, at C.
Wrench springs(const Pose& X_WC, const Pose& device, const Settings& settings) {
    return {settings.stiffness * (X_WC.p - device.p),
            settings.torsion * logRotation((X_WC.q * device.q.conjugate()).normalized())};
}

struct JudgedTick {
    Pose X_WT;
    Wrench wrench;  ///< on the hand, about C
    double us = 0;  ///< thread CPU time
    double depth = 0;
    bool intersects = false;
};

struct JudgedRun {
    std::string system, note = {};
    double prepareMs = 0;
    std::vector<JudgedTick> ticks = {};
};

/// A scene with a motion of the device.
class Comparison {
  public:
    Comparison(const JudgedMotion& motion, const RefereeCommand& command) : what(motion), limit_(command.limit) {
        sandbox::SceneOptions options{.treeCache = sandbox::treeCacheFolder(), .progress = progressBar()};
        options.allTrees = motion.spheres;
        std::shared_ptr<const Motion> moved;
        std::optional<Settings> recorded;
        fs::path file;
        if (motion.recording) {
            file = sceneOfRecording(*motion.recording, command.scene);
            const sandbox::RecordedHand hand = sandbox::recordedHand(*motion.recording);
            moved = hand.motion;
            recorded = hand.changes.front().settings;
        } else {
            file = findScene(motion.scene);
        }
        scene = sandbox::openScene(file, options);
        if (!scene.missing.empty()) throw std::runtime_error(file.string() + ": " + scene.missing);
        for (const auto& [name, of] : scene.motions)
            if (!moved && (motion.motion.empty() || name == motion.motion)) moved = of;
        if (!moved)
            throw std::runtime_error(file.string() + " has no motion" +
                                     (motion.motion.empty() ? "" : " '" + motion.motion + "'") +
                                     ": give a recording, or the name of a motion as --device demo:NAME");
        for (std::size_t k = 0; k < world().obstacles.size(); ++k)
            if (!world().hasMeshes(static_cast<int>(k)))
                throw std::runtime_error(
                    file.string() +
                    ": only closed meshes can be judged, and the tool or an obstacle is open: `touchstone validate` "
                    "names it");
        settings = sandbox::withMode(recorded.value_or(scene.settings), Mode::Default);
        settings.rate = 1000;
        settings.solver = kExactSolver;
        settings.shadow = kNoSolver;
        settings.frictionSolver = kExactFrictionSolver;
        settings.geometry = Geometry::Mesh;
        settings.friction = motion.friction > 0;
        settings.frictionCoefficient = motion.friction;
        const double ms = std::min(command.seconds * 1000, moved->duration());
        for (int i = 0; i <= static_cast<int>(ms); ++i) device.push_back(moved->at(i));
        device.insert(device.end(), kRest, device.back());
    }

    /// Every geometry, mode and solver that can render it; the usual one first.
    std::vector<Choice> choices() const {
        std::vector<Choice> all;
        const auto add = [&](const std::string& name, const Settings& usual) {
            const std::string system = "Touchstone " + name;
            all.push_back({system, usual});
            if (usual.mode == Mode::Penalty) return;  // it has no solver
            const char* key = usual.friction ? "friction_solver" : "solver";
            for (const std::string& solver : settingChoices(key)) {
                Settings chosen = usual;
                setSetting(chosen, key, solver);
                if (solver != getSetting(usual, key) && keepRoundTripsInTick(chosen).empty())
                    all.push_back({system + " with " + solver, chosen});
            }
        };
        add("meshes", settings);
        if (!what.spheres) return all;
        add("spheres", sandbox::withGeometry(settings, Geometry::Spheres));
        if (settings.friction) return all;
        for (const auto& [name, mode] :
             {std::pair{"paper mode", Mode::Paper}, std::pair{"god-object mode", Mode::GodObject},
              std::pair{"penalty mode", Mode::Penalty}})
            add(name, sandbox::withMode(sandbox::withGeometry(settings, Geometry::Spheres), mode));
        return all;
    }

    const World& world() const { return *scene.world; }
    Pose center(const Pose& X_WT) const { return {X_WT * world().p_TC(), X_WT.q}; }

    /// Touchstone; as the reference, `finer` ticks for one of the others, and without a limit.
    JudgedRun touchstone(const Choice& choice, int finer = 1) const {
        JudgedRun run{.system = choice.name};
        Settings chosen = choice.settings;
        chosen.shadow = kNoSolver;
        chosen.rate *= finer;
        const double start = threadCpuMicroseconds();
        TickState state(world());
        run.prepareMs = (threadCpuMicroseconds() - start) / 1000;
        Pose last = device.front();
        for (const Pose& wanted : device) {
            const double began = threadCpuMicroseconds();
            const Vec6 moved = incrementBetween(last, wanted);
            TickRecord record;
            for (int k = 1; k <= finer; ++k) {
                const double share = double(k) / finer;
                const Pose input = k == finer ? wanted
                                              : Pose{last.p + share * moved.head<3>(),
                                                     (expRotation(share * moved.tail<3>()) * last.q).normalized()};
                record = step(world(), chosen, {.X_WT_device = input}, state);
            }
            const double us = threadCpuMicroseconds() - began;
            last = wanted;
            run.ticks.push_back({record.X_WT, record.wrench_C, us});
            if (finer == 1 && spent(start)) break;  // the others are judged by the whole reference
        }
        return run;
    }

    JudgedRun engine(const EngineInfo& info, int substeps) const {
        JudgedRun run{.system = std::string(info.name) + (substeps > 1 ? " 4 substeps" : "")};
        const double start = threadCpuMicroseconds();
        try {
            const double h = 1.0 / substeps, k = settings.stiffness, omega2 = k / kMass,
                         inertia = settings.torsion / omega2;
            EngineScene given{.mass = kMass, .inertia = inertia, .friction = what.friction, .step = h};
            given.margin = std::min(kMargin, clearance() / 4);
            given.tool = meshOf(*world().tool.surface, {-world().p_TC(), Quat::Identity()});
            for (const Obstacle& obstacle : world().obstacles)
                given.obstacles.push_back(meshOf(*obstacle.part.surface, obstacle.X_WO));
            given.X_WC = center(world().X_WT_start);
            const std::unique_ptr<RigidEngine> body = info.make(given);
            run.prepareMs = (threadCpuMicroseconds() - start) / 1000;
            Pose last = center(device.front());
            // Critical damping.
            const double c = 2 * std::sqrt(k * kMass), turning = 2 * std::sqrt(settings.torsion * inertia);
            for (const Pose& X_WT_device : device) {
                const double began = threadCpuMicroseconds();
                const Pose wanted = center(X_WT_device);
                const Vec6 speed = incrementBetween(last, wanted);  // in 1 ms
                for (int n = 1; n <= substeps; ++n) {
                    const double share = n * h;
                    const Pose at{last.p + share * speed.head<3>(),
                                  (expRotation(share * speed.tail<3>()) * last.q).normalized()};
                    const BodyState s = body->state();
                    const Wrench pull = springs(s.X_WC, at, settings);
                    body->step(c * (speed.head<3>() - s.v) - pull.force,
                               turning * (speed.tail<3>() - s.w) - pull.torque);
                }
                last = wanted;
                const double us = threadCpuMicroseconds() - began;
                const Pose X_WC = body->state().X_WC;
                if (!X_WC.isValid()) {
                    run.note = "no valid pose after " + std::to_string(run.ticks.size()) + " ticks";
                    break;
                }
                run.ticks.push_back({{X_WC.p - X_WC.q * world().p_TC(), X_WC.q}, springs(X_WC, wanted, settings), us});
                if (spent(start)) break;
            }
        } catch (const std::exception& e) {
            run.note = e.what();
        }
        return run;
    }

    /// Whether the meshes intersect, and how deep: for all systems the same code, on the meshes themselves.
    void judge(JudgedRun& run) const {
        for (JudgedTick& tick : run.ticks)
            for (const Obstacle& obstacle : world().obstacles) {
                const Pose X_OT = obstacle.X_WO.inverse() * tick.X_WT;
                if (!overlap(*world().tool.surface, *obstacle.part.surface, X_OT)) continue;
                tick.intersects = true;
                const bool measured = (&tick - run.ticks.data()) % kDepths == 0;  // it takes long
                if (measured)
                    tick.depth =
                        std::max(tick.depth, overlapDepth(*world().tool.surface, *obstacle.part.surface, X_OT, false));
            }
        if (run.ticks.size() < device.size() && run.note.empty())
            run.note = "stopped after " + std::to_string(run.ticks.size()) + " ticks: too slow";
    }

    /// One line of the table. `reference`: whose forces count as true.
    ordered_json row(const JudgedRun& run, const JudgedRun& reference) const {
        std::vector<double> us, errors;
        double depth = 0, energy = 0, least = 0;
        int intersecting = 0;
        const std::size_t ticks = run.ticks.size();
        for (std::size_t i = 0; i < ticks; ++i) {
            const JudgedTick& tick = run.ticks[i];
            us.push_back(tick.us);
            depth = std::max(depth, tick.depth);
            intersecting += tick.intersects;
            errors.push_back((tick.wrench.force - reference.ticks[i].wrench.force).norm());
            if (i > 0) {  // work of the hand on the device, against the mean force of both ticks
                const Vec6 move = incrementBetween(center(device[i - 1]), center(device[i]));
                const Wrench &a = run.ticks[i - 1].wrench, &b = tick.wrench;
                energy -= (a.force + b.force).dot(move.head<3>()) / 2 + (a.torque + b.torque).dot(move.tail<3>()) / 2;
                least = std::min(least, energy);
            }
        }
        const bool whole = ticks == device.size();
        ordered_json line{{"motion", what.name}, {"system", run.system}, {"ticks", ticks}};
        line["intersecting_percent"] = ticks ? ordered_json(100.0 * intersecting / double(ticks)) : nullptr;
        line["depth_mm"] = ticks ? ordered_json(depth) : nullptr;
        const auto& goal = scene.roles.goal;
        line["seated"] = goal && whole ? ordered_json(goal->contains(run.ticks.back().X_WT)) : nullptr;
        line["tunneled"] = whole ? ordered_json(tunneled(run, reference)) : nullptr;
        const auto share = [](std::vector<double>& values, double percent) {
            const auto found = percentile(values, percent);
            return found ? ordered_json(*found) : ordered_json();
        };
        line["force_error_p50_N"] = share(errors, 50);
        line["force_error_p99_N"] = share(errors, 99);
        line["rest_noise_N"] = whole ? ordered_json(noiseAtRest(run)) : nullptr;
        line["energy_created_mJ"] = ticks ? ordered_json(std::max(0.0, -least)) : nullptr;
        line["tick_p50_us"] = share(us, 50);
        line["tick_p999_us"] = share(us, 99.9);
        line["prepare_ms"] = run.prepareMs;
        line["note"] = run.note;
        return line;
    }

    void draw(const JudgedRun& run, const fs::path& file) const {
        const double middle = static_cast<double>(device.size() - kRest) / 2000;
        const auto at = std::min(static_cast<std::size_t>(what.picture.value_or(middle) * 1000), device.size() - 1);
        fs::remove(file);
        if (run.ticks.size() <= at) return;  // it was stopped before: all pictures are of one moment
        TickRecord record;
        record.X_WT = run.ticks[at].X_WT;
        record.X_WT_device = device[at];
        record.wrench_C = run.ticks[at].wrench;
        sandbox::ScenePicture picture;
        picture.width = 360;
        picture.height = 270;
        picture.display.section = true;
        picture.display.contacts = false;
        engine::writePng(file, sandbox::renderScene(scene, record, settings, picture));
    }

    const JudgedMotion what;
    sandbox::HapticScene scene;
    Settings settings;
    std::vector<Pose> device;  ///< X_WT of every tick

  private:
    bool spent(double start) const { return threadCpuMicroseconds() - start > 1e6 * limit_; }
    double clearance() const {
        const auto& goal = scene.roles.clearance;
        return goal ? *goal : 4 * kMargin;
    }
    static TriangleMesh meshOf(const Surface& surface, const Pose& X) {
        TriangleMesh mesh;
        for (const Vec3& p : surface.features.points) mesh.vertices.push_back(X * p);
        for (const auto& face : surface.features.faces) {
            const auto& c = face.points;
            mesh.triangles.push_back({std::uint32_t(c[0]), std::uint32_t(c[1]), std::uint32_t(c[2])});
        }
        return mesh;
    }
    /// At the end, the way from where the reference holds C to where the system has it crosses an obstacle.
    bool tunneled(const JudgedRun& run, const JudgedRun& reference) const {
        const Vec3 from = reference.ticks.back().X_WT * world().p_TC(), to = run.ticks.back().X_WT * world().p_TC();
        for (const Obstacle& obstacle : world().obstacles) {
            const Pose X_OW = obstacle.X_WO.inverse();
            const Vec3 a = X_OW * from, b = X_OW * to;
            const auto hit = firstHit(*obstacle.part.surface, a, b - a);
            if (hit && (*hit - a).norm() < (b - a).norm()) return true;
        }
        return false;
    }
    /// Root mean square of the force about its mean, in the last 100 ticks of rest.
    static double noiseAtRest(const JudgedRun& run) {
        constexpr std::size_t kLast = 100;
        Vec3 mean = Vec3::Zero();
        const std::span last(run.ticks.data() + run.ticks.size() - kLast, kLast);
        for (const JudgedTick& tick : last) mean += tick.wrench.force / kLast;
        double sum = 0;
        for (const JudgedTick& tick : last) sum += (tick.wrench.force - mean).squaredNorm() / kLast;
        return std::sqrt(sum);
    }
    const double limit_;
};

/// The greatest stiffness that stays passive, of the ball on the plate.
std::vector<ordered_json> passivityOf(const RefereeCommand& command) {
    const sandbox::HapticScene scene =
        sandbox::openScene(findScene("plate"), {.treeCache = sandbox::treeCacheFolder(), .progress = progressBar()});
    const std::vector<ordered_json> rows = greatestStiffness(*scene.world, scene.settings, command.rates);
    writeFile(command.out / "passivity.csv", "the table", toCsv(rows));
    std::printf("passive with a simulated hand\n");
    for (const ordered_json& row : rows)
        std::printf("  %6.0f Hz  %.3g N/mm, at rest up to %.3g N/mm\n", row["rate_Hz"].get<double>(),
                    row["passive_N_per_mm"].get<double>(), row["rests_N_per_mm"].get<double>());
    return rows;
}

/// What repeats the command, without --out.
std::string argumentsOf(const RefereeCommand& command) {
    std::string text;
    const auto add = [&](const std::string& option, const std::string& value) {
        text += (text.empty() ? "" : " ") + option + (option.empty() ? "" : " ") + sandbox::shellQuoted(value);
    };
    if (!command.given.empty()) add("", command.given);
    if (!command.device.empty()) add("--device", command.device);
    if (!command.scene.empty()) add("--scene", command.scene.string());
    if (command.friction > 0) add("--friction", shortNumber(command.friction));
    if (!command.motions.empty()) add("--motions", CLI::detail::join(command.motions, ","));
    if (command.seconds != RefereeCommand{}.seconds) add("--seconds", shortNumber(command.seconds));
    add("--limit", shortNumber(command.limit));
    if (command.rates != RefereeCommand{}.rates) add("--rates", CLI::detail::join(command.rates, ","));
    return text;
}

int referee(const RefereeCommand& command) {
    std::vector<JudgedMotion> motions;
    if (!command.given.empty()) {
        const fs::path path(command.given);
        JudgedMotion motion{.name = (path.has_filename() ? path : path.parent_path()).stem().string(),
                            .scene = command.given,
                            .motion = command.device.substr(std::min(command.device.size(), kDemo.size())),
                            .friction = command.friction,
                            .spheres = true,
                            .picture = {}};
        if (sandbox::isRecording(command.given)) motion.recording = command.given;
        if (motion.recording && !command.device.empty())
            throw UsageError("--device needs a scene: a recording contains its own motion");
        if (!command.device.empty() && !command.device.starts_with(kDemo))
            throw UsageError(
                "--device is demo:NAME here, a motion of the scene: record another device with `touchstone "
                "run --record` and give the recording");
        motions.push_back(motion);
    }
    for (const JudgedMotion& motion : bundledMotions())
        if (command.given.empty() &&
            (command.motions.empty() ||
             std::find(command.motions.begin(), command.motions.end(), motion.name) != command.motions.end()))
            motions.push_back(motion);
    makeFolder(command.out, "the comparison");
    if (engineTable().empty())
        std::printf(
            "The program was built without other engines, so only Touchstone is judged: install libbullet-dev, "
            "libode-dev "
            "or libmujoco-dev and build again\n");
    std::vector<ordered_json> rows;
    std::vector<std::string> names;
    for (const JudgedMotion& motion : motions) {
        const Comparison comparison(motion, command);
        names.emplace_back(motion.name);
        const std::vector<Choice> choices = comparison.choices();
        const JudgedRun reference = comparison.touchstone(choices.front(), kFiner);
        std::vector<JudgedRun> runs;
        for (const Choice& choice : choices) runs.push_back(comparison.touchstone(choice));
        for (const EngineInfo& info : engineTable())
            for (const int substeps : {1, 4}) runs.push_back(comparison.engine(info, substeps));
        std::printf("%s%s\n", motion.name.c_str(),
                    motion.friction > 0 ? (", friction " + shortNumber(motion.friction)).c_str() : "");
        for (JudgedRun& run : runs) {
            comparison.judge(run);
            rows.push_back(comparison.row(run, reference));
            const ordered_json& row = rows.back();
            std::printf(
                "  %-44s intersects %6s %%, %8s mm; seated %-3s tunneled %-3s force error %8s / %8s N, rest %8s N, "
                "%8s mJ; %8s / %8s µs  %s\n",
                run.system.c_str(), tableCell(row["intersecting_percent"]).c_str(), tableCell(row["depth_mm"]).c_str(),
                tableCell(row["seated"]).c_str(), tableCell(row["tunneled"]).c_str(),
                tableCell(row["force_error_p50_N"]).c_str(), tableCell(row["force_error_p99_N"]).c_str(),
                tableCell(row["rest_noise_N"]).c_str(), tableCell(row["energy_created_mJ"]).c_str(),
                tableCell(row["tick_p50_us"]).c_str(), tableCell(row["tick_p999_us"]).c_str(), run.note.c_str());
            std::fflush(stdout);
            const auto is = [&](const char* word) { return run.system.find(word) != std::string::npos; };
            if ((motion.friction == 0 || !command.given.empty()) && !is(" with ") && !is(" substeps"))
                comparison.draw(run, command.out / pictureName(motion.name, run.system));
        }
        writeFile(command.out / "referee.csv", "the table", toCsv(rows));
    }
    std::vector<ordered_json> passivity;
    if (command.given.empty()) passivity = passivityOf(command);
    writeRefereePage({command.out, argumentsOf(command), command.limit, rows, passivity,
                      drawFigures("referee", command.out), names});
    return kOk;
}

}  // namespace

void addReferee(CLI::App& program, Action& action) {
    const auto options = std::make_shared<RefereeCommand>();
    CLI::App* command = addCommand(program, "referee", "Judge Touchstone and physics engines on the same motions",
                                   "Examples:\n  touchstone referee --out docs/referee\n"
                                   "  touchstone referee --out judged --motions plate-10,wedge\n"
                                   "  touchstone run part.glb --record push && touchstone referee push --out judged\n");
    command
        ->add_option("--out", options->out, "folder for table, figures and pictures; the page is beside it, as DIR.md")
        ->required();
    CLI::Option* given =
        command->add_option("RECORDING|SCENE", options->given,
                            "folder that `touchstone run --record` wrote, or a scene (default: motions "
                            "of the bundled scenes)");
    command->add_option("--device", options->device, "demo:NAME: the motion of the scene (default: its first)")
        ->needs(given);
    addRecordedScene(*command, options->scene);
    command
        ->add_option("--friction", options->friction,
                     "coefficient of friction of every pair of its parts (default: none, whatever their materials)")
        ->needs(given)
        ->check(within(0, 10));
    std::vector<std::string> names;
    for (const JudgedMotion& motion : bundledMotions()) names.emplace_back(motion.name);
    command->add_option("--motions", options->motions, "comma-separated (default: all)")
        ->delimiter(',')
        ->excludes(given)
        ->check(CLI::IsMember(names));
    command->add_option("--seconds", options->seconds, "of each motion at most")
        ->check(durationInSeconds())
        ->capture_default_str();
    command->add_option("--limit", options->limit, "seconds of processor time for a system and a motion")
        ->check(durationInSeconds())
        ->capture_default_str();
    command
        ->add_option("--rates", options->rates,
                     "Hz, comma-separated: where the stiffness that stays passive is measured")
        ->delimiter(',')
        ->excludes(given)
        ->check(within(100, 100'000))
        ->capture_default_str();
    command->callback([options, &action] { action = [options] { return referee(*options); }; });
}

}  // namespace touchstone::app
