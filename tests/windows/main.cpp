// The tests' main function: Debian compiles Catch2's for Linux alone.
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
