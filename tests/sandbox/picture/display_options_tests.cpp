// The list of displays on the command line.
#include "haptics/sandbox/picture/display_options.hpp"

#include <catch2/catch.hpp>
#include <set>

namespace touchstone::display_options_tests {

using namespace touchstone::sandbox;
using Catch::Matchers::Contains;

TEST_CASE("display options: every switch has a unique key and name, and turns on and off", "[display]") {
    std::set<char> keys;
    for (const DisplaySwitch& which : displaySwitches()) {
        INFO(which.name);
        CHECK(keys.insert(which.key).second);
        CHECK(std::string_view("RFHSQ").find(which.key) == std::string_view::npos);  // keys of other commands
        DisplayOptions options;
        for (const bool on : {true, false, true}) {
            CHECK(applyShowList(options, (on ? "" : "no-") + std::string(which.name)) == "");
            CHECK(isOn(options, which) == on);
        }
    }
}

TEST_CASE("display options: a list accepts levels and axes, and names unknown entries", "[display]") {
    DisplayOptions options;
    CHECK(applyShowList(options, "trees:2,no-grid,section:y") == "");
    CHECK(options.toolLevel == 2);
    CHECK(options.obstacleLevel == 2);
    CHECK_FALSE(options.grid);
    CHECK(options.section);
    CHECK(options.sectionAxis == 1);
    CHECK(applyShowList(options, "") == "");
    CHECK_THAT(applyShowList(options, "contacts,spheres"), Contains("'spheres'") && Contains("trees"));
    CHECK_THAT(applyShowList(options, "trees:top"), Contains("'trees:top'") && Contains("level"));
    CHECK_THAT(applyShowList(options, "section:w"), Contains("section:x"));
    CHECK_THAT(applyShowList(options, "grid:1"), Contains("colon"));
    CHECK(applyShowList(options, ",") != "");
}

}  // namespace touchstone::display_options_tests
