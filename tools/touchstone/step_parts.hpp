#pragma once
// Parts of scenes from STEP files.
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/scene/cad_parts.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/new_scene.hpp"

namespace touchstone::app {

/// How the triangles of STEP files are made.
struct StepChoice {
    std::string deviation;  ///< a length; empty: from the clearance
    std::string facets = "coprime";
    bool keepClearance = false;
    bool given() const { return !deviation.empty() || facets != "coprime" || keepClearance; }
};

/// A length in the unit in which it can be read: "1.5 µm", "0.2 mm".
std::string lengthWords(double meters);

/// Adds --deviation, --facets and --keep-clearance. Returns the options.
std::vector<CLI::Option*> addStepChoice(CLI::App& command, StepChoice& choice);

/// The parts of STEP files that are tool and obstacles.
class StepParts {
  public:
    /// The parts of one assembly: `tool` and `obstacles` are names or paths of parts; without obstacles all others are.
    StepParts(const std::filesystem::path& assembly, const std::string& tool, const std::vector<std::string>& obstacles,
              const StepChoice& choice);
    /// Files of tool and obstacles; those that are not STEP have no parts.
    StepParts(const std::filesystem::path& tool, const std::vector<std::filesystem::path>& obstacles,
              const StepChoice& choice);

    /// A tool or an obstacle: the parts of one file that belong to it; none if it is not from a STEP file.
    struct Body {
        std::filesystem::path file;
        std::size_t assembly = 0;
        std::vector<std::uint32_t> parts;
        std::string name;
    };
    const Body& tool() const { return tool_; }
    const std::vector<Body>& obstacles() const { return obstacles_; }
    const engine::CadAssembly& assemblyOf(const Body& body) const { return assemblies_[body.assembly]; }

    /// Throws engine::SceneError with one sentence if a part is no solid.
    Part part(const Body& body, const PartFrame& frame, const engine::Material& material,
              const engine::RigidPart& pose = {}) const;
    /// The least clearance between the surfaces of the tool and those of obstacles, m; 0 if none is known.
    double clearance() const;

  private:
    void read(std::span<const std::filesystem::path> files, const StepChoice& choice, bool meshes,
              std::vector<std::string> only = {});
    Body whole(const std::filesystem::path& file, std::size_t assembly) const;
    std::uint32_t find(const std::filesystem::path& file, const std::string& name) const;

    Body tool_;
    std::vector<Body> obstacles_;
    std::vector<engine::CadAssembly> assemblies_;
};

}  // namespace touchstone::app
