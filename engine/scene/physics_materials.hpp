#pragma once
// Friction of the physics materials of KHR_physics_rigid_bodies. Markings in extras have the same keys.
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/fields.hpp"

namespace touchstone::engine {

/// How the coefficients of two materials become those of the pair. If the materials differ in it, the one that comes
/// first here decides.
enum class FrictionCombine : std::uint8_t { Average, Minimum, Maximum, Multiply };
inline constexpr std::array kFrictionCombineNames{"average", "minimum", "maximum", "multiply"};
inline const char* name(FrictionCombine combine) { return kFrictionCombineNames[static_cast<std::size_t>(combine)]; }

inline constexpr double kDefaultFriction = 0.6;  ///< of the extension's schema, static and dynamic
/// Largest coefficient, far above that of any material: infinity and misplaced units are refused.
inline constexpr double kMaxFriction = 1000;

/// As in the file: nothing for absent keys.
struct FrictionMaterial {
    std::optional<double> staticFriction = {}, dynamicFriction = {};
    std::optional<FrictionCombine> frictionCombine = {};

    double staticOr() const { return staticFriction.value_or(kDefaultFriction); }
    double dynamicOr() const { return dynamicFriction.value_or(kDefaultFriction); }
    FrictionCombine combineOr() const { return frictionCombine.value_or(FrictionCombine::Average); }
    bool empty() const { return *this == FrictionMaterial{}; }
    friend bool operator==(const FrictionMaterial&, const FrictionMaterial&) = default;
};

/// Reads the three keys. Throws SceneError for a wrong type or range.
FrictionMaterial readFriction(Fields& fields);
/// Writes the keys that have a value, and keeps all other keys of the object.
void writeFriction(nlohmann::json& object, const FrictionMaterial& friction);

/// The file's physics materials; throws SceneError for invalid ones.
std::vector<FrictionMaterial> readPhysicsMaterials(const Scene& scene);
std::size_t physicsMaterialCount(const Scene& scene);
/// Name of a physics material in messages: `physics material 0 "rubber"`. Pre: it exists.
std::string physicsMaterialLabel(const Scene& scene, int index);

}  // namespace touchstone::engine
