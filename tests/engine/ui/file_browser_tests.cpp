#include "engine/ui/file_browser.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>

#include "engine/ui/user_files.hpp"
#include "tests/support/temp_folder.hpp"

namespace touchstone::file_browser_tests {

using engine::FileBrowser;
using test::TempFolder;
namespace fs = std::filesystem;

TEST_CASE("file browser: enters the nearest folder that exists, and nothing is selected there", "[edit]") {
    const TempFolder folder;
    fs::create_directories(folder.path() / "a/b");
    FileBrowser browser({".glb"});
    browser.enter(folder.path() / "a/b/");
    CHECK(browser.folder() == folder.path() / "a/b");
    browser.enter(folder.path() / "a/missing/deeper");
    CHECK(browser.folder() == folder.path() / "a");
    CHECK(browser.selected().empty());
    browser.enter("/");
    CHECK(browser.folder() == "/");
}

TEST_CASE("browsed folder: kept between runs, that of the start without one, and a removed one is forgotten",
          "[edit]") {
    const TempFolder folder;
    const fs::path config = folder.path() / "config", last = folder.path() / "some scenes";
    fs::create_directories(last);
    const fs::path start = fs::current_path();
    CHECK(engine::browsedFolder(config) == start);
    engine::keepFolder(config, last);
    CHECK(engine::browsedFolder(config) == last);
    CHECK(engine::browsedFolder({}) == start);
    fs::remove(last);
    CHECK(engine::browsedFolder(config) == start);
    const char* home = std::getenv("HOME");
    fs::current_path("/");  // where a desktop's menu starts it
    if (home) CHECK(engine::browsedFolder(config) == home);
    fs::current_path(start);
}

}  // namespace touchstone::file_browser_tests
