#pragma once
// Schema checks on the objects of a glTF document.
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace touchstone::engine {

/// A violation of the specification. It is an error only if the scene uses the object.
struct GltfProblem {
    std::string object;   ///< from objectLabel(); empty for the file itself
    std::string problem;  ///< without a remedy
};

/// Checks types, ranges and references of the properties this engine reads (glTF 2.0, chapter 5). The copies that it
/// returns contain only these properties. Every index is within its array, every number is finite and within its range,
/// and whole numbers are converted to integers.
class GltfSchema {
  public:
    /// Called for each object of a top-level array that the checked object refers to.
    using OnReference = std::function<void(std::string_view array, std::size_t index)>;

    /// `document` must stay alive.
    explicit GltfSchema(const nlohmann::json& document) : document_(document) {}

    /// The top-level arrays that are read.
    static const std::vector<std::string_view>& arrays();

    /// Number of objects in an array; 0 if it is absent. Throws GltfProblem if it is not a list.
    std::size_t size(std::string_view array) const;

    /// `asset` and the lists of extensions. Throws GltfProblem.
    nlohmann::json header() const;

    /// Index of the default scene. Throws GltfProblem.
    std::optional<std::size_t> defaultScene() const;

    /// One object of an array. Throws GltfProblem.
    nlohmann::json object(std::string_view array, std::size_t index, const OnReference& onReference) const;

    /// `accessor 3 "name"`.
    std::string label(std::string_view array, std::size_t index) const;

  private:
    const nlohmann::json& document_;
};

}  // namespace touchstone::engine
