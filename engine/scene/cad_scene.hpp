#pragma once
// Parts of a CAD file as a scene.
#include <span>

#include "engine/scene/cad_parts.hpp"
#include "engine/scene/scene.hpp"

namespace touchstone::engine {

/// A scene with one root for each of these parts, at its place, with its name and color; those of one shape share its
/// mesh. Parts without a color get `material`. Edges that turn by more than `crease`, rad, are drawn sharp. `toScene`
/// is multiplied to the placements from the left. Parts without triangles are left out.
Scene sceneOf(const CadAssembly& assembly, std::span<const std::uint32_t> parts, const Material& material,
              double crease, const glm::dmat4& toScene = glm::dmat4(1));

}  // namespace touchstone::engine
