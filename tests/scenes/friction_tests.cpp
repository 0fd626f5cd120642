// The scenes of friction and the close fits with friction, each compared with what statics says.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "haptics/math/statistics.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "haptics/sandbox/session/presets.hpp"
#include "tests/scenes/scene_files.hpp"
#include "tests/support/mesh_world.hpp"
#include "tests/support/wandering_hand.hpp"
#include "tools/parts/drawer.hpp"
#include "tools/parts/nut.hpp"

namespace touchstone::friction_tests {

using namespace touchstone::test;

namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::uint32_t kInexact = kFrictionSoft | kFrictionHeld;

sandbox::HapticScene openNamed(const std::string& name) {
    return openBundled(TOUCHSTONE_BINARY_DIR "/scenes/" + name + ".glb");
}

Settings alone(Settings settings) {
    settings.shadow = kNoSolver;
    return settings;
}

/// The same world with other coefficients of friction.
World withFriction(World world, const Friction& friction) {
    test::rub(world, friction);
    return world;
}

Quat aboutY(double angle) { return Quat(Eigen::AngleAxisd(angle, Vec3::UnitY())); }
double angleAboutY(const Quat& q) { return 2 * std::atan2(q.y(), q.w()); }

/// The place of the change between two ends of which the first is true and the second false, to this width.
double boundary(double holds, double fails, double width, const std::function<bool(double)>& test) {
    REQUIRE(test(holds));
    REQUIRE_FALSE(test(fails));
    while (std::abs(fails - holds) > width) {
        const double middle = (holds + fails) / 2;
        (test(middle) ? holds : fails) = middle;
    }
    return (holds + fails) / 2;
}

}  // namespace

TEST_CASE("incline: the block breaks away at the coefficient at rest, slides against the other, and does not creep",
          "[scenes][friction]") {
    const sandbox::HapticScene scene = openNamed("incline");
    REQUIRE(scene.world->friction(0) == Friction{0.5, 0.4});
    const Pose plane = scene.world->obstacles[0].X_WO;
    const Vec3 up = plane.q * Vec3::UnitX(), normal = plane.q * Vec3::UnitY();
    struct Tick {
        double along, normal, friction, slip;  ///< mm and N
        bool slides, sticks, soft;
    };
    std::vector<Tick> ticks;
    sandbox::HeadlessOptions options;
    options.timing = false;
    options.onTick = [&](const TickRecord& record, double penetration) {
        REQUIRE(penetration == 0);
        const Vec3& force = record.wrench_C.force;
        ticks.push_back({record.X_WT.p.dot(up), force.dot(normal), force.dot(up), record.slip, record.sliding > 0,
                         record.sticking > 0, (record.flags & kInexact) != 0});
    };
    const sandbox::Report report = sandbox::runHeadless(scene, alone(scene.settings), options).report;
    CHECK(report.met());

    int away = 0, slid = 0, stuck = 0;
    double rest = 0;   ///< where the block came to rest
    double crept = 0;  ///< slip of exact ticks since then, mm
    for (std::size_t i = 1; i < ticks.size(); ++i) {
        const Tick &tick = ticks[i], &before = ticks[i - 1];
        if (tick.normal < 0.1) continue;
        CAPTURE(i, tick.along, tick.normal, tick.friction);
        const double ratio = std::abs(tick.friction) / tick.normal;
        if (tick.slides) {
            REQUIRE(ratio <= 0.5 * (1 + 1e-6));
            const bool asSliding = ratio == Approx(0.4).epsilon(1e-4), asAtRest = ratio == Approx(0.5).epsilon(1e-4);
            if (!tick.soft) REQUIRE((before.slides ? asSliding : asAtRest));
            if (!tick.soft) REQUIRE(tick.friction * (tick.along - before.along) < 0);
            away += !before.slides && asAtRest;
            slid += before.slides && asSliding;
        } else {
            REQUIRE(tick.sticks);
            REQUIRE(ratio <= 0.5 * (1 + 1e-9));
            if (before.slides || before.normal < 0.1) rest = before.along, crept = 0;
            if (!tick.soft) crept += tick.slip;
            REQUIRE(crept < 1e-6);
            // It may rock on its corners: after inexact ticks one of them is up to 1 µm higher than the others.
            REQUIRE(std::abs(tick.along - rest) < 1e-3);
            ++stuck;
        }
    }
    CHECK(away == 6);  // two pulls and four short ones
    CHECK(slid > 2000);
    CHECK(stuck > 3000);
    CHECK(report.friction.sticking >= std::uint64_t(stuck));
}

