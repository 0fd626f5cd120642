#include <catch2/catch.hpp>
#include <fstream>

#include "engine/ui/user_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace touchstone::user_files_tests {

using namespace touchstone::test;

TEST_CASE("recent scenes: newest first, each once, kept between runs, without missing files", "[edit]") {
    const TempFolder folder;
    const auto make = [&](const std::string& name) {
        const auto file = folder.path() / name;
        std::ofstream(file) << "x";
        return file;
    };
    const auto a = make("a.glb"), b = make("b b.glb"), config = folder.path() / "config" / "deep";
    {
        engine::RecentScenes recent(config);
        recent.add(a);
        recent.add(b);
        recent.add(a);
        CHECK(recent.list() == std::vector{a, b});
    }
    CHECK(engine::RecentScenes(config).list() == std::vector{a, b});
    std::filesystem::remove(b);
    CHECK(engine::RecentScenes(config).list() == std::vector{a});
    CHECK(engine::RecentScenes().list().empty());
}

}  // namespace touchstone::user_files_tests
