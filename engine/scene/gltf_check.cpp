#include "engine/scene/gltf_check.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_schema.hpp"

namespace touchstone::engine {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 6> kSupportedExtensions = {"KHR_physics_rigid_bodies", "KHR_implicit_shapes",
                                                                  "KHR_materials_unlit",      "KHR_mesh_quantization",
                                                                  "EXT_mesh_gpu_instancing",  "KHR_node_visibility"};

/// Prefixes of extensions that do not change geometry; all others might.
constexpr std::array<std::string_view, 10> kWithoutGeometry = {
    "KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "MSFT_packing_",
    "KHR_lights_",    "EXT_lights_",  "KHR_xmp",      "KHR_audio",     "EXT_materials_"};

/// Replacement for an object that the scene does not use: the smallest object that tinygltf accepts.
const json& placeholder(std::string_view array) {
    static const std::map<std::string_view, json> all = {
        {"buffers", {{"byteLength", 1}}},
        {"bufferViews", {{"buffer", 0}, {"byteLength", 1}}},
        {"accessors", {{"componentType", 5126}, {"count", 1}, {"type", "SCALAR"}}},
        {"meshes", {{"primitives", json::array()}}},
        {"animations", {{"channels", json::array()}, {"samplers", json::array()}}},
    };
    static const json empty = json::object();
    const auto found = all.find(array);
    return found == all.end() ? empty : found->second;
}

std::uint64_t componentSize(int componentType) { return componentType <= 5121 ? 1 : componentType <= 5123 ? 2 : 4; }

std::uint64_t elementSize(const json& accessor) {
    static const std::map<std::string, std::uint64_t> components = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
    return components.at(accessor["type"].get<std::string>()) * componentSize(accessor["componentType"].get<int>());
}

/// One top-level array: checked copies (null for broken objects), and flags of the objects that the scene uses.
struct Array {
    std::vector<json> items;
    std::vector<bool> isUsed;
};

class GltfChecker {
  public:
    GltfChecker(const std::filesystem::path& file, const json& document, Warnings& warnings)
        : file_(file), document_(document), schema_(document), warnings_(warnings) {}

    CheckedGltf check(int scene) {
        try {
            checkVersion();
            CheckedGltf checked{schema_.header(), 0, {}};
            checkExtensions(checked.document);
            checked.scene = chosenScene(scene);
            for (const std::string_view name : GltfSchema::arrays()) open(name);
            use("scenes", checked.scene);
            checkUsed();
            useAnimations();
            checkUsed();
            checkUnused();
            checkViews();
            checkAccessors();
            checkHierarchy();
            for (auto& [name, array] : arrays_) {
                checked.document[std::string(name)] = finished(name, array);
                checked.used[std::string(name)] = std::move(array.isUsed);
            }
            return checked;
        } catch (const GltfProblem& found) {
            failIn(file_, found.object, found.problem + "; correct it or export the file again");
        }
    }

  private:
    [[noreturn]] void fail(const std::string& object, const std::string& problem) const {
        failIn(file_, object, problem);
    }

    /// Reports a fault of an object: an error if the scene uses the object, else a warning. Marks the object as broken.
    void report(std::string_view array, std::size_t index, const std::string& problem, const std::string& remedy) {
        const std::string label = schema_.label(array, index);
        if (arrays_.at(array).isUsed[index]) fail(label, problem + "; " + remedy);
        warnings_.add(label, problem + ", but nothing in the scene uses it");
        arrays_.at(array).items[index] = nullptr;
    }

    /// Must run before all other checks, since glTF 1.0 has objects where 2.0 has lists.
    void checkVersion() const {
        const auto asset = document_.find("asset");
        const auto text = [&](const char* key) -> std::string {
            if (!document_.is_object() || asset == document_.end() || !asset->is_object()) return "";
            const auto value = asset->find(key);
            return value != asset->end() && value->is_string() ? value->get<std::string>() : "";
        };
        const std::string version = text("version"), minVersion = text("minVersion");
        const auto isObject = [&](const char* array) {
            const auto found = document_.find(array);
            return found != document_.end() && found->is_object();
        };
        if (version.starts_with("1.") || (version.empty() && document_.is_object() && isObject("meshes")))
            fail("asset",
                 "is glTF 1.0; convert it to glTF 2.0, for example by importing it into Blender and exporting it");
        if ((!version.empty() && !version.starts_with("2.")) || (!minVersion.empty() && minVersion != "2.0"))
            fail("asset",
                 "requires glTF " + printable(minVersion.empty() ? version : minVersion) + "; export it as glTF 2.0");
    }

