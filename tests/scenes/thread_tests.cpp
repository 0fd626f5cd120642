// Threads under an axial force against what textbooks say of screws, on meshes whose facets decide nothing and on
// others.
#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>
#include <optional>

#include "haptics/loop/step.hpp"
#include "haptics/sandbox/measure/fit_check.hpp"
#include "tests/scenes/scene_files.hpp"
#include "tests/support/mesh_world.hpp"
#include "tools/parts/scenes.hpp"

namespace touchstone::thread_tests {

using namespace touchstone::test;

namespace {

constexpr double kTau = 2 * std::numbers::pi;

Quat aboutY(double angle) { return Quat(Eigen::AngleAxisd(angle, Vec3::UnitY())); }
double angleAboutY(const Quat& q) { return 2 * std::atan2(q.y(), q.w()); }

/// A nut on its bolt, and what its dimensions say.
struct Screw {
    explicit Screw(const app::ThreadFit& dimensions) : fit(dimensions) {
        app::SceneOptions options;
        options.nut = fit;
        const auto table = app::sceneTable();
        const auto nut = std::find_if(table.begin(), table.end(), [](const auto& info) { return info.name == "nut"; });
        scene = sandbox::openScene(nut->make(options), {.treeCache = {}, .progress = {}, .trees = false});
    }
    double sign() const { return fit.left ? -1 : 1; }
    /// The flanks overlap from the nut's crests to the bolt's; their mean radius, mm.
    double radius() const { return (fit.minorDiameter() / 2 + fit.clearance + fit.diameter / 2) / 2; }
    double leadAngle() const { return std::atan(fit.lead() / (kTau * radius())); }
    /// The cosine of the flanks' angle, measured across the thread.
    double flankCosine() const { return std::cos(std::atan(std::tan(fit.flankAngle()) * std::cos(leadAngle()))); }
    /// Torque over force against the load and with it, mm.
    double raising(double mu) const { return radius() * std::tan(std::atan(mu / flankCosine()) + leadAngle()); }
    double lowering(double mu) const { return radius() * std::tan(std::atan(mu / flankCosine()) - leadAngle()); }
    /// The least coefficient of friction with which the thread holds.
    double holding() const { return std::tan(leadAngle()) * flankCosine(); }
    /// In the thread, 0.8 pitches above the plate.
    Pose start() const {
        const double height = 0.8 * fit.pitch;
        return {{0, height, 0}, aboutY(sign() * kTau * height / fit.lead())};
    }

    app::ThreadFit fit;
    sandbox::HapticScene scene;
};

app::ThreadFit m16(int segments, int nutSegments) {
    app::ThreadFit fit;
    fit.segments = segments, fit.nutSegments = nutSegments;
    return fit;
}
app::ThreadFit m8() {
    app::ThreadFit fit = m16(120, 121);
    fit.diameter = 8, fit.pitch = 1.25, fit.clearance = 0.03, fit.height = 4;
    return fit;
}
app::ThreadFit square() {
    app::ThreadFit fit = m16(156, 157);
    fit.flank = 1, fit.depth = 1;
    return fit;
}
app::ThreadFit twoStart() {
    app::ThreadFit fit = m16(156, 157);
    fit.starts = 2;
    return fit;
}

/// A hand that loads a nut along the axis; of its angle it holds what `turn` says and leaves the rest free.
class Hand {
  public:
    Hand(const Screw& screw, double mu, double torsion) : world_(*screw.scene.world), state_(prepared(screw, mu)) {
        settings_.shadow = kNoSolver;
        settings_.torsion = torsion;
        record_.X_WT = world_.X_WT_start;
        angle_ = angleAboutY(record_.X_WT.q);
    }
    void turn(double by) { angle_ += by; }
    void letTurn() { angle_ = angleAboutY(record_.X_WT.q); }
    /// `force`: N, up.
    const TickRecord& tick(double force) {
        const Pose device{{0, record_.X_WT.p.y() + force / settings_.stiffness, 0}, aboutY(angle_)};
        record_ = step(world_, settings_, {.X_WT_device = device}, state_);
        if (record_.tick % 8 == 0) REQUIRE_FALSE(meshesOverlap(world_, record_.X_WT, state_.obstacles()));
        return record_;
    }
    double angle() const { return angleAboutY(record_.X_WT.q); }

  private:
    const World& prepared(const Screw& screw, double mu) {
        world_.X_WT_start = screw.start();
        rub(world_, {mu, mu});
        return world_;
    }

