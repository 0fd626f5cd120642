// Pictures written to disk and read back.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "engine/view/image_file.hpp"

namespace touchstone::image_tests {

using namespace touchstone::engine;

namespace {

/// A temporary folder for each test, removed afterwards.
struct TemporaryFolder {
    std::filesystem::path path;

    explicit TemporaryFolder(const char* name) : path(std::filesystem::path(TOUCHSTONE_BINARY_DIR) / name) {
        std::filesystem::remove_all(path);
        std::filesystem::create_directories(path);
    }
    ~TemporaryFolder() { std::filesystem::remove_all(path); }
};

}  // namespace

TEST_CASE("image file: a PNG is read back as it was written", "[image]") {
    const TemporaryFolder folder("view_image_round_trip");
    const Image image{
        2, 3, {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 10, 20, 30, 128, 255, 255, 255, 255, 0, 0, 0, 255}};
    writePng(folder.path / "picture.png", image);
    const Image back = readPng(folder.path / "picture.png");
    REQUIRE(back.width == 2);
    REQUIRE(back.height == 3);
    REQUIRE(back.rgba == image.rgba);
}

TEST_CASE("image file: errors name the path", "[image]") {
    const TemporaryFolder folder("view_image_errors");
    REQUIRE_THROWS_WITH(readPng(folder.path / "missing.png"), Catch::Contains("missing.png"));
    std::ofstream(folder.path / "text.png") << "no picture";
    REQUIRE_THROWS_WITH(readPng(folder.path / "text.png"), Catch::Contains("text.png"));
    REQUIRE_THROWS_WITH(writePng(folder.path / "no/such/folder.png", {1, 1, {1, 2, 3, 255}}),
                        Catch::Contains("folder.png"));
}

}  // namespace touchstone::image_tests
