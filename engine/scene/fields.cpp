#include "engine/scene/fields.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/text.hpp"

namespace touchstone::engine {
namespace {

std::string range(const char* kind, double min, double max) {
    const auto text = [](double number) {
        char buffer[32];
        return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, number).ptr);
    };
    return kind + (" from " + text(min)) + " to " + text(max);
}

}  // namespace

Fields::Fields(const Scene& scene, std::string object, std::string path, const nlohmann::json& value)
    : scene_(&scene), object_(std::move(object)), path_(std::move(path)), value_(&value) {
    if (!value.is_object()) failIn(scene.file, object_, path_ + " must be an object");
}

void Fields::fail(const std::string& key, const std::string& must) const {
    failIn(scene_->file, object_, path_ + "." + key + " must be " + must);
}

const nlohmann::json* Fields::find(const std::string& key) {
    readKeys_.insert(key);
    const auto found = value_->find(key);
    return found == value_->end() ? nullptr : &*found;
}

std::optional<double> Fields::number(const std::string& key, double min, double max) {
    const nlohmann::json* value = find(key);
    if (!value) return {};
    const auto number = numberIn(*value, min, max);
    if (!number) fail(key, range("a number", min, max));
    return number;
}

std::optional<int> Fields::whole(const std::string& key, int min, int max) {
    const nlohmann::json* value = find(key);
    if (!value) return {};
    const auto number = numberIn(*value, min, max);  // accepts 4096.0
    if (!number || *number != std::floor(*number)) fail(key, range("a whole number", min, max));
    return static_cast<int>(*number);
}

std::optional<bool> Fields::flag(const std::string& key) {
    const nlohmann::json* value = find(key);
    if (!value) return {};
    if (*value == 0 || *value == 1) return *value == 1;  // as custom properties of modeling programs are exported
    if (!value->is_boolean()) fail(key, "true or false");
    return value->get<bool>();
}

std::optional<std::string> Fields::text(const std::string& key) {
    const nlohmann::json* value = find(key);
    if (!value) return {};
    if (!value->is_string()) fail(key, "a text");
    return value->get<std::string>();
}

std::optional<int> Fields::choice(const std::string& key, std::span<const char* const> names) {
    const auto given = text(key);
    if (!given) return {};
    const auto known = std::find(names.begin(), names.end(), *given);
    if (known == names.end()) fail(key, anyOf(names));
    return static_cast<int>(known - names.begin());
}

std::optional<std::vector<double>> Fields::numbers(const std::string& key, std::size_t count, const std::string& must) {
    const nlohmann::json* value = find(key);
    if (!value) return {};
    if (!value->is_array() || value->size() != count) fail(key, must);
    std::vector<double> found;
    for (const nlohmann::json& entry : *value) {
        const auto number = numberIn(entry, -kLargestLength, kLargestLength);
        if (!number) fail(key, must);
        found.push_back(*number);
    }
    return found;
}

std::optional<glm::dvec3> Fields::vector(const std::string& key) {
    const auto v = numbers(key, 3, "three numbers from -1000 to 1000 m");
    if (!v) return {};
    return glm::dvec3((*v)[0], (*v)[1], (*v)[2]);
}

std::optional<glm::dquat> Fields::quaternion(const std::string& key) {
    const std::string must = "a quaternion of unit length, four numbers xyzw";
    const auto v = numbers(key, 4, must);
    if (!v) return {};
    const glm::dquat q((*v)[3], (*v)[0], (*v)[1], (*v)[2]);
    // Tolerance for single-precision exporters; a value farther from unit length is probably not a quaternion.
    if (std::abs(glm::length(q) - 1) > 1e-3) fail(key, must);
    return glm::normalize(q);
}

std::optional<Fields> Fields::object(const std::string& key) {
    const nlohmann::json* value = find(key);
    if (!value) return {};
    return Fields(*scene_, object_, path_ + "." + key, *value);
}

void Fields::warnUnknown(std::vector<std::string>& warnings) const {
    for (const auto& [key, value] : value_->items())
        if (!readKeys_.contains(key))
            warnings.push_back(object_ + ": " + path_ + "." + printable(key) + " is unknown and was ignored");
}

}  // namespace touchstone::engine
