// touchstone tree check: measures how closely a sphere tree follows a mesh.
#include "tools/touchstone/tree_check.hpp"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/scene/mesh_file.hpp"
#include "haptics/builder/tree_check.hpp"
#include "haptics/builder/tree_file.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/tree_parts.hpp"

namespace touchstone::app {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

struct TreeCheckCommand {
    std::filesystem::path tree;
    PartChoice of;
    int samples = 200000, poses = 64;
    std::uint64_t seed = 1;
    bool json = false;
};

/// Rows of name, value and unit; lengths also in percent of the diagonal.
class Table {
  public:
    explicit Table(double diagonal) : diagonal_(diagonal) {}

    void row(const char* what, double value, const char* unit = "") const {
        std::printf("  %-34s %12s %s\n", what, text(value).c_str(), unit);
    }
    void length(const char* what, double mm) const {
        std::printf("  %-34s %12s mm %12s %%D\n", what, text(mm).c_str(), text(100 * mm / diagonal_).c_str());
    }

  private:
    static std::string text(double value) {
        if (!std::isfinite(value)) return "-";
        char buffer[32];
        std::snprintf(buffer, sizeof buffer, std::floor(value) == value && std::abs(value) < 1e9 ? "%.0f" : "%.4g",
                      value);
        return buffer;
    }
    double diagonal_;
};

void print(const TreeCheckCommand& command, const TreePart& part, const TreeMetrics& m) {
    std::printf("%s against %s\n", command.tree.filename().string().c_str(), part.name.c_str());
    const Table table(m.diagonal);
    table.row("leaves", m.leaves);
    table.row("nodes", m.nodes);
    table.length("diagonal of the mesh (D)", m.diagonal);
    std::printf("  %-34s %12s\n", "surface proven covered", m.coverageProven ? "yes" : "no");
    table.row("surface uncovered", 100 * m.uncoveredShare, "%");
    table.length("largest gap", m.largestGap);
    table.length("protrusion, largest sampled", m.protrusionMax);
    table.length("protrusion, RMS", m.protrusionRms);
    table.length("protrusion, certified bound", m.protrusionCertified);
    table.length("largest hollow inside", m.hollow);
    table.row("volume of leaves to body", m.volumeRatio);
    table.length("Hausdorff, surface to leaves", m.hausdorffToTree);
    table.length("Hausdorff, leaves to surface", m.hausdorffToSurface);
    table.row("normal error, mean", m.normalErrorMean * kDegrees, "°");
    table.row("leaves outside an ancestor", m.leavesOutside);
    table.length("  by at most", m.largestEscape);
    table.row("touching poses", m.poses);
    table.row("sphere tests a pose", m.testsPerPose);
    table.row("touching leaf pairs a pose", m.pairsPerPose);
    table.row("pairs that the walk misses", static_cast<double>(m.pairsMissed));
    table.row("overlapping pairs, pressed 1 %D", m.pressedPairsPerPose);
    table.row("of these, missed", static_cast<double>(m.pressedPairsMissed));
    if (m.walkUs >= 0) table.row("walk, CPU time a pose", m.walkUs, "µs");
}

void printJson(const TreeCheckCommand& command, const TreePart& part, const TreeMetrics& m) {
    const auto number = [](double value) {
        return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
    };
    nlohmann::ordered_json json{{"tree", command.tree.string()}, {"part", part.name}};
    json["leaves"] = m.leaves;
    json["nodes"] = m.nodes;
    json["diagonal_mm"] = m.diagonal;
    json["coverage_proven"] = m.coverageProven;
    json["uncovered_percent"] = number(100 * m.uncoveredShare);
    json["largest_gap_mm"] = number(m.largestGap);
    json["protrusion_max_mm"] = number(m.protrusionMax);
    json["protrusion_rms_mm"] = number(m.protrusionRms);
    json["protrusion_certified_mm"] = number(m.protrusionCertified);
    json["hollow_mm"] = number(m.hollow);
    json["volume_ratio"] = number(m.volumeRatio);
    json["hausdorff_to_leaves_mm"] = number(m.hausdorffToTree);
    json["hausdorff_to_surface_mm"] = number(m.hausdorffToSurface);
    json["normal_error_mean_deg"] = number(m.normalErrorMean * kDegrees);
    json["leaves_outside_ancestor"] = m.leavesOutside;
    json["largest_escape_mm"] = number(m.largestEscape);
    json["poses"] = m.poses;
    json["tests_per_pose"] = number(m.testsPerPose);
    json["pairs_per_pose"] = number(m.pairsPerPose);
    json["pairs_missed"] = m.pairsMissed;
    json["pressed_pairs_per_pose"] = number(m.pressedPairsPerPose);
    json["pressed_pairs_missed"] = m.pressedPairsMissed;
    json["walk_us"] = m.walkUs >= 0 ? number(m.walkUs) : nlohmann::ordered_json();
    std::printf("%s\n", json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
}

int checkTree(const TreeCheckCommand& command) {
    const TreePart part = onlyPart(readParts(command.of), command.of.file, "tree check measures one tree");
    const CheckOptions options{.samples = command.samples, .poses = command.poses, .seed = command.seed};
    TreeMetrics metrics;
    {
        const sandbox::SceneProgress bar = progressBar("measuring");
        const BuildProgress progress = [&](const BuildStatus& status) {
            return bar({.part = command.tree.filename().string(),
                        .fraction = status.fraction,
                        .secondsLeft = status.secondsLeft});
        };
        metrics = command.tree.extension() == ".sph"
                      ? measureTree(readSph(command.tree, part.mmPerUnit), part.mesh, options, progress)
                      : measureTree(loadTree(command.tree), part.mesh, options, progress);
        if (!progress({1, 0})) throw BuildCancelled{};
    }
    if (command.json)
        printJson(command, part, metrics);
    else
        print(command, part, metrics);
    return kOk;
}

constexpr const char* kCheckFooter =
    "Lengths in a .sph file are in the unit of the mesh.\n\n"
    "Example:\n"
    "  touchstone tree check other.sph bunny.obj --json\n";

}  // namespace

const CLI::App* addTreeCheck(CLI::App& tree, Action& action) {
    const auto options = std::make_shared<TreeCheckCommand>();
    CLI::App* check =
        addCommand(tree, "check", "Measure how closely a tree of this or another program follows a mesh", kCheckFooter);
    check->add_option("FILE", options->tree, "a .sph file, or a file that `touchstone tree -o` wrote")->required();
    check
        ->add_option("MESH", options->of.file,
                     "a mesh (" + engine::meshExtensionWords() + "), a scene (.glb or .gltf), or the name of a scene")
        ->required();
    addPartChoice(*check, options->of);
    check
        ->add_option("--samples", options->samples,
                     "number of samples on the surface, and on the outside of the leaves")
        ->check(within(100, 1e8))
        ->capture_default_str();
    check->add_option("--poses", options->poses, "number of poses in which the tree touches a copy of itself")
        ->check(within(1, 1e5))
        ->capture_default_str();
    check->add_option("--seed", options->seed, "random seed of samples and poses")
        ->check(within(0, 9e15))
        ->capture_default_str();
    check->add_flag("--json", options->json, "print a JSON object, with units in the key names");
    check->callback([options, &action] { action = [options] { return checkTree(*options); }; });
    return check;
}

}  // namespace touchstone::app
