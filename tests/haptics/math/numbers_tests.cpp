#include "haptics/math/numbers.hpp"

#include <catch2/catch.hpp>
#include <limits>

namespace touchstone::numbers_tests {

TEST_CASE("numbers: only finite values within the range are accepted", "[numbers]") {
    constexpr double kMax = std::numeric_limits<double>::max(), kInfinity = std::numeric_limits<double>::infinity();
    CHECK(isWithin(1, 1, 2));
    CHECK(isWithin(2, 1, 2));
    CHECK_FALSE(isWithin(2.0000001, 1, 2));
    for (const double value : {kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()})
        CHECK_FALSE(isWithin(value, -kMax, kMax));
}

TEST_CASE("numbers: the whole text must be a number, in any of its forms", "[numbers]") {
    CHECK(readNumber("0.5", 0, 1) == 0.5);
    CHECK(readNumber(".5", 0, 1) == 0.5);
    CHECK(readNumber("5e-1", 0, 1) == 0.5);
    CHECK(readNumber("+1", 0, 1) == 1);
    CHECK(readNumber("-0", 0, 1) == 0);
    for (const char* text : {"", " ", "1 ", " 1", "1x", "0x1", "0,5", "nan", "NaN", "inf", "-inf", "infinity", "1e309",
                             "+", "+-1", "--1", "1e", "2", "-1"}) {
        INFO(text);
        CHECK_FALSE(readNumber(text, 0, 1));
    }
    CHECK(rangeWords(0.001, 100, "N/mm") == "a number from 0.001 to 100 N/mm");
    CHECK(rangeWords(1, 64, {}, true) == "a whole number from 1 to 64");
}

}  // namespace touchstone::numbers_tests
