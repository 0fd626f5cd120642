#pragma once
// Reads parts and assemblies from STEP files (AP203, AP214, AP242).
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/cad_parts.hpp"

namespace touchstone::engine {

/// Whether the name ends in .step or .stp, in lower or upper case.
bool isStepFile(const std::filesystem::path& file);

struct StepOptions {
    bool meshes = true;  ///< else names, places and exact faces alone
    std::optional<double> deviation =
        {};                               ///< m, of triangles from surfaces; by default from the clearance of the parts
    bool inStep = false;                  ///< facets of mating faces have the same or doubled counts; else coprime ones
    bool keepClearance = false;           ///< triangles of holes lie outside their surface, those of shafts inside
    std::vector<std::string> only = {};   ///< names or paths of parts that need triangles; empty: all
    int maxSeconds = 600;                 ///< after which reading is given up
    std::uint64_t maxBytes = 8ull << 30;  ///< of memory
};

/// What is being done, and how far it is, 0 to 1. False cancels.
using StepProgress = std::function<bool(const std::string& what, double fraction)>;

/// Reads files in a process of its own, whose time and memory are bounded. The deviation of triangles follows from the
/// clearance between all parts of all these files at their places: a tenth of it, at most 0.05 mm and at least 0.2 µm.
/// Throws SceneError with one sentence that names the file and what to do: if the program touchstone-step is not
/// installed, a file is not STEP, has no part, or reading it crashes or exceeds its bounds. Nothing if `progress`
/// cancelled it.
std::optional<std::vector<CadAssembly>> readStep(std::span<const std::filesystem::path> files,
                                                 const StepOptions& options, const StepProgress& progress = {});

}  // namespace touchstone::engine
