// updateGltf() of gltf_write.hpp: saves markings, physics, transforms, names and materials into an existing file.
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
    replaceExtras(in, document, "nodes", "node", update.nodes);
    replaceExtras(in, document, "scenes", "scene", update.scenes);
    replacePlaces(in, document, update.places);
    for (const auto& [index, name] : update.names) objectOf(in, document, "nodes", "node", index)["name"] = name;
    replaceLooks(in, document, update.materials);
    replaceRigidBodies(in, document, update.rigidBodies);

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