    World world_;
    TickState state_;
    Settings settings_;
    TickRecord record_;
    double angle_ = 0;
};

/// Whether a nut that nothing keeps from turning stays where it is under a load.
bool holds(const Screw& screw, double mu, double force) {
    Hand hand(screw, mu, 50);
    const double start = hand.angle();
    for (int i = 1; i <= 800; ++i) {
        hand.letTurn();
        hand.tick(force * std::min(1.0, i / 50.0));
        if (std::abs(std::remainder(hand.angle() - start, kTau)) > 0.05) return false;
    }
    return true;
}

/// The coefficient of friction from which on it holds, over that of the lead.
double holdsFrom(const Screw& screw, double force) {
    const double theory = screw.holding();
    double turns = 0.3, stays = 1.5;
    REQUIRE_FALSE(holds(screw, turns * theory, force));
    REQUIRE(holds(screw, stays * theory, force));
    while (stays - turns > 0.005) {
        const double middle = (turns + stays) / 2;
        (holds(screw, middle * theory, force) ? stays : turns) = middle;
    }
    return (turns + stays) / 2;
}

struct Turned {
    double torque = 0, force = 0, ripple = 0;  ///< means, N and mN·m, and the largest distance of torque from its mean
};

/// The wrench on the hand while it turns the nut by 0.4 rad under a load, after friction has wound up its spring.
Turned turned(const Screw& screw, double mu, double force, double direction) {
    constexpr double kTorsion = 50, kTurn = 1e-3;
    Hand hand(screw, mu, kTorsion);
    const double wound = mu > 0 ? 1.15 * std::abs(force) * screw.raising(mu) / kTorsion : 0;
    for (int i = 1; i <= 60; ++i) hand.tick(force * std::min(1.0, i / 50.0));
    for (int i = 1; i <= 60; ++i) hand.turn(direction * wound / 60), hand.tick(force);
    for (int i = 1; i <= 80; ++i) hand.turn(direction * kTurn), hand.tick(force);
    std::vector<double> torques;
    Turned result;
    for (int i = 1; i <= 400; ++i) {
        hand.turn(direction * kTurn);
        const TickRecord& record = hand.tick(force);
        torques.push_back(record.wrench_C.torque.y());
        result.torque += torques.back() / 400, result.force += record.wrench_C.force.y() / 400;
    }
    for (const double torque : torques) result.ripple = std::max(result.ripple, std::abs(torque - result.torque));
    return result;
}

}  // namespace

TEST_CASE("thread: it takes the textbook's torque to tighten and to loosen it under a load",
          "[scenes][friction][long]") {
    const auto [name, fit] = GENERATE(table<const char*, app::ThreadFit>(
        {{"M16", m16(156, 157)}, {"M8", m8()}, {"square", square()}, {"two starts", twoStart()}}));
    const Screw screw(fit);
    const double mu = GENERATE(0.0, 0.2);
    // The bolt pushes the nut up that a hand presses down.
    for (const double force : {-10.0, 10.0})
        for (const double direction : {-1.0, 1.0}) {
            CAPTURE(name, mu, force, direction);
            const Turned found = turned(screw, mu, force, direction);
            CHECK(found.force == Approx(-force).epsilon(1e-3));
            const bool raises = (direction > 0) == (force < 0);
            const double theory = raises ? screw.raising(mu) : screw.lowering(mu);
            CHECK(std::abs(found.torque) == Approx(10 * std::abs(theory)).epsilon(0.03));
            CHECK((found.torque * direction < 0) == (raises || mu > 0));
        }
}

TEST_CASE("thread: a nut with fine facets keeps up with the hand", "[scenes][long]") {
    app::ThreadFit fit = m8();
    fit.segments = 313, fit.nutSegments = 340;
    const Screw screw(fit);
    const Turned found = turned(screw, 0, -10, 1);
    CHECK(found.torque == Approx(-10 * screw.raising(0)).epsilon(0.1));
    CHECK(found.ripple < 2 * screw.raising(0));
}

TEST_CASE("thread: without load and friction it turns by itself", "[scenes][long]") {
    const Screw screw(m16(156, 157));
    for (const double direction : {-1.0, 1.0}) {
        CAPTURE(direction);
        const Turned found = turned(screw, 0, 0, direction);
        CHECK(std::abs(found.force) < 1e-3);
        // A turn of the spring by a microradian is 5e-5 mN·m.
        CHECK(std::abs(found.torque) + found.ripple < 0.02);
    }
}

TEST_CASE("thread: a nut that is free to turn holds from the friction of its lead on where facets decide nothing",
          "[scenes][friction][long]") {
    const auto [name, fit] = GENERATE(table<const char*, app::ThreadFit>(
        {{"M16", m16(156, 157)}, {"M8", m8()}, {"square", square()}, {"two starts", twoStart()}}));
    const Screw screw(fit);
    for (const double force : {-10.0, 10.0}) {
        CAPTURE(name, force);
        CHECK(holdsFrom(screw, force) == Approx(1).margin(0.05));
    }
}

TEST_CASE("thread: facets in step let it hold sooner, and the fit says from which friction on",
          "[scenes][friction][long]") {
    const auto rise = [](const Screw& screw) {
        const std::optional<sandbox::FitCheck> fit =
            sandbox::checkFit(sandbox::fitQuestion(screw.scene), screw.scene.settings);
        REQUIRE(fit->thread);
        return *fit->thread;
    };
    const Screw apart(m16(156, 157)), inStep(m16(144, 144));
    const sandbox::ThreadLead smooth = rise(apart), rough = rise(inStep);
    CHECK(smooth.least > 0.93);
    CHECK_THAT(sandbox::facetClause(smooth), !Catch::Contains("decide"));
    CHECK(rough.least < 0.7);
    CHECK_THAT(sandbox::facetClause(rough), Catch::Contains("facets rise by 0.6") && Catch::Contains("they decide"));
    for (const double force : {-10.0, 10.0}) CHECK(holdsFrom(inStep, force) == Approx(rough.least).margin(0.06));
    CHECK_FALSE(sandbox::threadLead(*apart.scene.world, {}, apart.scene.settings.contactDistance));
}

}  // namespace touchstone::thread_tests
