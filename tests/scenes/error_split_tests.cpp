// The error of ticks on the bunnies against their meshes, split by cause.
#include "haptics/sandbox/measure/error_split.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <optional>

#include "haptics/math/statistics.hpp"
#include "haptics/sandbox/session/headless_run.hpp"

namespace touchstone::error_split_tests {

namespace {

sandbox::HapticScene openBunnies() {
    return sandbox::openScene(TOUCHSTONE_BINARY_DIR "/scenes/bunnies.glb",
                              {.treeCache = TOUCHSTONE_BINARY_DIR "/trees", .progress = {}, .allTrees = true});
}

std::vector<TickRecord> ticksOf(const std::string& device, const sandbox::HapticScene& scene, const Settings& settings,
                                std::optional<double> seconds = {}) {
    std::vector<TickRecord> ticks;
    sandbox::HeadlessOptions options;
    options.device = device;
    options.timing = false;
    options.seconds = seconds;
    options.onTick = [&](const TickRecord& record, double) { ticks.push_back(record); };
    sandbox::runHeadless(scene, settings, options);
    return ticks;
}

/// A tick of case 1, and the one before it.
std::pair<TickRecord, TickRecord> slideTo(const sandbox::HapticScene& scene, const Settings& settings, double seconds) {
    const std::vector<TickRecord> ticks = ticksOf("demo:hard-01-slide", scene, settings, seconds);
    return {ticks[ticks.size() - 2], ticks.back()};
}

/// Errors at every 13th tick in contact: of all, N, and of those that arrived, N and mN·m. The travel budget lets
/// the others lag behind on purpose.
struct Errors {
    std::vector<double> all, forces, torques;

