// Output files are complete or absent: after any failure the earlier file is unchanged.
#include "haptics/files/output_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <iterator>

#include "tests/support/file_size_limit.hpp"
#include "tests/support/temp_folder.hpp"

namespace touchstone::output_file_tests {

using Catch::Matchers::Contains;
using test::FileSizeLimit;
using test::TempFolder;

namespace {

namespace fs = std::filesystem;

std::string textOf(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::ptrdiff_t filesIn(const fs::path& folder) {
    return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
}

}  // namespace

TEST_CASE("output file: appears in its place when it is closed, and not before", "[files]") {
    const TempFolder folder;
    const fs::path file = folder.path() / "report";
    writeFile(file, "the report", "earlier");
    {
        OutputFile out(file, "the report");
        out.write("la");
        out.write("ter");
        CHECK(textOf(file) == "earlier");
        out.close();
        CHECK(textOf(file) == "later");
    }
    { OutputFile(file, "the report").write("never closed"); }
    CHECK(textOf(file) == "later");
    CHECK(filesIn(folder.path()) == 1);
}

TEST_CASE("output file: a full disk leaves the earlier file, and the error says why", "[files]") {
    const TempFolder folder;
    const fs::path file = folder.path() / "report";
    writeFile(file, "the report", "earlier");
    for (const std::size_t size : {std::size_t{2000}, std::size_t{5} << 20}) {  // detected on closing, and before
        const FileSizeLimit limit(1000);
        CHECK_THROWS_WITH(writeFile(file, "the report", std::string(size, 'x')),
                          Contains("cannot write the report to '" + file.string() + "': File too large"));
    }
    CHECK(textOf(file) == "earlier");
    CHECK(filesIn(folder.path()) == 1);
    CHECK_THROWS_WITH(writeFile("/dev/full", "the table", "x"), Contains("No space left on device"));
}

TEST_CASE("output file: follows links, keeps modes, and writes to other than regular files", "[files]") {
    const TempFolder folder;
    const fs::path file = folder.path() / "real", link = folder.path() / "link";
    writeFile(file, "the report", "earlier");
    fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
    fs::create_symlink("real", link);
    writeFile(link, "the report", "later");
    CHECK(fs::is_symlink(link));
    CHECK(textOf(file) == "later");
    CHECK(fs::status(file).permissions() == (fs::perms::owner_read | fs::perms::owner_write));
    CHECK_NOTHROW(writeFile("/dev/null", "the report", "x"));
    CHECK(fs::is_character_file("/dev/null"));
    CHECK_THROWS_WITH(writeFile(folder.path(), "the report", "x"), Contains("Is a directory"));
    CHECK_THROWS_WITH(writeFile(folder.path() / "no" / "report", "the report", "x"),
                      Contains("No such file or directory"));
}

}  // namespace touchstone::output_file_tests
