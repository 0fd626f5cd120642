#include <catch2/catch.hpp>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "haptics/sandbox/measure/report.hpp"

namespace touchstone::report_tests {

using nlohmann::ordered_json;

namespace {

bool hasNullOrNan(const ordered_json& json, const std::string& path, std::vector<std::string>& found) {
    if (json.is_null() || (json.is_number_float() && !std::isfinite(json.get<double>()))) found.push_back(path);
    if (json.is_structured())
        for (const auto& [key, value] : json.items()) hasNullOrNan(value, path + "/" + key, found);
    return !found.empty();
}

}  // namespace

TEST_CASE("report: has every key, and only the late ticks of a run without a clock are null", "[sandbox]") {
    Settings settings;
    sandbox::Report report = sandbox::reportOf("scene", "demo", settings);
    sandbox::RunStatistics statistics;
    for (int i = 0; i < 10; ++i) {
        TickRecord record;
        record.tick = static_cast<std::uint64_t>(i);
        record.wrench_C.force = Vec3(1 + i, 0, 0);
        record.wrench_out.force = Vec3(i, 0, 0);
        record.shadowRows = 4;
        record.shadowForceError = 0.001 * i;
        record.shadowUs = 2;
        record.totalUs = i == 7 ? 1502 : 12;
        if (i < 3) record.flags = kUnfinished;
        record.pairs = record.rows = 5;
        statistics.add(record, 0, 1);
        statistics.addTimes(record);
    }
    statistics.write(report);
    report.checks = {{"max_penetration_mm", 0.001, 0, true}};
    const ordered_json json = sandbox::toJson(report);
    const std::vector<std::pair<std::string, std::vector<std::string>>> keys{
        {"scene", {}},
        {"mode", {}},
        {"solver", {}},
        {"shadow", {}},
        {"ticks", {}},
        {"step_us", {"p50", "p99", "p999", "max"}},
        {"collision_us", {"p50", "p99", "p999", "max"}},
        {"solve_us", {"p50", "p99", "p999", "max"}},
        {"shadow_us", {"p50", "p99", "p999", "max"}},
        {"pairs", {"p50", "max"}},
        {"rows", {"p50", "max"}},
        {"iterations", {"p50", "max"}},
        {"rows_truncated", {}},
        {"penetration_mm", {"p99", "max"}},
        {"hover_mm", {"p99", "max"}},
        {"force_N", {"max"}},
        {"torque_mNm", {"max"}},
        {"dforce_N_per_ms", {"p99", "max"}},
        {"shadow_force_error_N", {"p50", "p99", "max"}},
        {"kkt", {"primal_mm", "dual_N", "stationarity_N", "complementarity_mJ"}},
        {"infeasible", {}},
        {"overruns", {}},
        {"dropped", {}},
        {"hash", {}},
        {"margin_used_mm", {"p50", "max"}},
        {"force_out_N", {"max"}},
        {"safety_trips", {}},
        {"safety_fault", {}},
        {"device_trouble", {}},
        {"outcome", {"met", "checks"}}};
    for (const auto& [key, inner] : keys) {
        INFO(key);
        REQUIRE(json.contains(key));
        for (const std::string& name : inner) CHECK(json.at(key).contains(name));
    }
    std::vector<std::string> absent;
    hasNullOrNan(json, "", absent);
    CHECK(absent == std::vector<std::string>{"/overruns"});
    CHECK(json.at("step_us").at("p50") == 10);  // without the shadow's 2
    CHECK(json.at("step_cpu_ms") == Approx(1.59));
    CHECK(json.at("unfinished") == 3);
    CHECK(json.at("longer_than_period") == 1);
    CHECK(json.at("dforce_N_per_ms").at("max") == 1);
    CHECK(json.at("force_N").at("max") == 10);
    CHECK(json.at("force_out_N").at("max") == 9);
    CHECK(json.at("outcome").at("checks").at(0).at("name") == "max_penetration_mm");
    CHECK(json.at("outcome").at("met") == true);
    CHECK(json.at("hash").get<std::string>().size() == 16);
}

TEST_CASE("report: the shadow's error counts only with a noticeable force and the same rows", "[sandbox]") {
    sandbox::RunStatistics statistics;
    const auto add = [&](double force, std::uint32_t flags, int shadowRows, double error) {
        TickRecord record;
        record.wrench_C.force = Vec3(0, force, 0);
        record.flags = flags;
        record.shadowRows = shadowRows;
        record.shadowForceError = error;
        statistics.add(record, 0, 1);
    };
    add(0.019, 0, 3, 100);
    add(1, kInfeasible, 3, 200);
    add(1, 0, 0, 300);
    sandbox::Report report;
    statistics.write(report);
    CHECK_FALSE(report.shadowForceError.max);
    CHECK(sandbox::toJson(report).at("shadow_force_error_N").at("max").is_null());
    add(0.021, 0, 3, 0.5);
    add(1, kCapped, 3, 0.25);
    statistics.write(report);
    CHECK(report.shadowForceError.max == 0.5);
    CHECK(report.shadowForceError.p50 == 0.25);
    CHECK(report.infeasible == 1);
}

TEST_CASE("report: an unmet check makes the outcome unmet", "[sandbox]") {
    sandbox::Report report;
    CHECK(report.met());
    report.checks = {{"a", 1, 0, true}, {"b", 1, 2, false}};
    CHECK_FALSE(report.met());
}

TEST_CASE("report: the hash depends on the order of the ticks", "[sandbox]") {
    TickRecord a, b;
    a.tick = 1;
    b.tick = 2;
    const auto hashOf = [](const std::vector<TickRecord>& ticks) {
        sandbox::RunStatistics statistics;
        for (const TickRecord& tick : ticks) statistics.add(tick, 0, 1);
        return statistics.hash();
    };
    CHECK(hashOf({a, b}) == hashTick(b, hashTick(a)));
    CHECK(hashOf({a, b}) != hashOf({b, a}));
    TickRecord timed = a;
    timed.totalUs = timed.collisionUs = timed.shadowUs = 5;
    timed.shadowForceError = 1;
    CHECK(hashOf({timed}) == hashOf({a}));
}

}  // namespace touchstone::report_tests
