// touchstone tree: builds or imports sphere trees, and writes, exports and draws them.
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/scene/mesh_file.hpp"
#include "haptics/builder/mesh_repair.hpp"
#include "haptics/builder/mesh_words.hpp"
#include "haptics/builder/sphere_hierarchy.hpp"
#include "haptics/builder/tree_check.hpp"
#include "haptics/builder/tree_file.hpp"
#include "haptics/sandbox/picture/tree_picture.hpp"
#include "haptics/sandbox/scene/scene_world.hpp"
#include "haptics/sandbox/scene/tree_words.hpp"
#include "tools/touchstone/command_line.hpp"
#include "tools/touchstone/console.hpp"
#include "tools/touchstone/stopwatch.hpp"
#include "tools/touchstone/tree_check.hpp"
#include "tools/touchstone/tree_choice.hpp"
#include "tools/touchstone/tree_parts.hpp"

namespace touchstone::app {
namespace {

constexpr int kPictureSize = 800;

struct TreeCommand {
    PartChoice from;
    TreeChoice tree;
    std::filesystem::path output, exported, imported, picture;  ///< empty: none
    bool json = false, noCache = false;
};

struct MadeTree {
    SphereTree tree;
    MeshRepairs repairs;
    std::string words;             ///< about all repairs
    int holes = 0, loose = 0;      ///< holes that were closed, loose triangles that were left out
    double moved = 0;              ///< by the repairs, at most, mm
    const char* source = "built";  ///< or "cache", "import"
    double wall = 0, cpu = 0;      ///< s
};

/// The leaves of another program's tree, with a certificate measured by this program.
SphereTree importTree(const std::filesystem::path& file, const TreePart& part, const RepairedMesh& body,
                      const BuildProgress& progress) {
    SphereTree tree = makeSphereTree(readSph(file, part.mmPerUnit).leaves());
    const TreeMetrics measured = measureTree(tree, part.mesh, {.samples = 20000, .poses = 0}, progress);
    TreeCertificate& certificate = tree.certificate;
    double extent = 0;
    for (const Vec3& v : part.mesh.vertices) extent = std::max(extent, v.cwiseAbs().maxCoeff());
    const double rounding = 16 * std::numeric_limits<double>::epsilon() * extent;  // of a corner and its distance
    certificate.protrusion = measured.protrusionCertified + rounding;
    certificate.diagonal = measured.diagonal;
    certificate.covered = measured.coverageProven;
    certificate.closed = body.closed();
    if (!certificate.covered) {
        char text[160];
        std::snprintf(text, sizeof text,
                      "The leaves leave about %.2g %% of the surface uncovered, with gaps of up to %.3g mm; contact in "
                      "a gap is not felt.",
                      100 * measured.uncoveredShare, measured.largestGap);
        certificate.note = text;
    } else if (!certificate.closed) {
        certificate.note = "The surface is open or does not bound a volume, so its open parts are felt as a sheet.";
    }
    return tree;
}

MadeTree makeTree(const TreePart& part, const TreeOptions& options, const TreeCommand& command,
                  const BuildProgress& progress) {
    const RepairedMesh body = repairMesh(part.mesh);
    const Stopwatch watch;
    MadeTree made;
    const std::filesystem::path cache = command.noCache ? "" : sandbox::treeCacheFolder();
    if (!command.imported.empty()) {
        made.source = "import";
        made.tree = importTree(command.imported, part, body, progress);
    } else if (cache.empty()) {
        made.tree = buildSphereTree(part.mesh, options, progress);
    } else {
        CacheReport report;
        made.tree = cachedSphereTree(part.mesh, options, cache, progress, &report);
        if (!report.built) made.source = "cache";
        if (!report.remark.empty()) spdlog::warn("{}", report.remark);
    }
    made.wall = watch.wall();
    made.cpu = watch.cpu();
    made.repairs = body.repairs;
    made.words = words(body);
    made.holes = int(body.closedHoles.size());
    for (const MeshPatch& patch : body.loose) made.loose += patch.triangles;
    made.moved = body.weld / body.scale;
    return made;
}

void print(const TreePart& part, const MadeTree& made) {
    const TreeCertificate& certificate = made.tree.certificate;
    const std::string how = made.source == std::string("built")   ? "built"
                            : made.source == std::string("cache") ? "from the cache"
                                                                  : "imported";
    std::printf("%s%s%s: %s; %s in %.2f s, CPU %.2f s\n", part.name.c_str(), part.role.empty() ? "" : ", ",
                part.role.c_str(), sandbox::words(made.tree).c_str(), how.c_str(), made.wall, made.cpu);
    if (!made.words.empty()) std::printf("  repaired: %s\n", made.words.c_str());
    if (!certificate.note.empty()) std::printf("  note: %s\n", certificate.note.c_str());
}

void printJson(const TreePart& part, const TreeOptions& options, const MadeTree& made) {
    const TreeCertificate& certificate = made.tree.certificate;
    nlohmann::ordered_json json{{"part", part.name}};
    json["role"] = part.role.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(part.role);
    json["triangles"] = part.mesh.triangles.size();
    json["diagonal_mm"] = certificate.diagonal;
    json["leaves"] = made.tree.leafCount();
    json["nodes"] = made.tree.nodeCount();
    json["levels"] = made.tree.levels.size();
    json["protrusion_mm"] = certificate.protrusion;
    json["protrusion_percent"] = certificate.diagonal > 0 ? 100 * certificate.protrusion / certificate.diagonal : 0;
    json["covered"] = certificate.covered;
    json["closed"] = certificate.closed;
    json["hollow_mm"] = certificate.hollow >= 0 ? nlohmann::ordered_json(certificate.hollow) : nlohmann::ordered_json();
    json["note"] = certificate.note;
    json["repairs"] = {{"joined", made.repairs.joined},
                       {"set_into_edges", made.repairs.stitched},
                       {"without_area", made.repairs.degenerate},
                       {"duplicates", made.repairs.duplicates},
                       {"turned_over", made.repairs.turned},
                       {"inside", made.repairs.inner},
                       {"holes_closed", made.holes},
                       {"loose", made.loose},
                       {"moved_mm", made.moved}};
    json["source"] = made.source;
    if (made.source != std::string("import")) {
        json["quality"] = sandbox::name(options.quality);
        json["interior"] = sandbox::name(options.interior);
        json["seed"] = options.seed;
    }
    json["wall_s"] = made.wall;
    json["cpu_s"] = made.cpu;
    std::printf("%s\n", json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
}

/// Finds the errors that the command line alone shows.
void check(const TreeCommand& command) {
    if (command.from.file.empty())
        throw UsageError("tree needs a mesh (" + engine::meshExtensionWords() +
                         ") or a scene (.glb, .gltf, or the name of one)");
    checkChoice(command.tree);
    const TreeChoice& choice = command.tree;
    if (!command.imported.empty() && (choice.leaves || choice.levels || !choice.maxError.empty() || choice.quality ||
                                      choice.interior || choice.seed))
        throw UsageError("--import takes the leaves as they are: leave out the options for building them");
    for (const auto& [path, what] :
         {std::pair{command.output, "the tree"}, std::pair{command.exported, "the exported tree"},
          std::pair{command.picture, "the picture"}})
        if (!path.empty()) requireWritable(path, what);
}

std::vector<TreePart> partsFor(const TreeCommand& command) {
    std::vector<TreePart> parts = readParts(command.from);
    const char* why = !command.output.empty()     ? "-o writes one tree"
                      : !command.exported.empty() ? "--export writes one tree"
                      : !command.imported.empty() ? "--import brings one tree"
                      : !command.picture.empty()  ? "--picture shows one tree"
                                                  : nullptr;
    if (!why) return parts;
    TreePart part = onlyPart(std::move(parts), command.from.file, why);
    parts.clear();
    parts.push_back(std::move(part));
    return parts;
}

void write(const TreeCommand& command, const TreePart& part, const TreeOptions& options, const MadeTree& made) {
    if (!command.output.empty()) {
        // A tree that is saved is verified again, by other code than the code that built it.
        if (const std::string wrong = refuteCertificate(made.tree, part.mesh); !wrong.empty())
            throw std::runtime_error(part.name +
                                     ": the tree contradicts its certificate, so it is not saved: " + wrong);
        saveTree(made.tree, command.output, command.imported.empty() ? treeKey(part.mesh, options) : 0);
    }
    if (!command.exported.empty()) writeSph(hierarchyOf(made.tree), command.exported, part.mmPerUnit);
    if (!command.picture.empty())
        sandbox::renderTree(made.tree, part.mesh, command.picture, kPictureSize, kPictureSize);
}

int makeTrees(const TreeCommand& command) {
    check(command);
    const std::vector<TreePart> parts = partsFor(command);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const TreePart& part = parts[i];
        const TreeOptions options = withChoice(part.options, command.tree, part.diagonal());
        MadeTree made;
        try {
            const sandbox::SceneProgress bar =
                progressBar(command.imported.empty() ? "building the sphere tree of" : "measuring the sphere tree of");
            const BuildProgress progress = [&](const BuildStatus& status) {
                const auto whole = static_cast<double>(parts.size());
                return bar({.part = part.name,
                            .number = i + 1,
                            .of = parts.size(),
                            .fraction = (static_cast<double>(i) + status.fraction) / whole,
                            .secondsLeft = status.secondsLeft});
            };
            made = makeTree(part, options, command, progress);
            if (!progress({1, 0})) throw BuildCancelled{};
        } catch (const std::invalid_argument& error) {
            throw std::runtime_error(part.name + ": " + error.what());
        }
        write(command, part, options, made);
        if (command.json)
            printJson(part, options, made);
        else
            print(part, made);
        std::fflush(stdout);
    }
    return kOk;
}

constexpr const char* kTreeFooter =
    "The trees of a scene's parts are built as the scene says; the options override it. A scene without roles is one\n"
    "mesh.\n\n"
    "Examples:\n"
    "  touchstone tree bunny.obj --leaves 4096 --quality best -o bunny.spheres\n"
    "  touchstone tree shaft.stl --unit mm --max-error 0.02mm --json\n"
    "  touchstone tree bunny.obj --max-error 0.1% --export bunny.sph\n"
    "  touchstone tree spline --part shaft --picture shaft.png\n"
    "  touchstone tree bunny.obj --import other.sph -o other.spheres\n"
    "  touchstone tree check bunny.spheres bunny.obj\n";

}  // namespace

void addTree(CLI::App& program, Action& action) {
    const auto options = std::make_shared<TreeCommand>();
    CLI::App* tree =
        addCommand(program, "tree", "Build the sphere tree of a mesh, or of each part of a scene", kTreeFooter);
    tree->add_option("MESH", options->from.file,
                     "a mesh (" + engine::meshExtensionWords() + "), a scene (.glb or .gltf), or the name of a scene");
    tree->add_option("-o,--output", options->output, "write the tree to a file");
    addTreeChoice(*tree, options->tree);
    tree->add_option("--levels", options->tree.levels,
                     "number of levels including the root, instead of --leaves: 5 levels hold 4096 leaves");
    tree->add_option("--seed", options->tree.seed, "random seed")->check(within(0, 9e15));
    tree->add_option("--threads", options->tree.threads, "number of threads; it does not change the tree (default: 2)");
    addPartChoice(*tree, options->from);
    tree->add_option("--export", options->exported,
                     "write a .sph file, in the frame and unit of the mesh (scenes: meters)");
    tree->add_option("--import", options->imported, "take the leaves from a .sph file instead of building them");
    tree->add_option("--picture", options->picture, "draw the leaves over the mesh, 800 x 800 pixels, to a PNG file");
    tree->add_flag("--json", options->json, "print one JSON object per line, with units in the key names");
    tree->add_flag("--no-cache", options->noCache, "build the tree without reading or writing the cache");
    const CLI::App* check = addTreeCheck(*tree, action);
    tree->callback([options, check, &action] {
        if (!check->parsed()) action = [options] { return makeTrees(*options); };
    });
}

}  // namespace touchstone::app
