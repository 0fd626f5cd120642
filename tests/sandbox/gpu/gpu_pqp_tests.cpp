// PQP in a compute shader against the CPU's, with the software rasterizer where there is no card.
#include "haptics/sandbox/gpu/gpu_pqp.hpp"

#include <epoxy/gl.h>

#include <catch2/catch.hpp>

#include "haptics/qp/pqp.hpp"
#include "haptics/qp/random_contacts.hpp"

namespace touchstone::gpu_pqp_tests {

using sandbox::GpuPqp;

namespace {

/// Problems of every kind and of row counts around the size of a workgroup.
std::vector<Contacts> conformanceSet(std::initializer_list<int> rowCounts) {
    std::mt19937_64 random(7);
    std::vector<Contacts> problems;
    for (const int rows : rowCounts)
        for (const ContactKind kind : kContactKinds) problems.push_back(randomContacts(random, kind, rows));
    return problems;
}

std::vector<QpProblem> problemsOf(const std::vector<Contacts>& contacts) {
    std::vector<QpProblem> problems;
    for (const Contacts& c : contacts) problems.push_back(c.problem());
    return problems;
}

SolverSettings fixedIterations(int count, bool paper) {
    SolverSettings settings;
    settings.paperForm = paper;
    settings.tolerance = 0;
    settings.maxIterations = count;
    settings.workLimit = std::int64_t(1) << 40;
    return settings;
}

}  // namespace

TEST_CASE("pqp-gpu: the card's answers are the CPU's after the same number of updates", "[gl]") {
    GpuPqp gpu;
    INFO(gpu.card());
    for (const bool paper : {false, true}) {
        const auto contacts =
            paper ? conformanceSet({1, 3, 60, 256, 300, 1000}) : conformanceSet({1, 3, 60, 256, 257, 1000, 4096});
        const auto problems = problemsOf(contacts);
        for (const int updates : {0, 1, 25}) {
            const SolverSettings settings = fixedIterations(updates, paper);
            const auto answers = gpu.solve(problems, settings);
            REQUIRE(answers.size() == problems.size());
            double worst = 0;
            for (std::size_t p = 0; p < problems.size(); ++p) {
                const auto pqp = makePqp(problems[p].rows->size());
                const SolveResult expected = pqp->solve(problems[p], settings);
                CAPTURE(paper, updates, p, problems[p].rows->size());
                REQUIRE(answers[p].iterations == expected.iterations);
                CHECK(answers[p].status == expected.status);
                double force = 1;
                for (const Multiplier& m : expected.multipliers) force += m.value;
                worst = std::max(worst, wrenchError(problems[p], answers[p].x, expected.x).force_N / force);
            }
            UNSCOPED_INFO("paper " << paper << ", " << updates << " updates: " << worst);
            CHECK(worst < 1e-4);
        }
    }
}

TEST_CASE("pqp-gpu: the work of a problem is bounded by its own rows, as on the CPU", "[gl]") {
    GpuPqp gpu;
    const auto contacts = conformanceSet({3, 300});
    const auto problems = problemsOf(contacts);
    for (const bool paper : {false, true}) {
        SolverSettings settings = fixedIterations(40, paper);
        settings.workLimit = paper ? 1'000'000 : 6000;  // 11 or 20 updates of 300 rows
        const auto answers = gpu.solve(problems, settings);
        for (std::size_t p = 0; p < problems.size(); ++p) {
            CAPTURE(paper, p);
            CHECK(answers[p].iterations == makePqp(300)->solve(problems[p], settings).iterations);
        }
    }
}

TEST_CASE("pqp-gpu: a card that fails is one sentence", "[gl]") {
    GpuPqp gpu;
    const auto contacts = conformanceSet({3});
    glEnable(GL_INVALID_INDEX);  // an error that no call of the batch makes
    CHECK_THROWS_WITH(gpu.solve(problemsOf(contacts), {}),
                      Catch::Matchers::Contains("the card's OpenGL context was lost"));
}

TEST_CASE("pqp-gpu: to a tolerance, answers are as near the optimum as the CPU's", "[gl]") {
    GpuPqp gpu;
    const auto contacts = conformanceSet({3, 60, 300});
    const auto problems = problemsOf(contacts);
    SolverSettings settings;
    settings.tolerance = 0.01;
    settings.maxIterations = 5000;
    const auto answers = gpu.solve(problems, settings);
    int solved = 0;
    for (std::size_t p = 0; p < problems.size(); ++p) {
        const auto exact = findSolver(kExactSolver)->make(problems[p].rows->size());
        const auto pqp = makePqp(problems[p].rows->size());
        const Vec6 truth = exact->solve(problems[p], {}).x;
        const SolveResult cpu = pqp->solve(problems[p], settings);
        if (cpu.status != SolveStatus::Solved) continue;
        CAPTURE(p);
        CHECK(answers[p].status == SolveStatus::Solved);
        CHECK(wrenchError(problems[p], answers[p].x, truth).force_N <
              2 * wrenchError(problems[p], cpu.x, truth).force_N + 0.02);
        ++solved;
    }
    CHECK(solved >= 9);
}

TEST_CASE("pqp-gpu: problems that it cannot solve are invalid, and the others are solved", "[gl]") {
    GpuPqp gpu;
    std::mt19937_64 random(3);
    std::vector<Contacts> contacts;
    contacts.push_back(randomContacts(random, ContactKind::Slide, 20));
    contacts.push_back(randomContacts(random, ContactKind::Slide, 20));
    contacts.back().wanted[1] = NAN;
    contacts.push_back(randomContacts(random, ContactKind::Slide, GpuPqp::kMaxRows + 1));
    contacts.emplace_back(1);  // without rows
    contacts.back().wanted << 1, 2, 3, 0, 0, 0;
    const auto problems = problemsOf(contacts);
    const auto answers = gpu.solve(problems, {});
    CHECK(answers[0].status == SolveStatus::Solved);
    CHECK(answers[1].status == SolveStatus::Invalid);
    CHECK(answers[2].status == SolveStatus::Invalid);
    CHECK(answers[3].status == SolveStatus::Solved);
    CHECK(answers[3].x == contacts[3].wanted);
    CHECK(gpu.solve({}, {}).empty());
}

}  // namespace touchstone::gpu_pqp_tests
