// Sweeps of a contact: the rows equal those of the tick, a separate solve confirms the errors, and no point dominates
// a point of the Pareto front.
#include "haptics/sandbox/measure/contact_sweep.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <map>
#include <random>

#include "haptics/loop/setting_table.hpp"
#include "haptics/qp/friction_table.hpp"
#include "haptics/sandbox/measure/pareto.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "tests/support/solvers.hpp"
#include "tests/support/ui_scene.hpp"

namespace touchstone::contact_sweep_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;

namespace {

/// Two consecutive ticks of the cube pressed into the slab, and the largest problem of the second tick.
struct Pressed {
    HapticScene scene;
    Settings settings = scene.settings;
    TickRecord before, now;
    std::optional<RowSet> rows;
    Vec6 wanted = Vec6::Zero();

    explicit Pressed(double seconds, Mode mode = Mode::Default, Geometry geometry = Geometry::Spheres)
        : Pressed(holdScene(), seconds, mode, geometry) {}
    Pressed(engine::Scene made, double seconds, Mode mode, Geometry geometry)
        : scene(openScene(std::move(made), {.treeCache = {}, .progress = {}, .allTrees = true})) {
        settings.mode = mode;
        settings.geometry = geometry;
        settings.shadow = kNoSolver;
        HeadlessOptions options;
        options.timing = false;
        options.seconds = seconds;
        std::optional<RowSet> largest;
        Vec6 h = Vec6::Zero();
        options.onSolve = [&](const QpProblem& problem, const SolveResult&) {
            if (largest && largest->size() > problem.rows->size()) return;
            largest = *problem.rows;
            h = problem.wanted;
        };
        options.onTick = [&](const TickRecord& record, double) {
            before = now;
            now = record;
            rows = std::exchange(largest, std::nullopt);
            wanted = h;
        };
        runHeadless(scene, settings, options);
    }
};

}  // namespace

TEST_CASE("Pareto front: no point dominates a point on it, and some point dominates every other", "[sweep]") {
    const std::uint32_t seed = 5;
    INFO("seed " << seed);
    std::mt19937 random(seed);
    for (int trial = 0; trial < 200; ++trial) {
        std::vector<TimeAndError> points(random() % 30);
        for (auto& [us, error] : points) us = double(random() % 8), error = double(random() % 8);  // many are equal
        const std::vector<std::size_t> front = paretoFront(points);
        const auto beats = [](const TimeAndError& a, const TimeAndError& b) {
            return a.first <= b.first && a.second <= b.second && a != b;
        };
        for (std::size_t i = 0; i < points.size(); ++i) {
            const bool on = std::find(front.begin(), front.end(), i) != front.end();
            bool rival = false, twin = false;
            for (std::size_t k = 0; k < points.size(); ++k) {
                rival = rival || beats(points[k], points[i]);
                twin = twin || (k < i && points[k] == points[i]);
            }
            REQUIRE(on == (!rival && !twin));
        }
        for (std::size_t i = 1; i < front.size(); ++i) REQUIRE(points[front[i - 1]].first < points[front[i]].first);
    }
}

TEST_CASE("sweep: the frozen rows are those that the loop's tick had", "[sweep]") {
    const auto [seconds, mode] =
        GENERATE(std::pair(0.15, Mode::Default), std::pair(0.3, Mode::Default), std::pair(0.15, Mode::Paper));
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    const Pressed pressed(seconds, mode, geometry);
    REQUIRE(pressed.rows);
    const auto contact = freezeContact(*pressed.scene.world, pressed.settings, pressed.before, pressed.now, {});
    REQUIRE(contact);
    REQUIRE(contact->rows.size() == pressed.rows->size());
    CHECK(contact->tick == pressed.now.tick);
    for (int i = 0; i < contact->rows.size(); ++i) {
        REQUIRE(contact->rows.id(i) == pressed.rows->id(i));
        // Equal up to rounding, because poses pass through the record. Paper rows are gradients of squared distances,
        // mm.
        const double scale = pressed.rows->row(i).norm();
        CHECK((contact->rows.row(i) - pressed.rows->row(i)).norm() <= 1e-9 * scale);
        CHECK(contact->rows.gap()[i] == Approx(pressed.rows->gap()[i]).margin(1e-9 * scale));
    }
    CHECK((contact->wanted - pressed.wanted).norm() < 1e-9);

    if (geometryOf(pressed.settings) == Geometry::Spheres && mode == Mode::Default) {
        const auto all =
            freezeContact(*pressed.scene.world, pressed.settings, pressed.before, pressed.now, {.allRows = true});
        REQUIRE(all);
        CHECK(all->rows.size() > contact->rows.size());
    }
}

