// Reading of STEP files: what is refused before the program that reads them starts, and what happens when that fails.
#include "engine/scene/step_file.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "engine/scene/scene.hpp"
#include "tests/support/temp_folder.hpp"

namespace touchstone::step_file_tests {

using namespace touchstone::engine;
using Catch::Matchers::Contains;

namespace fs = std::filesystem;

namespace {

std::string stepText(const std::string& schema, const std::string& data = "") {
    return "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
           "FILE_SCHEMA(('" +
           schema + "'));\nENDSEC;\nDATA;\n" + data + "ENDSEC;\nEND-ISO-10303-21;\n";
}

/// A folder with one STEP file, and a program in place of the one that reads it.
class Reading {
  public:
    explicit Reading(const std::string& text) { write(file_, text); }
    ~Reading() { unsetenv("TOUCHSTONE_STEP"); }
    Reading(const Reading&) = delete;
    Reading& operator=(const Reading&) = delete;

    void program(const std::string& script) const {
        const fs::path program = folder_.path() / "reader";
        write(program, "#!/bin/sh\n" + script + "\n");
        fs::permissions(program, fs::perms::owner_all);
        setenv("TOUCHSTONE_STEP", program.c_str(), 1);
    }
    /// The sentence in which reading fails; empty if it was cancelled.
    std::string problem(const StepOptions& options = {}, const StepProgress& progress = {}) const {
        try {
            const auto read = readStep(std::span(&file_, 1), options, progress);
            REQUIRE_FALSE(read);
        } catch (const SceneError& error) {
            const std::string what = error.what();
            REQUIRE(what.starts_with(file_.string() + ": "));
            return what.substr(file_.string().size() + 2);
        }
        return "";
    }

  private:
    static void write(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }
    touchstone::test::TempFolder folder_;
    fs::path file_ = folder_.path() / "shaft.step";
};

}  // namespace

TEST_CASE("step file: what is no complete STEP file with parts is refused in a sentence", "[cad]") {
    CHECK_THAT(Reading("solid shaft").problem(), Contains("is not a STEP file"));
    CHECK_THAT(Reading("").problem(), Contains("is empty"));
    CHECK_THAT(Reading(stepText("AUTOMOTIVE_DESIGN").substr(0, 120)).problem(), Contains("is truncated"));
    CHECK_THAT(Reading(stepText("IFC4")).problem(), Contains("schema IFC4") && Contains("AP203, AP214 or AP242"));
    std::string none = stepText("AP242");
    none.erase(none.find("FILE_SCHEMA"), 24);
    CHECK_THAT(Reading(none).problem(), Contains("FILE_SCHEMA"));
    const fs::path missing = "/missing/shaft.step";
    CHECK_THROWS_WITH(readStep(std::span(&missing, 1), {}), "/missing/shaft.step: does not exist; name a STEP file");
}

TEST_CASE("step file: a reader that crashes, hangs, needs too much memory or is another is a sentence", "[cad]") {
    const Reading reading("/* a comment */ " +
                          stepText("AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 }"));
    reading.program("echo progress 0.5 reading shaft.step >&2; kill -SEGV $$");
    CHECK_THAT(reading.problem(),
               Contains("crash") && Contains("while reading shaft.step") && Contains("heal the part"));
    reading.program("kill -XCPU $$");
    CHECK_THAT(reading.problem(), Contains("busy without end") && Contains("export it again"));
    reading.program("sleep 1000");
    CHECK_THAT(reading.problem({.maxSeconds = 0}), Contains("not read within 0 s"));
    CHECK(reading.problem({}, [](const std::string&, double) { return false; }).empty());
    reading.program("echo error memory >&2; exit 1");
    CHECK_THAT(reading.problem({.maxBytes = 1ull << 30}), Contains("more than 1 GB of memory"));
    reading.program("echo another format");
    CHECK_THAT(reading.problem(), Contains("not of this version"));
    setenv("TOUCHSTONE_STEP", "", 1);
    CHECK_THAT(reading.problem(),
               Contains("touchstone-step, which is missing") && Contains("libocct-data-exchange-dev"));
}

}  // namespace touchstone::step_file_tests
