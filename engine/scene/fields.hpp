#pragma once
// Checked reading of the fields of a JSON object in a scene's marking.
#include <initializer_list>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// The value as a number from min to max, both finite; nothing for any other value, NaN and infinity included.
template <class Json>
std::optional<double> numberIn(const Json& value, double min, double max) {
    if (!value.is_number()) return {};
    const double number = value.template get<double>();
    return number >= min && number <= max ? std::optional(number) : std::nullopt;
}

/// Largest length or coordinate of a scene, m: the tick rejects poses beyond it.
inline constexpr double kLargestLength = 1e3;

/// Each reader returns nothing if the key is absent. It throws SceneError naming file, object and key if the value has
/// the wrong type or is outside its range.
class Fields {
  public:
    /// `object`: node or scene, from objectLabel(); `path`: path of `value` in it. Throws if `value` is not an object.
    Fields(const Scene& scene, std::string object, std::string path, const nlohmann::json& value);

    /// The value of any type; null when absent.
    const nlohmann::json* find(const std::string& key);
    std::optional<double> number(const std::string& key, double min, double max);
    std::optional<int> whole(const std::string& key, int min, int max);
    std::optional<bool> flag(const std::string& key);
    std::optional<std::string> text(const std::string& key);
    std::optional<int> choice(const std::string& key, std::span<const char* const> names);  ///< index of the name
    std::optional<glm::dvec3> vector(const std::string& key);      ///< m, within kLargestLength on each axis
    std::optional<glm::dquat> quaternion(const std::string& key);  ///< xyzw, normalized
    std::optional<Fields> object(const std::string& key);

    [[noreturn]] void fail(const std::string& key, const std::string& must) const;
    /// Adds a warning for each key that was never read.
    void nameUnknown(std::vector<std::string>& warnings) const;

  private:
    /// `count` numbers within kLargestLength; nothing when the key is absent.
    std::optional<std::vector<double>> numbers(const std::string& key, std::size_t count, const std::string& must);

    const Scene* scene_;
    std::string object_, path_;
    const nlohmann::json* value_;
    std::set<std::string> readKeys_;
};

}  // namespace touchstone::engine