    Errors(const sandbox::HapticScene& scene, const Settings& settings, const MeshReference& reference,
           const std::vector<TickRecord>& ticks) {
        for (std::size_t i = 1; i < ticks.size(); i += 13) {
            if (ticks[i].wrench_C.isZero()) continue;
            const sandbox::ErrorSplit error =
                sandbox::splitError(*scene.world, settings, reference, ticks[i - 1], ticks[i]);
            if (!error.converged) continue;
            all.push_back(error.total.force);
            if (ticks[i].flags & kUnfinished) continue;
            forces.push_back(error.total.force);
            torques.push_back(error.total.torque);
        }
        REQUIRE(forces.size() > 400);
    }
};

}  // namespace

TEST_CASE("error split: the error of sliding bunnies comes from the protrusion of their spheres, not the solver",
          "[reference]") {
    const sandbox::HapticScene scene = openBunnies();
    const MeshReference reference = sandbox::meshReferenceOf(scene);
    Settings settings = scene.settings;
    settings.geometry = Geometry::Spheres;
    settings.shadow = kNoSolver;
    const double seconds = GENERATE(0.3, 0.5, 0.9);
    INFO("at " << seconds << " s");
    const auto [before, now] = slideTo(scene, settings, seconds);
    REQUIRE(now.wrench_C.force.norm() > 0.5);
    const sandbox::ErrorSplit split = sandbox::splitError(*scene.world, settings, reference, before, now);
    CHECK(split.converged);
    CHECK(split.truth.gap == Approx(1e-3).margin(1e-5));  // loaded features are at the shell distance
    // Where two leaves touch, each surface is no further away than the protrusion of its leaves.
    const double protrusion = scene.world->tool.spheres->certificate.protrusion +
                              scene.world->obstacles.front().part.spheres->certificate.protrusion;
    CHECK(reference.clearance(now.X_WT, 2) <= protrusion + now.hover + 1e-6);
    // The same tick again, with new lists, gives the same answer.
    CHECK(split.solver.force < 1e-9);
    CHECK(split.solver.torque < 1e-6);
    // 60 mm/s at 1 kHz: the error that one tick leaves to the next is small compared with the protrusion.
    CHECK(split.linearization.force < 0.2 * split.geometry.force);
    CHECK(split.geometry.force > 0.05);
    // The shares add up as vectors.
    CHECK(split.total.force <= split.geometry.force + split.linearization.force + split.solver.force + 1e-9);
    CHECK(split.total.torque <= split.geometry.torque + split.linearization.torque + split.solver.torque + 1e-9);
}

TEST_CASE("error split: the error of a coarse solver is its own share", "[reference]") {
    const sandbox::HapticScene scene = openBunnies();
    const MeshReference reference = sandbox::meshReferenceOf(scene);
    Settings coarse = scene.settings;
    coarse.geometry = Geometry::Spheres;
    coarse.shadow = kNoSolver;
    coarse.solver = "pqp";
    coarse.tolerance = 1;
    coarse.adaptiveMargin = false;  // otherwise the solver gets only the one or two rows that matter
    const auto [before, now] = slideTo(scene, coarse, 0.5);
    const sandbox::ErrorSplit split = sandbox::splitError(*scene.world, coarse, reference, before, now);
    CHECK(split.converged);
    CHECK(split.solver.force > 1e-4);
    CHECK(split.total.force <= split.geometry.force + split.linearization.force + split.solver.force + 1e-9);
}

TEST_CASE("error split: between meshes the geometry's share is the contact distance", "[reference]") {
    const sandbox::HapticScene scene = openBunnies();
    MeshReferenceOptions options;
    options.shell = 1e-4;
    const MeshReference reference = sandbox::meshReferenceOf(scene, options);
    Settings settings = scene.settings;
    settings.geometry = Geometry::Mesh;
    settings.shadow = kNoSolver;
    // The tool is held off by δ less the shell along the normals of its contacts, so that the error is proportional.
    const double seconds = GENERATE(0.3, 0.5, 0.9);
    std::vector<double> forces;
    for (const double distance : {0.002, 0.02, 0.05}) {
        settings.contactDistance = distance;
        const auto [before, now] = slideTo(scene, settings, seconds);
        REQUIRE(now.wrench_C.force.norm() > 0.1);
        const sandbox::ErrorSplit split = sandbox::splitError(*scene.world, settings, reference, before, now);
        INFO("at " << seconds << " s, distance " << distance << ": geometry " << split.geometry.force << " N of "
                   << split.total.force << " N, linearization " << split.linearization.force << " N, solver "
                   << split.solver.force << " N");
        CHECK(split.converged);
        CHECK(split.solver.force < 1e-9);
        CHECK(split.total.force <= split.geometry.force + split.linearization.force + split.solver.force + 1e-9);
        forces.push_back(split.geometry.force);
        CHECK(split.geometry.force < 3 * settings.stiffness * distance);
    }
    CHECK(forces[2] / forces[1] == Approx((0.05 - options.shell) / (0.02 - options.shell)).epsilon(0.2));
    // A tick ends with a step of 1 µm, so a tool that rests may be a little more than that away.
    const double resolved = 1.5e-3 * settings.stiffness;
    CHECK(forces[0] == Approx(forces[1] * (0.002 - options.shell) / (0.02 - options.shell)).margin(resolved));
}

TEST_CASE("error split: bunnies push back by their meshes as the reference does, and with the ripple that is theirs",
          "[reference][long]") {
    const sandbox::HapticScene scene = openBunnies();
    const MeshReference reference = sandbox::meshReferenceOf(scene);
    Settings settings = scene.settings;
    settings.shadow = kNoSolver;
    const std::vector<TickRecord> ticks = ticksOf("demo", scene, settings);
    Errors errors(scene, settings, reference, ticks);
    CAPTURE(*percentile(errors.all, 99), *percentile(errors.forces, 99), *percentile(errors.torques, 99));
    CAPTURE(*percentile(errors.forces, 100));
    CHECK(*percentile(errors.forces, 50) < 0.001);
    CHECK(*percentile(errors.forces, 98) < 0.005);
    CHECK(*percentile(errors.torques, 98) < 0.5);
    std::vector<double> hovers;
    for (const TickRecord& tick : ticks)
        if (!tick.wrench_C.isZero()) hovers.push_back(tick.hover);
    CHECK(*percentile(hovers, 99) < 0.01);

    // A quarter of a second of sliding: the force less its mean over 50 ms.
    std::vector<Vec3> felt, truth;
    for (std::size_t i = 3000; i < 3250; ++i) {
        REQUIRE_FALSE(ticks[i].wrench_C.isZero());
        felt.push_back(ticks[i].wrench_C.force);
        const auto split = sandbox::splitError(*scene.world, settings, reference, ticks[i - 1], ticks[i]);
        truth.push_back(split.truth.wrench_C.force);
    }
    const auto ripple = [](const std::vector<Vec3>& of) {
        constexpr std::size_t kHalf = 25;
        double sum = 0;
        for (std::size_t i = kHalf; i + kHalf < of.size(); ++i) {
            Vec3 mean = Vec3::Zero();
            for (std::size_t k = i - kHalf; k <= i + kHalf; ++k) mean += of[k] / (2 * kHalf + 1);
            sum += (of[i] - mean).squaredNorm();
        }
        return std::sqrt(sum / double(of.size() - 2 * kHalf));
    };
    CHECK(ripple(truth) > 0.01);
    CHECK(ripple(felt) == Approx(ripple(truth)).margin(0.02));
}

// Corners make more of the difference between the distances that tick and reference keep.
TEST_CASE("error split: at the same distance from their meshes 99 of 100 ticks that arrive push as the reference does",
          "[reference][long]") {
    const sandbox::HapticScene scene = openBunnies();
    Settings settings = scene.settings;
    settings.shadow = kNoSolver;
    settings.contactDistance = GENERATE(2e-3, 5e-4);
    MeshReferenceOptions options;
    options.shell = settings.contactDistance;
    Errors errors(scene, settings, sandbox::meshReferenceOf(scene, options), ticksOf("demo", scene, settings));
    CHECK(*percentile(errors.forces, 99) < 0.005);
    CHECK(*percentile(errors.torques, 99) < 0.5);
}

// Limits of the force's change below what the meshes themselves do cannot be met.
TEST_CASE("error split: where a vertex slips off an edge, the force changes less in a tick than that of the reference",
          "[reference][long]") {
    const sandbox::HapticScene scene = openBunnies();
    const MeshReference reference = sandbox::meshReferenceOf(scene);
    Settings settings = scene.settings;
    settings.shadow = kNoSolver;
    const std::vector<TickRecord> ticks = ticksOf("demo:hard-01-slide", scene, settings);
    const auto change = [&](std::size_t i) { return (ticks[i].wrench_C.force - ticks[i - 1].wrench_C.force).norm(); };
    std::size_t most = 2;
    for (std::size_t i = most; i < ticks.size(); ++i)
        if (change(i) > change(most)) most = i;
    const auto truth = [&](std::size_t i) {
        return sandbox::splitError(*scene.world, settings, reference, ticks[i - 1], ticks[i]).truth.wrench_C.force;
    };
    CAPTURE(most);
    CHECK(change(most) > 0.1);
    CHECK((truth(most) - truth(most - 1)).norm() > change(most));
}

TEST_CASE("error split: with four times the travel budget 99 of 100 ticks of the bunnies push as the reference does",
          "[reference][long]") {
    const sandbox::HapticScene scene = openBunnies();
    Settings settings = scene.settings;
    settings.shadow = kNoSolver;
    settings.travelBudget *= 4;
    Errors errors(scene, settings, sandbox::meshReferenceOf(scene), ticksOf("demo", scene, settings));
    CHECK(*percentile(errors.all, 99) < 0.1);
}

}  // namespace touchstone::error_split_tests
