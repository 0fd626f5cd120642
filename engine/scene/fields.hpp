#pragma once
// Reads the fields of one JSON object of a scene's marking, and names what is wrong with them.
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

/// Lengths and coordinates of a scene, m: beyond it the tick takes no pose.
inline constexpr double kLargestLength = 1e3;

/// Each reader returns nothing when the key is absent, and throws SceneError naming file, object and key when
/// the value has the wrong type or lies outside its range.
class Fields {
  public:
    /// `object`: the node or scene, as objectLabel() names it; `path`: of `value` within it. Throws when `value` is no
    /// object.
    Fields(const Scene& scene, std::string object, std::string path, const nlohmann::json& value);

    /// The value of any type; null when absent.
    const nlohmann::json* find(const std::string& key);
    std::optional<double> number(const std::string& key, double min, double max);
    std::optional<int> whole(const std::string& key, int min, int max);
    std::optional<bool> flag(const std::string& key);
    std::optional<std::string> text(const std::string& key);
    std::optional<int> choice(const std::string& key, std::span<const char* const> names);  ///< index of the name
    std::optional<glm::dvec3> vector(const std::string& key);      ///< m, within kLargestLength on each axis
    std::optional<glm::dquat> quaternion(const std::string& key);  ///< xyzw, normalised
    std::optional<Fields> object(const std::string& key);

    [[noreturn]] void fail(const std::string& key, const std::string& must) const;
    /// One sentence for each key that was never asked for.
    void nameUnknown(std::vector<std::string>& warnings) const;

  private:
    /// `count` numbers within kLargestLength; nothing when the key is absent.
    std::optional<std::vector<double>> numbers(const std::string& key, std::size_t count, const std::string& must);

    const Scene* scene_;
    std::string object_, path_;
    const nlohmann::json* value_;
    std::set<std::string> asked_;
};

}  // namespace touchstone::engine
