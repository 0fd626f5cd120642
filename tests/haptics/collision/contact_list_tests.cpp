// When a list searches and how far, with a finder that only counts.
#include <catch2/catch.hpp>

#include "haptics/collision/contact_list.hpp"

namespace touchstone::contact_list_tests {

namespace {

/// What the searches of a list were asked for.
struct Searches {
    int found = 0;                ///< number of entries that each of them finds
    std::vector<double> margins;  ///< mm
    std::vector<double> ahead;    ///< lengths of the motions, mm
};

class CountingFinder final : public PairFinder {
  public:
    explicit CountingFinder(Searches& searches) : PairFinder(Extent(Vec3::Zero()), 1), searches_(searches) {}
    PairEntries entries() const override { return PairEntries(1000); }
    float guard(const Pose&) const override { return 0; }

  private:
    bool search(const Coverage& asked, PairEntries& out) override {
        searches_.margins.push_back(asked.within.margin);
        searches_.ahead.push_back(asked.motion.shift.norm());
        out.count = searches_.found;
        return true;
    }
    void select(const PairEntries& from, const Coverage&, PairEntries& out, bool) override { out.count = from.count; }

    Searches& searches_;
};

/// A list that is asked nothing but to be complete.
class Pairs final : public ContactList {
  public:
    Pairs(Searches& searches, const LookAhead& lookAhead)
        : ContactList(std::make_unique<CountingFinder>(searches), lookAhead) {}
    Coverage coverageOf(const StraightMotion& step, double margin) const override { return {step, margin}; }
    bool appendRows(const Pose&, const Mat3&, double, RowSet&, int) const override { return true; }
    int appendNearestRows(const Pose&, const Mat3&, double, RowSet&) const override { return 0; }
    Crossed appendCrossed(const Pose&, const Pose&, const Mat3&, double, const Crossing&, RowSet&, RowSet&) override {
        return Crossed::Nothing;
    }
    Overlap remeasure(const Pose&, const Pose&, double) override { return {}; }
    Nearest nearest(const Pose&, int, int) const override { return {}; }
    double freeShare(const StraightMotion&, double atMost) override { return atMost; }
};

constexpr double kMargin = 0.01, kSlack = 0.1;

bool complete(Pairs& pairs, const Vec3& step) {
    return pairs.complete({StraightMotion({}, step, Vec3::Zero()), kMargin}, kSlack);
}

}  // namespace

TEST_CASE("contact list: steps to and fro between two directions search once for each", "[collision]") {
    Searches searches;
    searches.found = GENERATE(10, 900);  // up to 64 are used as they are
    Pairs pairs(searches, {});
    for (int tick = 0; tick < 5; ++tick)
        for (const Vec3& step : {Vec3(0.5, 0, 0), Vec3(0, 0.5, 0)}) {
            REQUIRE(complete(pairs, step));
            REQUIRE(pairs.isComplete({StraightMotion({}, step, Vec3::Zero()), kMargin}));
        }
    CHECK(searches.margins.size() == 2);
    // The third direction takes the place of the one that served longest ago.
    for (const Vec3& step : {Vec3(0, 0, 0.5), Vec3(0, 0.5, 0)}) REQUIRE(complete(pairs, step));
    CHECK(searches.margins.size() == 3);
    REQUIRE(complete(pairs, {0.5, 0, 0}));
    CHECK(searches.margins.size() == 4);
    pairs.forget();
    CHECK_FALSE(pairs.isComplete({Pose{}, kMargin}));
    REQUIRE(complete(pairs, {0.5, 0, 0}));
    CHECK(searches.margins.size() == 5);
}

TEST_CASE("contact list: where the last search found few entries, but some, the next one has twice the slack",
          "[collision]") {
    const auto [found, sparse, factor] =
        GENERATE(table<int, int, double>({{50, 128, 2}, {0, 128, 1}, {128, 128, 1}, {50, 0, 1}}));
    CAPTURE(found, sparse);
    Searches searches;
    searches.found = found;
    Pairs pairs(searches, {.sparse = sparse});
    for (const Vec3& step : {Vec3(0.5, 0, 0), Vec3(0, 0.5, 0), Vec3(0, 0, 0.5)}) REQUIRE(complete(pairs, step));
    REQUIRE(searches.margins.size() == 3);
    CHECK(searches.margins[1] == Approx(kMargin + kSlack));
    CHECK(searches.margins[2] == Approx(kMargin + factor * kSlack));
}

TEST_CASE("contact list: after a search that found many entries the next ones look half as far", "[collision]") {
    const auto [found, factor] = GENERATE(table<int, double>({{800, 0.5}, {500, 1}}));
    CAPTURE(found);
    Searches searches;
    searches.found = found;
    Pairs pairs(searches, {.ticks = 4, .dense = 500});
    const Vec3 tick(0.1, 0, 0);
    for (int k = 0; k < 3; ++k) {
        const StraightMotion motion(Pose{{10.0 * k, 0, 0}, Quat::Identity()}, tick, Vec3::Zero());
        pairs.expect(motion);
        REQUIRE(pairs.complete({motion, kMargin}, kSlack));
    }
    REQUIRE(searches.margins.size() == 3);
    for (int k = 0; k < 3; ++k) {
        CHECK(searches.margins[k] == Approx(kMargin + (k ? factor : 1) * kSlack));
        CHECK(searches.ahead[k] == Approx((k ? factor : 1) * 0.4));
    }
}

TEST_CASE("contact list: in crowded places each search looks half as far as the one before, in others twice as far",
          "[collision]") {
    Searches searches;
    Pairs pairs(searches, {.ticks = 4, .crowded = 500});
    const Vec3 tick(0.1, 0, 0);
    const std::vector<std::pair<int, double>> found{{800, 1},   {800, 0.5}, {501, 0.25}, {100, 0.125}, {61, 0.125},
                                                    {61, 0.25}, {0, 0.5},   {0, 1},      {0, 1}};
    for (std::size_t k = 0; k < found.size(); ++k) {
        CAPTURE(k);
        searches.found = found[k].first;
        const StraightMotion motion(Pose{{10.0 * double(k), 0, 0}, Quat::Identity()}, tick, Vec3::Zero());
        pairs.expect(motion);
        REQUIRE(pairs.complete({motion, kMargin}, kSlack));
        REQUIRE(searches.margins.size() == k + 1);
        CHECK(searches.margins[k] == Approx(kMargin + found[k].second * kSlack));
        CHECK(searches.ahead[k] == Approx(std::max(found[k].second * 0.4, 0.1)));
    }
}

}  // namespace touchstone::contact_list_tests
