// Opening a STEP file in place of a scene.
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>

#include "haptics/sandbox/session/scene_opening.hpp"
#include "tests/support/temp_folder.hpp"

namespace touchstone::step_opening_tests {

using namespace touchstone::sandbox;
using Catch::Matchers::Contains;

namespace {

const std::filesystem::path kFiles = TOUCHSTONE_SOURCE_DIR "/tests/step/files";

std::unique_ptr<SceneOpening> opened(const std::string& name, const std::filesystem::path& cache, bool cancel = false) {
    auto opening = std::make_unique<SceneOpening>(SceneRequest{.file = kFiles / name}, cache, nullptr);
    if (cancel) opening->cancel();
    while (!opening->done()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return opening;
}

}  // namespace

TEST_CASE("step opening: the solids of a file become a scene that can be edited and saved", "[cad]") {
    if (!std::filesystem::exists(TOUCHSTONE_BINARY_DIR "/touchstone-step")) return;
    const test::TempFolder cache;
    const auto stand = opened("stand-ap242.step", cache.path());
    INFO(stand->error);
    REQUIRE(stand->scene);
    CHECK(stand->file.filename() == "stand-ap242.glb");
    CHECK(stand->scene->scene.file == stand->file);
    CHECK(std::filesystem::exists(stand->file));
    CHECK(stand->scene->scene.nodes.size() == 3);
    CHECK_FALSE(stand->scene->missing.empty());  // the user chooses tool and obstacles

    CHECK_THAT(opened("open-shell.step", cache.path())->error, Contains("part 'pin'") && Contains("open at"));
    const auto cancelled = opened("stand-ap242.step", cache.path(), true);
    CHECK_FALSE(cancelled->scene);
    CHECK(cancelled->error.empty());
}

TEST_CASE("step opening: without the reader it fails in a sentence", "[cad]") {
    const test::TempFolder cache;
    setenv("TOUCHSTONE_STEP", "", 1);
    const auto stand = opened("stand-ap242.step", cache.path());
    unsetenv("TOUCHSTONE_STEP");
    CHECK_FALSE(stand->scene);
    CHECK_THAT(stand->error, Contains("libocct-data-exchange-dev"));
}

}  // namespace touchstone::step_opening_tests
