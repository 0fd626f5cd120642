#include "haptics/sandbox/picture/scene_cards.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/support/ui_scene.hpp"

namespace touchstone::scene_cards_tests {

using namespace touchstone::sandbox;
using namespace touchstone::test;
namespace fs = std::filesystem;

namespace {

std::shared_ptr<const SceneCard> complete(SceneCards& cards, const fs::path& file) {
    REQUIRE(waitUntil([&] { return cards.find(file)->complete; }));
    return cards.find(file);
}

std::size_t pictures(const fs::path& cache) {
    std::error_code error;
    const fs::directory_iterator all(cache / "pictures", error);
    return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

}  // namespace

TEST_CASE("scene cards: a sentence and a picture are made in the background, and the picture is kept", "[gl]") {
    const TempFolder folder;
    const fs::path file = folder.path() / "scene.glb", cache = folder.path() / "cache";
    engine::Scene scene = holdScene();
    (*scene.extras)["touchstone"]["description"] = "A cube\tis put down.";
    writeGltf(scene, file);
    {
        SceneCards cards(cache);
        const auto card = complete(cards, file);
        CHECK(card->text == "A cube\\tis put down.");
        REQUIRE(card->picture.width == SceneCards::kWidth);
        std::set<std::uint32_t> colors;
        for (std::size_t i = 0; i < card->picture.rgba.size(); i += 4)
            colors.insert(card->picture.rgba[i] << 16 | card->picture.rgba[i + 1] << 8 | card->picture.rgba[i + 2]);
        CHECK(colors.size() > 100);
        CHECK(pictures(cache) == 1);
    }
    SceneCards again(cache);
    CHECK_FALSE(complete(again, file)->picture.rgba.empty());
    CHECK(pictures(cache) == 1);
    scene.animations.clear();
    writeGltf(scene, file);  // of another size: another picture
    SceneCards changed(cache);
    complete(changed, file);
    CHECK(pictures(cache) == 2);
}

TEST_CASE("scene cards: a file without roles has a picture, and a broken one says why", "[gl]") {
    const TempFolder folder;
    engine::Scene bare;
    addBox(bare, "box", glm::vec3(0.01f));
    writeGltf(bare, folder.path() / "bare.gltf");
    std::ofstream(folder.path() / "broken.glb") << "no scene";
    SceneCards cards({});
    CHECK_FALSE(complete(cards, folder.path() / "bare.gltf")->picture.rgba.empty());
    CHECK(complete(cards, folder.path() / "bare.gltf")->text.empty());
    const auto broken = complete(cards, folder.path() / "broken.glb");
    CHECK(broken->picture.rgba.empty());
    CHECK_THAT(broken->text, Catch::Contains("broken.glb"));
}

}  // namespace touchstone::scene_cards_tests