namespace {

/// Pulls the drawer, whose corners touch the rails already, with up to 6 N along a line `beside` its center line.
/// Returns how far it comes out while the pull rises from 3 to 6 N, mm.
double pulledOut(const World& world, const Settings& settings, double beside, double& pull) {
    const app::DrawerFit fit;
    TickState state(world);
    // The hand turns the drawer until opposite corners touch, and a little further, so that they stay.
    const double touch = 1e-3, turn = fit.tilt();
    TickRecord record;
    Pose device = world.X_WT_start;
    for (int i = 1; i <= 50; ++i) {
        const double angle = (turn + touch) * i / 50;
        device = {{0, 0, -fit.toMiddle() * std::sin(angle)}, aboutY(angle)};
        record = step(world, settings, {device}, state);
    }
    const Pose start = record.X_WT;
    // The force acts at C, the origin of the tool's node, and the torque makes up for the distance of its line.
    const double corner = start.p.z() + fit.toMiddle() * std::sin(angleAboutY(start.q));  // middle of the two corners
    double half = 0;
    for (int i = 1; i <= 300; ++i) {
        const double force = 6.0 * i / 300, torque = force * (beside - start.p.z() + corner);
        device = {start.p + Vec3(force / settings.stiffness, 0, 0),
                  aboutY(angleAboutY(start.q) + torque / settings.torsion)};
        record = step(world, settings, {device}, state);
        REQUIRE_FALSE(meshesOverlap(world, record.X_WT, state.obstacles()));
        if (i == 150) half = record.X_WT.p.x();
    }
    pull = record.wrench_C.force.norm();
    return record.X_WT.p.x() - half;
}

}  // namespace

TEST_CASE("drawer: it jams if it is pulled further off its center than the engaged length over twice the friction",
          "[scenes][friction]") {
    const sandbox::HapticScene scene = openNamed("drawer");
    REQUIRE(scene.world->obstacles.size() == 3);
    for (std::size_t k = 0; k < scene.world->obstacles.size(); ++k)
        CHECK(scene.world->friction(k) == Friction{0.6, 0.5});
    const Settings settings = alone(scene.settings);
    // The rows keep the corners this much nearer to the drawer than the rails are.
    app::DrawerFit fit;
    fit.clearance -= settings.contactDistance;
    for (const double mu : {0.3, 0.6, 0.9}) {
        CAPTURE(mu);
        const World world = withFriction(*scene.world, {mu, mu});
        double pull = 0;
        const double limit = fit.engaged() / (2 * mu);
        const double found = boundary(0.5 * limit, 1.5 * limit, 1e-4 * limit,
                                      [&](double beside) { return pulledOut(world, settings, beside, pull) > 1e-3; });
        CHECK(found == Approx(limit).epsilon(1e-3));
        CHECK(std::abs(pulledOut(world, settings, 1.02 * limit, pull)) < 1e-6);
        CHECK(pull == Approx(6).epsilon(1e-3));
        CHECK(pulledOut(world, settings, 0, pull) > 0.05);
    }
}

TEST_CASE("drawer: pulled off its center it jams, pulled at its center it slides out", "[scenes][friction]") {
    const sandbox::HapticScene scene = openNamed("drawer");
    const char* device = GENERATE("demo", "demo:off-center");
    sandbox::HeadlessOptions options;
    options.device = device;
    options.timing = false;
    double out = 0, pulled = 0;
    options.onTick = [&](const TickRecord& record, double penetration) {
        REQUIRE(penetration == 0);
        out = std::max(out, record.X_WT.p.x());
        pulled = std::max(pulled, record.wrench_C.force.norm());
    };
    const sandbox::Report report = sandbox::runHeadless(scene, alone(scene.settings), options).report;
    for (const sandbox::OutcomeCheck& check : report.checks) {
        INFO(check.name << ": limit " << check.limit << ", was " << check.value);
        CHECK(check.met);
    }
    CHECK(pulled == Approx(2.5).epsilon(1e-3));
    CHECK(out == Approx(device == std::string("demo") ? 40 : 0).margin(1e-3));
}

namespace {

/// The flanks overlap from the nut's crests, at this radius, to the bolt's.
double innerFlank(const app::ThreadFit& fit) { return fit.minorDiameter() / 2 + fit.clearance; }
double leadAngle(const app::ThreadFit& fit, double radius) { return std::atan(fit.pitch / (2 * kPi * radius)); }
/// Cosine of the half angle of the flanks across the thread; along the axis it is 30 degrees.
double flankCosine(const app::ThreadFit& fit, double radius) {
    return std::cos(std::atan(std::tan(kPi / 6) * std::cos(leadAngle(fit, radius))));
}

/// The turn, rad, of a nut in the middle of its bolt that is pressed down with 10 N and otherwise free to turn.
double turnOfNut(const sandbox::HapticScene& scene, double mu) {
    World world = withFriction(*scene.world, {mu, mu});
    const app::ThreadFit fit;
    const double height = 3.5 * fit.pitch;
    world.X_WT_start = {{0, height, 0}, aboutY(2 * kPi * height / fit.pitch)};
    Settings settings = alone(scene.settings);
    settings.torsion = 50;
    TickState state(world);
    TickRecord record;
    record.X_WT = world.X_WT_start;
    const double start = angleAboutY(record.X_WT.q);
    double turned = 0;
    for (int i = 1; i <= 600; ++i) {
        const double force = std::min(10.0, 0.2 * i), angle = angleAboutY(record.X_WT.q);
        const Pose device{{0, record.X_WT.p.y() - force / settings.stiffness, 0}, aboutY(angle)};
        record = step(world, settings, {device}, state);
        REQUIRE_FALSE(meshesOverlap(world, record.X_WT, state.obstacles()));
        turned = std::remainder(angleAboutY(record.X_WT.q) - start, 2 * kPi);
        if (std::abs(turned) > 0.3) break;
    }
    return turned;
}

}  // namespace

