// Compares pictures of scenes with those in tests/scenes/pictures, which tools/renew_pictures regenerates.
#include <catch2/catch.hpp>

#include <cstdlib>
#include <filesystem>

#include "engine/view/image_file.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"
#include "haptics/sandbox/session/headless_run.hpp"
#include "tests/support/image_difference.hpp"

namespace touchstone::picture_tests {

using test::difference;
using test::ImageDifference;

namespace {

namespace fs = std::filesystem;

// Mean difference, of 255, and share of pixels (see image_difference.hpp). Drivers differ less than pictures with and
// without multisampling, which differ by up to 0.8 and by 0.002, except for spheres, whose edges consist of samples.
constexpr double kMaxMean = 1, kMaxShare = 0.003;

bool similar(const ImageDifference& d) { return d.mean <= kMaxMean && d.share <= kMaxShare; }

struct PictureCase {
    const char *name, *scene;
    double seconds;
    const char *show, *view;
    const char* change;  ///< of the displays; the tolerance must detect it
};

// Without labels, because systems have different fonts. Where flat faces rest on each other, without contacts: which of
// them carry the load depends on the rounding of the processor.
constexpr PictureCase kCases[]{
    {"bunnies", "bunnies", 2.6, "no-values", "", "no-forces,no-ghost"},
    {"bunnies-contact", "bunnies", 2.6, "no-values,section", "contact", "no-contacts"},
    {"bunnies-gaps", "bunnies", 2.6, "no-values,gaps,clearance", "contact", "no-gaps"},
    {"bunnies-trees", "bunnies", 0.2, "no-values,trees:1", "", "trees:2"},
    {"spline-section", "spline", 1.4, "no-values,no-contacts,section,trace", "", "no-section"},
    {"spline-inside", "spline", 2.8, "no-values,section,clearance", "contact", "section:x"},
    {"dental-pocket", "dental-inflamed", 5.4, "no-values,section:z", "contact", "no-section"},
    {"drawer-jammed", "drawer", 4.4, "no-values", "top", "no-forces,no-ghost"},
    {"incline", "incline", 2.6, "no-values", "contact", "no-contacts,no-forces"},
    {"wedge", "wedge", 2.2, "no-values", "front", "no-ghost"},
};

}  // namespace

TEST_CASE("pictures: scenes look unchanged, within the differences between drivers", "[gl][slow]") {
    const fs::path folder = fs::path(TOUCHSTONE_SOURCE_DIR) / "tests/scenes/pictures";
    const fs::path drawn = fs::path(TOUCHSTONE_BINARY_DIR) / "pictures";
    fs::create_directories(drawn);
    const bool renew = std::getenv("TOUCHSTONE_RENEW_PICTURES") != nullptr;

    std::string opened;
    sandbox::HapticScene scene;
    for (const PictureCase& which : kCases) {
        CAPTURE(which.name);
        if (opened != which.scene)
            scene = sandbox::openScene(fs::path(TOUCHSTONE_BINARY_DIR) / "scenes" / (std::string(which.scene) + ".glb"),
                                       {.treeCache = TOUCHSTONE_BINARY_DIR "/trees",
                                        .progress = {},
                                        .allTrees = which.scene == std::string("bunnies")});
        opened = which.scene;
        REQUIRE(scene.world);

        sandbox::HeadlessOptions options;
        options.timing = false;
        options.seconds = which.seconds;
        std::vector<TickRecord> ticks;
        options.onTick = [&](const TickRecord& record, double) { ticks.push_back(record); };
        const TickRecord last = sandbox::runHeadless(scene, scene.settings, options).last;

        sandbox::ScenePicture picture{.view = which.view, .width = 320, .height = 200, .before = ticks};
        REQUIRE(applyShowList(picture.display, which.show) == "");
        const engine::Image image = renderScene(scene, last, scene.settings, picture);
        const fs::path reference = folder / (std::string(which.name) + ".png");
        if (renew) engine::writePng(reference, image);

        const fs::path written = drawn / reference.filename();
        engine::writePng(written, image);
        const ImageDifference d = difference(image, engine::readPng(reference));
        INFO("mean difference " << d.mean << ", share of pixels " << d.share << "; compare " << written << " with "
                                << reference);
        CHECK(similar(d));

        REQUIRE(applyShowList(picture.display, which.change) == "");
        const ImageDifference changed =
            difference(renderScene(scene, last, scene.settings, picture), engine::readPng(reference));
        INFO(which.change << ": mean difference " << changed.mean << ", share of pixels " << changed.share);
        CHECK_FALSE(similar(changed));
    }
}

}  // namespace touchstone::picture_tests