TEST_CASE("sweep: without a near pair there is no contact to freeze", "[sweep]") {
    const Pressed pressed(0.02);
    REQUIRE_FALSE(pressed.rows);
    CHECK_FALSE(freezeContact(*pressed.scene.world, pressed.settings, pressed.before, pressed.now, {}));
}

TEST_CASE("sweep: every solver at every tolerance has the error of a separate solve", "[sweep]") {
    const bool warm = GENERATE(false, true);
    const Pressed pressed(0.15);
    const auto contact = freezeContact(*pressed.scene.world, pressed.settings, pressed.before, pressed.now,
                                       {.allRows = true, .warm = warm});
    REQUIRE(contact);
    double last = -1;
    const auto sweep = sweepContact(*contact, [&](double fraction) {
        CHECK(fraction >= last);
        last = fraction;
        return true;
    });
    REQUIRE(sweep);
    CHECK(sweep->rows == contact->rows.size());
    const QpProblem problem{contact->stiffness, contact->wanted, &contact->rows};
    const Vec6 exact = findSolver(kExactSolver)->make(contact->rows.size())->solve(problem, {}).x;

    std::map<std::string_view, int> perSolver;
    for (const SweepPoint& point : sweep->points) {
        const SolverInfo& info = *findSolver(point.solver);
        CAPTURE(info.name, point.tolerance);
        ++perSolver[point.solver];
        CHECK(point.us > 0);
        if (info.exact) CHECK(point.forceError < 1e-9);  // rounding of a few N
        Settings settings = contact->settings;
        if (!info.exact) settings.tolerance = point.tolerance;
        const auto solver = info.make(contact->rows.size());
        if (warm) solver->solve({contact->stiffness, contact->wantedBefore, &contact->rows}, solverSettings(settings));
        const Vec6 x = solver->solve(problem, solverSettings(settings)).x;
        CHECK(point.forceError == wrenchError(problem, x, exact).force_N);
        for (const SweepPoint& other : sweep->points)
            if (point.onFront)
                CHECK_FALSE((other.us < point.us &&
                             std::max(other.forceError, kLeastError) < std::max(point.forceError, kLeastError)));
    }
    // An exact solver has one point, an approximate one a point for each of 17 tolerances.
    for (const SolverInfo& info : solverTable())
        CHECK(perSolver[info.name] == (info.exact ? 1 : info.roundTrip ? 11 : 17));
    CHECK(std::any_of(sweep->points.begin(), sweep->points.end(), [](const SweepPoint& p) { return p.onFront; }));
    if (warm) return;
    for (const std::string_view solver : approximateSolvers())
        CHECK(pointAt(*sweep, solver, 1)->forceError > pointAt(*sweep, solver, 1e-6)->forceError);
}

TEST_CASE("sweep: a card whose round trip is longer than a tick does not fit it", "[sweep]") {
    SolverInfo card{.name = "card", .summary = "", .exact = false, .make = nullptr};
    card.roundTrip = []() -> const RoundTrip& {
        static const RoundTrip trip{.trouble = "", .us = 500, .updateUs = 1};
        return trip;
    };
    Settings settings;
    settings.rate = 1000;
    CHECK(fitsTick(card, settings));
    settings.rate = 4000;
    CHECK_FALSE(fitsTick(card, settings));
    CHECK(fitsTick(*findSolver(kExactSolver), settings));
}

