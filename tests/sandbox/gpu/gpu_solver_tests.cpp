// PQP on the card as a solver of the tick, with the software rasterizer where there is no card.
#include "haptics/sandbox/gpu/gpu_solver.hpp"

#include <catch2/catch.hpp>
#include <thread>

#include "haptics/loop/step.hpp"
#include "haptics/loop/work_limits.hpp"
#include "haptics/qp/random_contacts.hpp"
#include "haptics/sandbox/measure/contact_sweep.hpp"
#include "haptics/sandbox/session/session.hpp"
#include "tests/support/ground_world.hpp"
#include "tests/support/ui_scene.hpp"

namespace touchstone::gpu_solver_tests {

using namespace sandbox;
using namespace test;

namespace {

/// Its row of the table.
const SolverInfo& pqpGpu() {
    if (!findSolver("pqp-gpu")) addGpuSolver();
    return *findSolver("pqp-gpu");
}

Settings withSolver(std::string_view solver) {
    Settings settings;
    settings.geometry = Geometry::Spheres;
    settings.solver = solver;
    settings.shadow = kNoSolver;
    settings.tolerance = 1e-4;
    return settings;
}

/// The ticks of a tool that is pressed into the ground and drawn along it.
std::vector<TickRecord> press(const Settings& settings, int ticks) {
    const auto world = groundBelow();
    TickState state(*world);
    std::vector<TickRecord> records;
    for (int i = 0; i < ticks; ++i) {
        Pose device = world->X_WT_start;
        device.p += Vec3(0.02 * i, -0.2 * i, 0);
        records.push_back(step(*world, settings, {.X_WT_device = device}, state));
    }
    return records;
}

}  // namespace

TEST_CASE("pqp-gpu: ticks have the exact solver's forces, and the same bits when repeated", "[gl]") {
    constexpr int kTicks = 40;
    const auto card = press(withSolver(pqpGpu().name), kTicks), again = press(withSolver(pqpGpu().name), kTicks),
               exact = press(withSolver(kExactSolver), kTicks);
    std::uint64_t hash = hashTick(card.front()), repeated = hashTick(again.front());
    for (std::size_t i = 0; i < card.size(); ++i) {
        CAPTURE(i);
        CHECK((card[i].flags & kByProcessor) == 0);
        CHECK((card[i].wrench_C.force - exact[i].wrench_C.force).norm() < 1e-3);
        hash = hashTick(card[i], hash), repeated = hashTick(again[i], repeated);
    }
    CHECK(exact.back().wrench_C.force.norm() > 1);
    CHECK(hash == repeated);
}

TEST_CASE("pqp-gpu: if the card is late, the processor's pqp answers, and the tick says so", "[gl]") {
    Settings hurried = withSolver(pqpGpu().name);
    hurried.solverWait = 0;
    const auto late = press(hurried, 40), processor = press(withSolver("pqp"), 40);
    int flagged = 0;
    for (std::size_t i = 0; i < late.size(); ++i) {
        CAPTURE(i);
        CHECK(late[i].X_WT.p == processor[i].X_WT.p);
        CHECK(late[i].wrench_C.force == processor[i].wrench_C.force);
        flagged += (late[i].flags & kByProcessor) != 0;
    }
    CHECK(flagged > 20);
    // The card is free again once it has solved what nobody waits for.
    const auto patient = press(withSolver(pqpGpu().name), 40);
    for (const TickRecord& record : patient) CHECK((record.flags & kByProcessor) == 0);
}

TEST_CASE("pqp-gpu: several threads use the card, each with its own answers", "[gl]") {
    const SolverInfo& info = pqpGpu();
    REQUIRE(isUsable(info));
    const SolverSettings settings{.tolerance = 0, .maxIterations = 30};
    std::vector<Contacts> contacts;
    std::mt19937_64 random(3);
    for (int i = 0; i < 24; ++i) contacts.push_back(randomContacts(random, ContactKind::Slide, 20 + 10 * i));
    const auto pqp = findSolver("pqp")->make(500);
    std::vector<Vec6> expected, got(contacts.size());
    for (const Contacts& c : contacts) {
        pqp->reset();
        expected.push_back(pqp->solve(c.problem(), settings).x);
    }
    {
        std::vector<std::jthread> threads;
        for (std::size_t t = 0; t < 3; ++t)
            threads.emplace_back([&, t] {
                const auto solver = info.make(500);
                for (std::size_t i = t; i < contacts.size(); i += 3)
                    if (const SolveResult r = solver->solve(contacts[i].problem(), settings); !r.byProcessor)
                        got[i] = r.x;
            });
    }
    for (std::size_t i = 0; i < contacts.size(); ++i) {
        CAPTURE(i);
        CHECK(wrenchError(contacts[i].problem(), got[i], expected[i]).force_N < 1e-3);
    }
}

TEST_CASE("pqp-gpu: more rows than the card takes are the processor's", "[gl]") {
    std::mt19937_64 random(3);
    const Contacts contacts = randomContacts(random, ContactKind::Slide, 5000);
    const SolverSettings settings{.tolerance = 1e-3};
    const auto card = pqpGpu().make(5000), pqp = findSolver("pqp")->make(5000);
    const SolveResult result = card->solve(contacts.problem(), settings);
    CHECK(result.byProcessor);
    CHECK(result.x == pqp->solve(contacts.problem(), settings).x);
}

TEST_CASE("pqp-gpu: as a shadow it is measured, and as a point of a sweep down to what single precision reaches",
          "[gl][sweep]") {
    Settings settings = withSolver(kExactSolver);
    settings.shadow = pqpGpu().name;
    const auto world = groundBelow();
    TickState state(*world);
    Pose device = world->X_WT_start;
    device.p.y() -= 5;
    device.q = Quat(Eigen::AngleAxisd(0.1, Vec3::UnitZ()));
    TickRecord before, now;
    for (int i = 0; i < 20; ++i) before = std::exchange(now, step(*world, settings, {.X_WT_device = device}, state));
    CHECK(now.shadowRows > 0);
    CHECK(now.shadowStatus == SolveStatus::Solved);
    CHECK(now.shadowForceError < 1e-2);
    CHECK(now.shadowIterations > 0);

    const auto contact = freezeContact(*world, settings, before, now, {});
    REQUIRE(contact);
    const auto sweep = sweepContact(*contact);
    REQUIRE(sweep);
    int points = 0;
    for (const SweepPoint& point : sweep->points) {
        if (point.solver != pqpGpu().name) continue;
        ++points;
        CHECK(point.tolerance > 0.99e-5);
        CHECK(point.status != SolveStatus::Invalid);
        CHECK(point.us > 0);
    }
    CHECK(points == 11);

    settings.solverWait = 0;
    const TickRecord late = step(*world, settings, {.X_WT_device = device}, state);
    CHECK(late.shadowStatus == SolveStatus::Invalid);  // an answer of another solver is not measured as its own
}

TEST_CASE("pqp-gpu: a window renders with it only where its round trip fits a tick, and says so", "[gl][session]") {
    const RoundTrip& trip = pqpGpu().roundTrip();
    INFO(trip.us << " µs, " << trip.updateUs << " µs an update");
    CHECK(trip.trouble.empty());
    CHECK(trip.us > 0);
    CHECK(trip.updateUs > 0);
    const bool fits = trip.us + kLeastUpdates * trip.updateUs < 300;
    const TempFolder folder;
    SessionOptions options;
    options.treeCache.clear();
    options.loop.realTime.raise = false;
    LiveSession session(options);
    session.open({holdFile(folder)});
    REQUIRE(waitUntil([&] {
        session.update();
        return session.running();
    }));
    Settings settings = session.settings();
    settings.solver = settings.shadow = pqpGpu().name;
    session.setSettings(settings);
    const std::string_view expected = fits ? pqpGpu().name : "pqp";
    CHECK(session.settings().solver == expected);
    CHECK(session.settings().shadow == expected);
    const auto said = std::count_if(session.log().messages().begin(), session.log().messages().end(),
                                    [](const Message& m) { return m.text.starts_with("pqp-gpu is not used here"); });
    CHECK(said == (fits ? 0 : 2));
}

TEST_CASE("session: a card that is late or lost is said once, and the run goes on", "[session]") {
    /// A card that is fast when it is measured, and never answers.
    class Lost final : public Solver {
      public:
        SolveResult solve(const QpProblem& problem, const SolverSettings& settings) noexcept override {
            SolveResult result = pqp_->solve(problem, settings);
            result.byProcessor = true;
            return result;
        }
        void reset() noexcept override { pqp_->reset(); }

      private:
        std::unique_ptr<Solver> pqp_ = findSolver("pqp")->make(1 << 15);
    };
    addSolver({"lost", "", false, [](int) -> std::unique_ptr<Solver> { return std::make_unique<Lost>(); },
               []() -> const RoundTrip& {
                   static const RoundTrip trip{.trouble = "", .us = 1, .updateUs = 1};
                   return trip;
               }});
    const TempFolder folder;
    SessionOptions options;
    options.treeCache.clear();
    options.loop.realTime.raise = false;
    std::uint64_t flagged = 0;
    options.onTick = [&](const TickRecord& record) { flagged += (record.flags & kByProcessor) != 0; };
    options.adjust = [](Settings settings) {
        settings.solver = "lost";
        return settings;
    };
    LiveSession session(options);
    session.open({holdFile(folder)});
    REQUIRE(waitUntil([&] {
        session.update();
        return flagged > 100;
    }));
    CHECK(std::count_if(session.log().messages().begin(), session.log().messages().end(), [](const Message& m) {
              return m.text.starts_with("The solver's card was late or lost");
          }) == 1);
}

}  // namespace touchstone::gpu_solver_tests
