#include <catch2/catch.hpp>
#include <vector>

#include "haptics/qp/warm_start.hpp"

namespace touchstone::qp_warm_start_tests {
namespace {

RowSet rowsOf(const std::vector<std::uint64_t>& ids) {
    RowSet rows(8);
    for (const std::uint64_t id : ids) rows.push(Vec6::Constant(1), 0, id);
    return rows;
}

std::vector<int> visited(const WarmStart& start, const RowSet& rows, std::size_t limit = 100) {
    std::vector<int> found;
    start.forEachRow(rows, [&](int row) {
        found.push_back(row);
        return found.size() < limit;
    });
    return found;
}

}  // namespace

TEST_CASE("warm start: finds its contacts at their new places, in the order of the answer", "[qp]") {
    WarmStart start(4);
    for (const std::uint64_t id : {30, 10, 99, 20}) start.remember(id, double(id));
    const RowSet rows = rowsOf({5, 10, 20, 30});
    CHECK(visited(start, rows) == std::vector<int>{3, 1, 2});
    CHECK(visited(start, rows, 2) == std::vector<int>{3, 1});
    CHECK(visited(start, rowsOf({})).empty());
    start.forget();
    CHECK(visited(start, rows).empty());
}

TEST_CASE("warm start: looks up forces in ascending order, and a new contact gets the other value", "[qp]") {
    WarmStart start(3);
    for (const std::uint64_t id : {10, 20, 40}) start.remember(id, 0.5 * double(id));
    WarmStart::ForceLookup forces(start);
    CHECK(forces.forceOf(5, -1) == -1);
    CHECK(forces.forceOf(10, -1) == 5);
    CHECK(forces.forceOf(30, -1) == -1);
    CHECK(forces.forceOf(40, -1) == 20);
    CHECK(forces.forceOf(50, -1) == -1);
    // An identity out of order is a new contact, never another one's force.
    CHECK(forces.forceOf(20, -1) == -1);
}

}  // namespace touchstone::qp_warm_start_tests