    void checkExtensions(const json& header) {
        const auto names = [&](const char* list) {
            return header.contains(list) ? header[list].get<std::vector<std::string>>() : std::vector<std::string>();
        };
        const auto isSupported = [](const std::string& name) {
            return std::find(kSupportedExtensions.begin(), kSupportedExtensions.end(), name) !=
                   kSupportedExtensions.end();
        };
        for (const std::string& name : names("extensionsRequired"))
            if (!isSupported(name))
                fail("extensionsRequired",
                     "requires " + printable(name) + ", which is not supported; export without it");
        for (const std::string& name : names("extensionsUsed"))
            if (!isSupported(name) && std::none_of(kWithoutGeometry.begin(), kWithoutGeometry.end(),
                                                   [&](std::string_view start) { return name.starts_with(start); }))
                warnings_.add("extension " + printable(name), "is not supported and is ignored");
    }

    std::size_t chosenScene(int wanted) const {
        const std::size_t count = schema_.size("scenes");
        if (count == 0) fail("", "has no scene; add one that lists the root nodes");
        if (wanted >= 0 && static_cast<std::size_t>(wanted) >= count)
            fail("", "has no scene " + std::to_string(wanted) + "; choose one from 0 to " + std::to_string(count - 1));
        if (wanted >= 0) return static_cast<std::size_t>(wanted);
        return schema_.defaultScene().value_or(0);
    }

    void open(std::string_view name) {
        std::size_t size = 0;
        try {
            size = schema_.size(name);
        } catch (const GltfProblem&) {  // reported as an error if an index refers to the array
            warnings_.add('"' + std::string(name) + '"', "must be a list, but nothing in the scene uses it");
        }
        arrays_[name] = {std::vector<json>(size), std::vector<bool>(size)};
    }

    void use(std::string_view array, std::size_t index) {
        std::vector<bool>& isUsed = arrays_.at(array).isUsed;
        if (isUsed[index]) return;
        isUsed[index] = true;
        unchecked_.emplace_back(array, index);
    }

    /// Checks all used objects, and transitively the objects that they use.
    void checkUsed() {
        while (!unchecked_.empty()) {
            const auto [array, index] = unchecked_.back();
            unchecked_.pop_back();
            arrays_.at(array).items[index] =
                schema_.object(array, index, [this](std::string_view to, std::size_t other) { use(to, other); });
            if (array == "nodes") useColliders(index);
        }
    }

    /// Colliders of KHR_physics_rigid_bodies may refer to meshes that no node instantiates.
    void useColliders(std::size_t node) {
        const json* body = find(document_["nodes"][node], {"extensions", "KHR_physics_rigid_bodies"});
        for (const char* kind : {"collider", "trigger"})
            for (const json* holder :
                 {body ? find(*body, {kind}) : nullptr, body ? find(*body, {kind, "geometry"}) : nullptr}) {
                const json* mesh = holder ? find(*holder, {"mesh"}) : nullptr;
                if (!mesh || !mesh->is_number()) continue;
                const double index = mesh->get<double>();
                if (index >= 0 && index < static_cast<double>(schema_.size("meshes")))
                    use("meshes", static_cast<std::size_t>(index));
            }
    }

    static const json* find(const json& from, std::initializer_list<const char*> path) {
        const json* at = &from;
        for (const char* key : path) {
            if (!at->is_object() || !at->contains(key)) return nullptr;
            at = &(*at)[key];
        }
        return at;
    }

    void useAnimations() {
        const std::vector<bool>& nodes = arrays_.at("nodes").isUsed;
        for (std::size_t i = 0; i < arrays_.at("animations").items.size(); ++i) {
            const json* channels = find(document_["animations"][i], {"channels"});
            if (!channels || !channels->is_array()) continue;
            const bool moves = std::any_of(channels->begin(), channels->end(), [&](const json& channel) {
                const json* node = find(channel, {"target", "node"});
                const double index = node && node->is_number() ? node->get<double>() : -1;
                return index >= 0 && index < static_cast<double>(nodes.size()) &&
                       nodes[static_cast<std::size_t>(index)];
            });
            if (moves) use("animations", i);
        }
    }

