#pragma once
// The parts of a STEP file as Open Cascade reads them: their tree, and their solids.
#include <TopoDS_Shape.hxx>
#include <functional>
#include <string>
#include <vector>

#include "engine/scene/cad_parts.hpp"

namespace touchstone::step {

constexpr double kMetersPerUnit = 0.001;  ///< Open Cascade gives all files in millimeters

/// How far it is, 0 to 1, and of what.
using Progress = std::function<void(const std::string& what, double fraction)>;

struct StepContent {
    engine::CadAssembly assembly;      ///< its shapes have faces, and no triangles yet
    std::vector<TopoDS_Shape> solids;  ///< of the same indices as its shapes; null if the shape has a problem
};

/// Throws std::runtime_error with one sentence that names the file and what to do.
StepContent readContent(const std::string& file, const Progress& progress);

}  // namespace touchstone::step