TEST_CASE("nut: under an axial force it turns by itself if its lead angle exceeds that of friction, and not otherwise",
          "[scenes][friction][long]") {
    const sandbox::HapticScene scene = openNamed("nut");
    const app::ThreadFit fit;
    const double inner = innerFlank(fit), outer = fit.diameter / 2;
    const auto threshold = [&](double radius) { return flankCosine(fit, radius) * std::tan(leadAngle(fit, radius)); };
    const double theory = threshold((inner + outer) / 2);
    const double found = boundary(0.5 * theory, 1.5 * theory, 0.01 * theory,
                                  [&](double mu) { return std::abs(turnOfNut(scene, mu)) > 0.05; });
    INFO("threshold " << found << ", on the mean radius " << theory);
    // Facets touch at corners and edges, which may lie anywhere on the flanks, and the torque ripples from one to the
    // next: the nut goes on if it exceeds friction on all of its way.
    CHECK(found > threshold(outer));
    CHECK(found < threshold(inner));
    CHECK(found == Approx(theory).epsilon(0.05));
}

namespace {

/// A run of a motion with other coefficients of friction.
sandbox::Report runWith(sandbox::HapticScene& scene, const char* device, const Friction& friction,
                        const std::function<void(const TickRecord&)>& onTick = {}) {
    scene.world = std::make_shared<const World>(withFriction(*scene.world, friction));
    sandbox::HeadlessOptions options;
    options.device = device;
    options.timing = false;
    options.onTick = [&](const TickRecord& record, double penetration) {
        REQUIRE(penetration == 0);
        if (onTick) onTick(record);
    };
    return sandbox::runHeadless(scene, alone(scene.settings), options).report;
}

void checkMet(const sandbox::Report& report) {
    REQUIRE_FALSE(report.checks.empty());
    for (const sandbox::OutcomeCheck& check : report.checks) {
        INFO(check.name << ": limit " << check.limit << ", was " << check.value);
        CHECK(check.met);
    }
}

}  // namespace

TEST_CASE("nut and peg: with friction they seat along their demonstrations", "[scenes][friction][long]") {
    const char* name = GENERATE("peg-h7", "nut");
    INFO(name);
    sandbox::HapticScene scene = openNamed(name);
    const sandbox::Report rough = runWith(scene, "demo", {0.2, 0.2}), smooth = runWith(scene, "demo", {});
    checkMet(rough);
    checkMet(smooth);
    CHECK(smooth.friction.sliding == 0);
    CHECK(rough.friction.sliding > 500);
    CHECK(rough.friction.coulomb.worst_N() < 1e-6);
}

TEST_CASE("gears and wedge: with friction, a tick goes on from the contacts that carried the last one",
          "[scenes][friction]") {
    // The turn of a step takes them apart by some nanometers. Where they have to be found again, it is 24 evaluations.
    int ticks = 0, evaluations = 0;
    for (const char* name : {"gears", "wedge"}) {
        sandbox::HapticScene scene = openNamed(name);
        runWith(scene, "demo", {0.5, 0.5},
                [&](const TickRecord& record) { ++ticks, evaluations += record.iterations; });
    }
    CHECK(ticks > 8000);
    CHECK(evaluations < 20 * ticks);
}

TEST_CASE("bunnies: with friction, a tool that slips as fast as it may keeps to the surface", "[scenes][friction]") {
    const double mu = GENERATE(0.2, 0.5);
    CAPTURE(mu);
    sandbox::HapticScene scene = openNamed("bunnies");
    std::vector<double> hovers;
    int capped = 0;
    runWith(scene, "demo", {mu, mu}, [&](const TickRecord& record) {
        if (record.sliding == 0) return;
        hovers.push_back(record.hover);
        capped += (record.flags & kCapped) != 0;
    });
    CHECK(hovers.size() > 1500);
    CHECK(capped > 40);
    CHECK(*percentile(hovers, 99.5) <= 0.01);
}