TEST_CASE("sweep: with friction, every friction solver has the error of a separate solve", "[sweep][friction]") {
    const bool warm = GENERATE(false, true);
    const Geometry geometry = GENERATE(Geometry::Spheres, Geometry::Mesh);
    // The cube slides between the facets of a friction pyramid.
    Pressed pressed(rubScene(), 0.45, Mode::Default, geometry);
    REQUIRE(pressed.now.sliding > 0);
    const auto contact =
        freezeContact(*pressed.scene.world, pressed.settings, pressed.before, pressed.now, {.warm = warm});
    REQUIRE(contact);
    CHECK(contact->rubs());
    CHECK(contact->rows.size() == 0);
    CHECK(int(contact->contacts.size()) >= pressed.now.sliding + pressed.now.sticking);
    for (const FrictionContact& c : contact->contacts) {
        CHECK(c.coefficient == Approx(0.4));
        CHECK(c.startForce == Vec3::Zero());
    }
    const auto sweep = sweepContact(*contact);
    REQUIRE(sweep);
    CHECK(sweep->friction);
    CHECK(sweep->rows == int(contact->contacts.size()));
    REQUIRE(sweep->points.size() == frictionSolverTable().size());
    const FrictionProblem problem{contact->stiffness, contact->wanted, contact->contacts};
    const auto exact = findFrictionSolver(kExactFrictionSolver)->make(64);
    const Vec6 truth = exact->solve(problem, Vec6::Zero()).x;
    bool front = false;
    for (std::size_t i = 0; i < sweep->points.size(); ++i) {
        const SweepPoint& point = sweep->points[i];
        const FrictionSolverInfo& info = frictionSolverTable()[i];
        CAPTURE(info.name);
        CHECK(point.solver == info.name);
        CHECK(point.us > 0);
        CHECK(point.iterations > 0);
        CHECK(point.tolerance == 0);
        CHECK(point.status == SolveStatus::Solved);
        front = front || point.onFront;
        if (info.law.facets == 0) CHECK(point.forceError < std::max(1e-6, 10 * info.law.accuracy));
        if (info.law.facets > 0) CHECK(point.forceError > 1e-3);
        if (warm) continue;
        const auto solver = info.make(64);
        CHECK(point.forceError == Approx(wrenchError({contact->stiffness, contact->wanted, nullptr},
                                                     solver->solve(problem, Vec6::Zero()).x, truth)
                                             .force_N)
                                      .margin(1e-9));
    }
    CHECK(front);
    CHECK_FALSE(sweepContact(*contact, [](double) { return false; }));

    const TempFolder folder;
    writeSweep(*sweep, folder.path() / "sweep.csv");
    std::ifstream in(folder.path() / "sweep.csv");
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    for (const FrictionSolverInfo& info : frictionSolverTable())
        CHECK(text.find("," + std::string(info.name) + ",") != std::string::npos);

    pressed.settings.friction = false;
    const auto without = freezeContact(*pressed.scene.world, pressed.settings, pressed.before, pressed.now, {});
    REQUIRE(without);
    CHECK_FALSE(without->rubs());
    CHECK(without->rows.size() > 0);
}

TEST_CASE("sweep: the marker between two tolerances lies between their points", "[sweep]") {
    const std::string_view pqp = "pqp";
    Sweep sweep;
    sweep.points = {{.solver = kExactSolver, .us = 1},
                    {.solver = pqp, .tolerance = 0.1, .us = 2, .forceError = 1e-1},
                    {.solver = pqp, .tolerance = 0.001, .us = 8, .forceError = 1e-3}};
    CHECK(pointAt(sweep, pqp, 0.1)->us == Approx(2));
    CHECK(pointAt(sweep, pqp, 0.01)->us == Approx(4));
    CHECK(pointAt(sweep, pqp, 0.01)->forceError == Approx(0.01));
    CHECK(pointAt(sweep, pqp, 0.001)->us == Approx(8));
    CHECK(pointAt(sweep, pqp, 5)->us == Approx(2));
    CHECK(pointAt(sweep, pqp, 1e-9)->us == Approx(8));
    CHECK(pointAt(sweep, kExactSolver, 0.01)->us == Approx(1));
    CHECK_FALSE(pointAt(sweep, "active-set", 0.01));
}

TEST_CASE("sweep: runs beside its caller, can be cancelled, and says why it has no result", "[sweep][thread]") {
    const Pressed pressed(0.15), free(0.02);
    SweepRun run;
    const auto ended = [&] {
        return waitUntil([&] {
            run.poll();
            return !run.running();
        });
    };
    run.start(pressed.scene.world, pressed.settings, pressed.before, pressed.now, {});
    CHECK(run.running());
    run.cancel();
    CHECK_FALSE(run.running());
    CHECK(run.result() == nullptr);

    run.start(free.scene.world, free.settings, free.before, free.now, {});
    REQUIRE(ended());
    CHECK(run.result() == nullptr);
    CHECK(run.refusal().find("into contact") != std::string::npos);

    run.start(pressed.scene.world, pressed.settings, pressed.before, pressed.now, {});
    REQUIRE(ended());
    REQUIRE(run.result());
    CHECK(run.refusal().empty());
    CHECK(run.result()->tick == pressed.now.tick);

    const TempFolder folder;
    writeSweep(*run.result(), folder.path() / "sweep.csv");
    std::ifstream in(folder.path() / "sweep.csv");
    std::size_t lines = 0;
    for (std::string line; std::getline(in, line); ++lines) CHECK(std::count(line.begin(), line.end(), ',') == 10);
    CHECK(lines == run.result()->points.size() + 1);
    CHECK_THROWS(writeSweep(*run.result(), folder.path() / "missing" / "sweep.csv"));
    run.forget();
    CHECK(run.result() == nullptr);
}

}  // namespace touchstone::contact_sweep_tests