    void checkUnused() {
        for (auto& [name, array] : arrays_)
            for (std::size_t i = 0; i < array.items.size(); ++i) {
                if (array.isUsed[i]) continue;
                try {
                    array.items[i] = schema_.object(name, i, [](std::string_view, std::size_t) {});
                } catch (const GltfProblem& found) {
                    warnings_.add(found.object, found.problem + ", but nothing in the scene uses it");
                }
            }
    }

    void checkViews() {
        Array& views = arrays_.at("bufferViews");
        for (std::size_t i = 0; i < views.items.size(); ++i) {
            const json& view = views.items[i];
            if (view.is_null()) continue;
            if (view.value("byteStride", 4) % 4 != 0) {
                report("bufferViews", i, "has a byteStride that is not a multiple of 4", "export the file again");
                continue;
            }
            const json& buffer = arrays_.at("buffers").items[view["buffer"].get<std::size_t>()];
            if (buffer.is_null()) continue;  // then the view is not used either
            const auto available = buffer["byteLength"].get<std::uint64_t>();
            const auto end = view.value("byteOffset", std::uint64_t{0}) + view["byteLength"].get<std::uint64_t>();
            if (end > available)
                report("bufferViews", i,
                       "ends at byte " + std::to_string(end) + " of a buffer of " + std::to_string(available),
                       "the file is truncated or wrong, so export it again");
        }
    }

    void checkAccessors() {
        Array& accessors = arrays_.at("accessors");
        for (std::size_t i = 0; i < accessors.items.size(); ++i) {
            if (accessors.items[i].is_null()) continue;
            if (const std::string problem = accessorProblem(accessors.items[i]); !problem.empty())
                report("accessors", i, problem, "export the file again");
        }
        Array& meshes = arrays_.at("meshes");
        for (std::size_t i = 0; i < meshes.items.size(); ++i)
            if (meshes.isUsed[i])
                for (const json& primitive : meshes.items[i]["primitives"])
                    if (primitive.contains("indices") &&
                        !accessors.items[primitive["indices"].get<std::size_t>()].contains("bufferView"))
                        report("meshes", i, "has indices without a buffer view", "store the indices plainly");
    }

    /// Checks byte ranges against their buffer views. All factors are below 2^31, so their products fit into 64 bits.
    std::string accessorProblem(const json& accessor) const {
        constexpr std::uint64_t kMaxImplicitZeros = std::uint64_t{1} << 24;  // of an accessor without data
        const auto count = accessor["count"].get<std::uint64_t>();
        const std::uint64_t size = elementSize(accessor);
        const auto rangeProblem = [&](const json& from, std::uint64_t elements, std::uint64_t stride,
                                      std::uint64_t bytes) -> std::string {
            const auto index = from["bufferView"].get<std::size_t>();
            const json& view = arrays_.at("bufferViews").items[index];
            if (view.is_null()) return "uses the broken buffer view " + std::to_string(index);
            const auto length = view["byteLength"].get<std::uint64_t>();
            const std::uint64_t end = from.value("byteOffset", std::uint64_t{0}) + (elements - 1) * stride + bytes;
            if (end <= length) return "";
            return "ends at byte " + std::to_string(end) + " of buffer view " + std::to_string(index) + ", which has " +
                   std::to_string(length);
        };
        if (accessor.contains("bufferView")) {
            const json& view = arrays_.at("bufferViews").items[accessor["bufferView"].get<std::size_t>()];
            const std::uint64_t stride = view.is_null() ? size : view.value("byteStride", size);
            if (stride < size)
                return "has elements of " + std::to_string(size) + " bytes in a buffer view of stride " +
                       std::to_string(stride);
            if (std::string problem = rangeProblem(accessor, count, stride, size); !problem.empty()) return problem;
        } else if (count > kMaxImplicitZeros) {
            return "has " + std::to_string(count) + " elements but no data";
        }
        if (!accessor.contains("sparse")) return "";
        const json &sparse = accessor["sparse"], &indices = sparse["indices"];
        const auto replaced = sparse["count"].get<std::uint64_t>();
        if (replaced > count) return "replaces more elements than it has";
        const std::uint64_t indexSize = componentSize(indices["componentType"].get<int>());
        std::string problem = rangeProblem(indices, replaced, indexSize, indexSize);
        return problem.empty() ? rangeProblem(sparse["values"], replaced, size, size) : problem;
    }

