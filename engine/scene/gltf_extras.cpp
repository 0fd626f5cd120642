// updateGltf() of gltf_write.hpp: saves markings, physics, transforms, names, materials, added nodes and motions into
// an existing file.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "engine/scene/gltf_check.hpp"
#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_write.hpp"
#include "engine/scene/rigid_bodies.hpp"

namespace touchstone::engine {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

ordered_json& objectOf(const fs::path& file, ordered_json& document, const char* array, const char* kind, int index) {
    const std::size_t count = document.contains(array) && document[array].is_array() ? document[array].size() : 0;
    if (index < 0 || static_cast<std::size_t>(index) >= count ||
        !document[array][static_cast<std::size_t>(index)].is_object())
        failIn(file, "", std::string("has no ") + kind + " " + std::to_string(index) + "; open the file again");
    return document[array][static_cast<std::size_t>(index)];
}

/// Unchanged values keep the order of their keys.
void replaceValue(ordered_json& object, const char* key, const json& value) {
    if (!object.contains(key) || json::parse(object[key].dump()) != value) object[key] = value;
}

void replaceExtras(const fs::path& file, ordered_json& document, const char* array, const char* kind,
                   const std::map<int, json>& update) {
    for (const auto& [index, extras] : update) {
        ordered_json& object = objectOf(file, document, array, kind, index);
        if (extras.is_null())
            object.erase("extras");
        else
            replaceValue(object, "extras", extras);
    }
}

void replaceRigidBodies(const fs::path& file, ordered_json& document, const std::map<int, json>& update) {
    for (const auto& [index, body] : update)
        replaceValue((index == -1 ? document : objectOf(file, document, "nodes", "node", index))["extensions"],
                     kRigidBodies, body);
}

void replacePlaces(const fs::path& file, ordered_json& document, const std::map<int, LocalTransform>& update) {
    for (const auto& [index, local] : update) {
        ordered_json& node = objectOf(file, document, "nodes", "node", index);
        for (const char* key : {"matrix", "translation", "rotation", "scale"}) node.erase(key);
        const json fields = placeFields(local);
        for (const auto& [key, value] : fields.items()) node[key] = value;
    }
}

void replaceLooks(const fs::path& file, ordered_json& document, const std::map<int, Material>& update) {
    for (const auto& [index, material] : update) {
        ordered_json& factors = objectOf(file, document, "materials", "material", index)["pbrMetallicRoughness"];
        const glm::vec4& c = material.baseColor;
        factors["baseColorFactor"] = {c.r, c.g, c.b, c.a};
        factors["metallicFactor"] = material.metallic;
        factors["roughnessFactor"] = material.roughness;
    }
}

void addNodes(const fs::path& file, ordered_json& document, const std::map<int, int>& added, int scene) {
    for (const auto& [index, parent] : added) {
        if (static_cast<std::size_t>(index) < document["nodes"].size()) continue;  // saved before
        if (static_cast<std::size_t>(index) > document["nodes"].size())
            failIn(file, "", "has fewer nodes than the scene that is saved; open the file again");
        document["nodes"].push_back(ordered_json::object());
        ordered_json& above = parent < 0 ? objectOf(file, document, "scenes", "scene", scene)["nodes"]
                                         : objectOf(file, document, "nodes", "node", parent)["children"];
        above.push_back(index);
    }
}

/// The data of one motion in a buffer of its own, named so that a later motion takes its place.
class MotionWriter {
  public:
    MotionWriter(ordered_json& document, int animation)
        : document_(document), name_("motion of animation " + std::to_string(animation)) {}

    /// Returns the index of the accessor. `components`: of an element.
    std::size_t add(const std::vector<float>& values, std::size_t components) {
        ordered_json accessor = {{"bufferView", slot("bufferViews", views_)},
                                 {"componentType", 5126},
                                 {"count", values.size() / components},
                                 {"type", components == 1   ? "SCALAR"
                                          : components == 3 ? "VEC3"
                                                            : "VEC4"},
                                 {"name", name_}};
        if (components == 1) {
            accessor["min"] = ordered_json::array({values.front()});
            accessor["max"] = ordered_json::array({values.back()});
        }
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
        const std::size_t size = values.size() * sizeof(float);
        document_["bufferViews"][accessor["bufferView"].get<std::size_t>()] = {
            {"buffer", buffer_}, {"byteOffset", bytes_.size()}, {"byteLength", size}, {"name", name_}};
        bytes_.insert(bytes_.end(), bytes, bytes + size);
        const std::size_t index = slot("accessors", accessors_);
        document_["accessors"][index] = std::move(accessor);
        return index;
    }

    void finish() {
        document_["buffers"][buffer_] = {{"byteLength", bytes_.size()}, {"uri", dataUri(bytes_)}, {"name", name_}};
    }

  private:
    /// The next item of the array that an earlier motion left, from `from` on, or a new one.
    std::size_t slot(const char* array, std::size_t& from) {
        ordered_json& all = document_[array];
        for (; from < all.size(); ++from)
            if (all[from].value("name", "") == name_) return from++;
        all.push_back(ordered_json::object());
        return from++;
    }