TEST_CASE("nut: it takes the torque of a screw with friction to turn it on and off under an axial force",
          "[scenes][friction][long]") {
    sandbox::HapticScene scene = openNamed("nut");
    const double mu = 0.2;
    double force[2] = {0, 0}, torque[2] = {0, 0};  // on the way down and up, N and mN·m
    Quat last = scene.world->X_WT_start.q;
    checkMet(runWith(scene, "demo:hard-17-reverse", {mu, mu}, [&](const TickRecord& record) {
        const double turn = std::remainder(angleAboutY(record.X_WT.q) - angleAboutY(last), 2 * kPi);
        last = record.X_WT.q;
        // Above, the thread has only begun to catch; below, the nut is turned back.
        if (record.X_WT.p.y() < 6 || record.X_WT.p.y() > 9.5 || std::abs(turn) < 1e-4) return;
        force[turn > 0] += record.wrench_C.force.y();
        torque[turn > 0] += record.wrench_C.torque.y();
    }));
    // The force helps to turn the nut on when it presses, and off when it pulls: r tan(rho - lambda).
    const app::ThreadFit fit;
    const double radius = (innerFlank(fit) + fit.diameter / 2) / 2;
    const double theory = radius * std::tan(std::atan(mu / flankCosine(fit, radius)) - leadAngle(fit, radius));
    for (const bool up : {false, true}) {
        CAPTURE(up, theory);
        CHECK(std::abs(force[up]) > 1000);
        CHECK(torque[up] / std::abs(force[up]) == Approx(up ? -theory : theory).epsilon(0.05));
    }
}

namespace {

struct Shares {
    int ticks = 0, loaded = 0, sticking = 0, sliding = 0, soft = 0, held = 0;

    /// Checks a tick against Coulomb's law.
    void add(const TickRecord& record) {
        ++ticks;
        loaded += !record.wrench_C.isZero();
        sticking += record.sticking > 0, sliding += record.sliding > 0;
        soft += (record.flags & kFrictionSoft) != 0, held += (record.flags & kFrictionHeld) != 0;
        REQUIRE((record.flags & (kNonFinite | kListOverflow | kOverlapping | kBadInput)) == 0);
        REQUIRE((record.X_WT.isFinite() && record.wrench_C.isFinite()));
        REQUIRE(record.coulomb.cone_N < 1e-6);
        if (record.flags & kInexact) return;
        // Whatever is not flagged obeys the law. Between the rails forces are larger than on the hand: of 100 N, a
        // contact with force is closed to 1e-6 mm, and its friction opposes the slip as exactly.
        REQUIRE(record.coulomb.worst_N() < 1e-4);
        REQUIRE(record.coulomb.complementarity_mJ < 1e-4);
        REQUIRE(record.coulomb.direction_mJ < 1e-4 * (1 + record.slip));
        // A tick that did not get to its end made only a part of the slip of its last solve.
        if (!(record.flags & (kUnfinished | kCapped | kHalved))) REQUIRE(record.coulomb.dissipation_mJ > -1e-4);
    }
};

}  // namespace

TEST_CASE("hard: hands that shake a block on an incline and a drawer in its rails, with friction (case 21)",
          "[hard][friction][long]") {
    const char* name = GENERATE("incline", "drawer");
    const double mu = GENERATE(0.2, 0.5, 0.9);
    CAPTURE(name, mu);
    sandbox::HapticScene scene = openNamed(name);
    Shares shares;
    checkMet(runWith(scene, "demo:hard-21-shake", {mu, 0.8 * mu}, [&](const TickRecord& record) {
        CAPTURE(record.tick, record.flags);
        shares.add(record);
    }));
    const World& world = *scene.world;
    const Settings settings = alone(scene.settings);
    const double duration = scene.demonstration->duration();
    for (unsigned seed = 1; seed <= 3; ++seed) {
        WanderingHand hand(seed, world.reach() / 2, [&](std::mt19937& engine) {
            return scene.demonstration->at(std::uniform_real_distribution<double>(0, duration)(engine));
        });
        TickState state(world);
        for (int tick = 0; tick < 5000; ++tick) {
            const TickRecord record = step(world, settings, {hand.next()}, state);
            CAPTURE(seed, tick, record.flags);
            REQUIRE_FALSE(meshesOverlap(world, record.X_WT, state.obstacles()));
            shares.add(record);
        }
    }
    INFO("of " << shares.loaded << " ticks with force: " << shares.soft << " soft, " << shares.held << " held");
    CHECK(shares.sliding > shares.ticks / 10);
    CHECK(shares.sticking > shares.ticks / 20);
    CHECK(shares.soft + shares.held <= 0.0001 * shares.loaded);
}

}  // namespace touchstone::friction_tests