    /// Checks that the nodes form trees and that the scene lists only their roots.
    void checkHierarchy() {
        Array& nodes = arrays_.at("nodes");
        constexpr std::size_t kNone = static_cast<std::size_t>(-1);
        const auto children = [&](std::size_t node) {
            return nodes.items[node].is_null() || !nodes.items[node].contains("children")
                       ? std::vector<std::size_t>()
                       : nodes.items[node]["children"].get<std::vector<std::size_t>>();
        };
        const auto label = [&](std::size_t node) { return schema_.label("nodes", node); };
        std::vector<std::size_t> parents(nodes.items.size(), kNone);
        // Nodes of the scene first: a node outside that claims one of them as a child is itself at fault.
        for (const bool ofScene : {true, false})
            for (std::size_t node = 0; node < parents.size(); ++node) {
                if (nodes.isUsed[node] != ofScene) continue;
                for (const std::size_t child : children(node)) {
                    if (parents[child] == kNone && nodes.isUsed[child] == ofScene) {
                        parents[child] = node;
                    } else if (ofScene) {
                        report("nodes", child, "has two parents, " + label(parents[child]) + " and " + label(node),
                               "list it as a child once");
                    } else {
                        warnings_.add(label(child), "is a child of " + label(node) +
                                                        " as well, which is not in the scene; that parent is ignored");
                    }
                }
            }
        // Since each node has at most one parent, nodes that no root reaches are on or below a cycle.
        std::vector<bool> isReached(parents.size());
        std::vector<std::size_t> reached;
        const auto reach = [&](std::size_t node) {
            if (!isReached[node]) reached.push_back(node);
            isReached[node] = true;
        };
        for (std::size_t node = 0; node < parents.size(); ++node)
            if (parents[node] == kNone) reach(node);
        for (std::size_t i = 0; i < reached.size(); ++i)
            for (const std::size_t child : children(reached[i])) reach(child);
        for (std::size_t node = 0; node < parents.size(); ++node)
            if (!isReached[node])
                report("nodes", node, "is its own ancestor", "remove the cycle from the children lists");
        Array& scenes = arrays_.at("scenes");
        for (std::size_t i = 0; i < scenes.items.size(); ++i) {
            if (!scenes.isUsed[i]) continue;
            std::vector<bool> isListed(parents.size());
            for (const json& item : scenes.items[i].value("nodes", json::array())) {
                const auto node = item.get<std::size_t>();
                if (parents[node] != kNone)
                    report("scenes", i, "lists " + label(node) + ", which is a child of " + label(parents[node]),
                           "list root nodes only");
                if (isListed[node]) report("scenes", i, "lists " + label(node) + " twice", "list it once");
                isListed[node] = true;
            }
        }
    }

    /// The array for the checked document. Nodes, scenes and animations keep their number, which other code relies on;
    /// other arrays end at the last used object.
    static json finished(std::string_view name, Array& array) {
        std::size_t end = array.items.size();
        if (name != "nodes" && name != "scenes" && name != "animations")
            while (end > 0 && !array.isUsed[end - 1]) --end;
        json list = json::array();
        for (std::size_t i = 0; i < end; ++i)
            list.push_back(array.isUsed[i] ? std::move(array.items[i]) : placeholder(name));
        return list;
    }

    const std::filesystem::path& file_;
    const json& document_;
    const GltfSchema schema_;
    Warnings& warnings_;
    std::map<std::string_view, Array> arrays_;
    std::vector<std::pair<std::string_view, std::size_t>> unchecked_;
};

}  // namespace

CheckedGltf checkGltf(const std::filesystem::path& file, const json& document, int scene, Warnings& warnings) {
    return GltfChecker(file, document, warnings).check(scene);
}

}  // namespace touchstone::engine