    ordered_json& document_;
    const std::string name_;
    std::size_t views_ = 0, accessors_ = 0, buffers_ = 0;
    const std::size_t buffer_ = slot("buffers", buffers_);
    std::vector<std::uint8_t> bytes_;
};

void replaceMotion(const fs::path& file, ordered_json& document, int index, const MotionUpdate& update) {
    if (!document.contains("animations")) document["animations"] = ordered_json::array();
    if (static_cast<std::size_t>(index) == document["animations"].size())
        document["animations"].push_back(ordered_json::object());
    ordered_json& animation = objectOf(file, document, "animations", "animation", index);
    if (!update.animation.name.empty()) animation["name"] = update.animation.name;

    ordered_json channels = ordered_json::array(), samplers = ordered_json::array();
    for (ordered_json channel : animation.value("channels", ordered_json::array())) {
        const ordered_json target = channel.value("target", ordered_json::object());
        const std::string path = target.value("path", "");
        if (target.value("node", -1) == update.node && (path == "translation" || path == "rotation")) continue;
        samplers.push_back(animation["samplers"][channel["sampler"].get<std::size_t>()]);
        channel["sampler"] = samplers.size() - 1;
        channels.push_back(std::move(channel));
    }
    MotionWriter writer(document, index);
    std::map<std::vector<double>, std::size_t> inputs;  // channels share their times
    for (const AnimationChannel& channel : update.animation.channels) {
        const std::size_t components = channel.path == AnimationPath::Rotation ? 4 : 3;
        std::vector<float> values;
        for (const glm::dvec4& value : channel.values)
            for (std::size_t k = 0; k < components; ++k)
                values.push_back(static_cast<float>(value[static_cast<int>(k)]));
        auto input = inputs.find(channel.times);
        if (input == inputs.end())
            input = inputs.emplace(channel.times, writer.add({channel.times.begin(), channel.times.end()}, 1)).first;
        ordered_json sampler{{"input", input->second}, {"output", writer.add(values, components)}};
        if (channel.interpolation != Interpolation::Linear)
            sampler["interpolation"] = channel.interpolation == Interpolation::Step ? "STEP" : "CUBICSPLINE";
        samplers.push_back(std::move(sampler));
        channels.push_back(
            {{"sampler", samplers.size() - 1},
             {"target", {{"node", update.node}, {"path", components == 4 ? "rotation" : "translation"}}}});
    }
    writer.finish();
    ordered_json& written = document["animations"][static_cast<std::size_t>(index)];
    written["samplers"] = std::move(samplers);
    written["channels"] = std::move(channels);
}

bool hasExternalFiles(const ordered_json& document) {
    for (const char* array : {"buffers", "images"})
        if (document.contains(array) && document[array].is_array())
            for (const ordered_json& item : document[array])
                if (item.contains("uri") && item["uri"].is_string() &&
                    !item["uri"].get_ref<const std::string&>().starts_with("data:"))
                    return true;
    return false;
}

/// Indentation of the first indented line, at most 8; -1 if the text is a single line.
int indentation(const std::string& text) {
    const std::size_t lineEnd = text.find('\n');
    if (lineEnd == text.npos) return -1;
    const std::size_t first = text.find_first_not_of(" \t", lineEnd + 1);
    return first == text.npos ? 0 : static_cast<int>(std::min<std::size_t>(first - lineEnd - 1, 8));
}

}  // namespace

void updateGltf(const fs::path& in, const fs::path& out, const GltfUpdate& update) {
    const GltfContainer container = readContainer(in);
    Warnings ignored;  // already reported when the file was read
    checkGltf(in, parseJson(in, container.json), -1, ignored);
    ordered_json document = parseOrderedJson(in, container.json);
    addNodes(in, document, update.addedNodes, update.scene);
    replaceExtras(in, document, "nodes", "node", update.nodes);
    replaceExtras(in, document, "scenes", "scene", update.scenes);
    replacePlaces(in, document, update.places);
    for (const auto& [index, name] : update.names) objectOf(in, document, "nodes", "node", index)["name"] = name;
    replaceLooks(in, document, update.materials);
    replaceRigidBodies(in, document, update.rigidBodies);
    for (const auto& [index, motion] : update.motions) replaceMotion(in, document, index, motion);

    std::error_code error;
    const auto folder = [](const fs::path& file) {
        return file.has_parent_path() ? file.parent_path() : fs::path(".");
    };
    if (hasExternalFiles(document) && !fs::equivalent(folder(in), folder(out), error))
        failIn(out, "", "would lose the files it refers to; save it into the folder of " + in.string());
    if (out.extension() != (container.binary ? ".glb" : ".gltf"))
        failIn(out, "", std::string("must be named ") + (container.binary ? ".glb" : ".gltf") + " like its original");

    if (container.binary) {
        writeBytes(out, glbBytes(document.dump(), container.followers));
    } else {
        const int indent = indentation(container.json);
        const char fill = container.json.find("\n\t") != container.json.npos ? '\t' : ' ';
        const std::string text = document.dump(indent, fill) + (container.json.back() == '\n' ? "\n" : "");
        writeBytes(out, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    }
}

}  // namespace touchstone::engine
