#include "haptics/sandbox/picture/scene_cards.hpp"

#include <chrono>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "engine/scene/gltf_container.hpp"
#include "engine/view/image_file.hpp"
#include "haptics/math/hash.hpp"
#include "haptics/sandbox/picture/scene_view.hpp"

namespace touchstone::sandbox {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint64_t kPictures = 1;  // increased when pictures are drawn in another way

/// Only the JSON of the file is read.
std::string descriptionIn(const fs::path& file) {
    const json document = engine::parseJson(file, engine::readContainer(file).json);
    const json scene = document.value("scene", json());
    const json::json_pointer at("/scenes/" + std::to_string(scene.is_number_unsigned() ? scene.get<unsigned>() : 0) +
                                "/extras/touchstone/description");
    const json text = document.contains(at) ? document.at(at) : json();
    return text.is_string() ? engine::escaped(text.get<std::string>()) : "";
}

/// Name of the picture's file, without its folder.
std::string keyOf(const fs::path& file) {
    std::error_code error;
    const std::string path = fs::absolute(file, error).string();
    const std::uint64_t size = fs::file_size(file, error);
    const auto time = static_cast<std::uint64_t>(fs::last_write_time(file, error).time_since_epoch().count());
    Hash hash;
    hash.add(path.data(), path.size());
    for (const std::uint64_t number : {size, time, kPictures}) hash.add(number);
    return hexadecimal(hash.value()) + ".png";
}

engine::Image pictureOf(const fs::path& file) {
    SceneOptions options;
    options.buildWorld = false;
    const HapticScene scene = openScene(file, options);
    TickRecord start;
    if (scene.roles.tool) start.X_WT = start.X_WT_device = startPose(scene);
    return renderScene(scene, start, scene.settings, {.width = SceneCards::kWidth, .height = SceneCards::kHeight});
}

}  // namespace

SceneCards::SceneCards(fs::path folder)
    : folder_(std::move(folder)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

SceneCards::~SceneCards() {
    thread_.request_stop();
    changed_.notify_all();
}

std::shared_ptr<const SceneCard> SceneCards::find(const fs::path& scene) {
    const std::lock_guard lock(mutex_);
    const auto [card, isNew] = cards_.try_emplace(scene);
    if (isNew) {
        card->second = std::make_shared<const SceneCard>();
        wanted_.push_back(scene);
        changed_.notify_one();
    }
    return card->second;
}

void SceneCards::set(const fs::path& scene, SceneCard card) {
    auto shared = std::make_shared<const SceneCard>(std::move(card));
    const std::lock_guard lock(mutex_);
    cards_[scene] = std::move(shared);
}

void SceneCards::run(const std::stop_token& stop) {
    for (;;) {
        fs::path scene;
        {
            std::unique_lock lock(mutex_);
            if (!changed_.wait(lock, stop, [this] { return !wanted_.empty(); })) return;
            scene = std::move(wanted_.back());
            wanted_.pop_back();
        }
        SceneCard card;
        try {
            card.text = descriptionIn(scene);
            set(scene, card);
            const fs::path kept = folder_.empty() ? fs::path() : folder_ / "pictures" / keyOf(scene);
            std::error_code error;
            if (!kept.empty() && fs::exists(kept, error)) {
                card.picture = engine::readPng(kept);
            } else {
                card.picture = pictureOf(scene);
                fs::create_directories(kept.parent_path(), error);
                if (!kept.empty()) engine::writePng(kept, card.picture);
            }
        } catch (const std::exception& e) {
            // Without OpenGL or a writable cache the card has its sentence only.
            if (card.text.empty()) card.text = e.what();
        }
        card.complete = true;
        set(scene, std::move(card));
        if (stop.stop_requested()) return;
    }
}

}  // namespace touchstone::sandbox
