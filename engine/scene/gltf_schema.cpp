#include "engine/scene/gltf_schema.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "engine/scene/scene.hpp"

namespace touchstone::engine {
namespace {

using nlohmann::json;

/// A property of an object: its kind and, depending on the kind, range, choices, target array and fields.
struct Field {
    enum Kind { Integer, Number, Numbers, Text, Texts, Flag, Index, Indices, Object, Objects };
    const char* name;
    Kind kind;
    double low = 0, high = 0;        ///< range of a number; `low` is also the length of Numbers
    std::vector<json> choices = {};  ///< all values allowed; empty: any
    const char* target = nullptr;    ///< top-level array that an index points into
    std::vector<Field> fields = {};
    bool isRequired = false;
};

Field required(Field field) {
    field.isRequired = true;
    return field;
}
constexpr double kMaxInt = std::numeric_limits<std::int32_t>::max();
/// Larger than in any scene, but products of two numbers stay finite in single precision.
constexpr double kMaxNumber = 1e12;

Field integer(const char* name, double low, double high = kMaxInt) { return {name, Field::Integer, low, high}; }
Field number(const char* name) { return {name, Field::Number, -kMaxNumber, kMaxNumber}; }
Field numbers(const char* name, int length) { return {name, Field::Numbers, double(length), kMaxNumber}; }
Field text(const char* name, std::vector<json> choices = {}) { return {name, Field::Text, 0, 0, std::move(choices)}; }
Field texts(const char* name) { return {name, Field::Texts}; }
Field flag(const char* name) { return {name, Field::Flag}; }
Field index(const char* name, const char* target) { return {name, Field::Index, 0, 0, {}, target}; }
Field indices(const char* name, const char* target) { return {name, Field::Indices, 0, 0, {}, target}; }
Field object(const char* name, std::vector<Field> fields) {
    return {name, Field::Object, 0, 0, {}, nullptr, std::move(fields)};
}
Field objects(const char* name, std::vector<Field> fields) {
    return {name, Field::Objects, 0, 0, {}, nullptr, std::move(fields)};
}
Field texture(const char* name, std::vector<Field> more = {}) {
    more.insert(more.end(), {required(index("index", "textures")), integer("texCoord", 0)});
    return object(name, std::move(more));
}
Field componentType(std::vector<json> choices) {
    return {"componentType", Field::Integer, 0, kMaxInt, std::move(choices)};
}

const std::vector<Field>& headerFields() {
    static const std::vector<Field> fields = {
        required(object("asset", {required(text("version")), text("minVersion")})), texts("extensionsUsed"),
        texts("extensionsRequired")};
    return fields;
}

/// Attributes that are read; others are ignored.
Field vertexAttributes() {
    std::vector<Field> fields = {index("POSITION", "accessors"), index("NORMAL", "accessors"),
                                 index("COLOR_0", "accessors")};
    for (const char* name : {"TEXCOORD_0", "TEXCOORD_1", "TEXCOORD_2", "TEXCOORD_3", "TEXCOORD_4", "TEXCOORD_5",
                             "TEXCOORD_6", "TEXCOORD_7"})
        fields.push_back(index(name, "accessors"));
    return required(object("attributes", std::move(fields)));
}

/// Node extensions that affect the placement and visibility of its mesh.
Field nodeExtensions() {
    return object(
        "extensions",
        {object("EXT_mesh_gpu_instancing",
                {required(object("attributes", {index("TRANSLATION", "accessors"), index("ROTATION", "accessors"),
                                                index("SCALE", "accessors")}))}),
         object("KHR_node_visibility", {flag("visible")})});
}

const std::vector<Field>& arrayFields() {
    static const std::vector<Field> fields = {
        objects("buffers", {text("name"), text("uri"), required(integer("byteLength", 1))}),
        objects("bufferViews", {text("name"), required(index("buffer", "buffers")), integer("byteOffset", 0),
                                required(integer("byteLength", 1)), integer("byteStride", 4, 252)}),
        objects(
            "accessors",
            {text("name"), index("bufferView", "bufferViews"), integer("byteOffset", 0),
             required(componentType({5120, 5121, 5122, 5123, 5125, 5126})), flag("normalized"),
             required(integer("count", 1)),
             required(text("type", {"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"})),
             object("sparse",
                    {required(integer("count", 1)),
                     required(object("indices", {required(index("bufferView", "bufferViews")), integer("byteOffset", 0),
                                                 required(componentType({5121, 5123, 5125}))})),
                     required(object("values",
                                     {required(index("bufferView", "bufferViews")), integer("byteOffset", 0)}))})}),
        objects("meshes", {text("name"),
                           required(objects("primitives", {vertexAttributes(), index("indices", "accessors"),
                                                           index("material", "materials"), integer("mode", 0, 6)}))}),
        objects("nodes", {text("name"), index("mesh", "meshes"), indices("children", "nodes"), numbers("matrix", 16),
                          numbers("translation", 3), numbers("rotation", 4), numbers("scale", 3), nodeExtensions()}),
        objects("scenes", {text("name"), indices("nodes", "nodes")}),
        objects("materials", {text("name"),
                              object("pbrMetallicRoughness", {numbers("baseColorFactor", 4), number("metallicFactor"),
                                                              number("roughnessFactor"), texture("baseColorTexture"),
                                                              texture("metallicRoughnessTexture")}),
                              texture("normalTexture", {number("scale")}), texture("emissiveTexture"),
                              numbers("emissiveFactor", 3), text("alphaMode"), number("alphaCutoff")}),
        objects("textures", {text("name"), index("source", "images")}),
        objects("images", {text("name"), text("uri"), text("mimeType"), index("bufferView", "bufferViews")}),
        objects("animations",
                {text("name"),
                 required(objects("channels",
                                  {required(integer("sampler", 0)),
                                   required(object("target", {index("node", "nodes"), required(text("path"))}))})),
                 required(
                     objects("samplers", {required(index("input", "accessors")), required(index("output", "accessors")),
                                          text("interpolation", {"LINEAR", "STEP", "CUBICSPLINE"})}))}),
    };
    return fields;
}

/// "accessors" -> "accessor"; "meshes" -> "mesh".
std::string singular(std::string_view plural) {
    if (plural == "meshes") return "mesh";
    if (plural == "bufferViews") return "buffer view";
    return std::string(plural.substr(0, plural.size() - 1));
}

/// Integer value of a number; some exporters write 4 as 4.0.
std::optional<std::int64_t> whole(const json& value) {
    constexpr double kLargestExact = 9007199254740992.0;  // 2^53
    if (value.is_number_unsigned() && value.get<std::uint64_t>() > std::uint64_t{1} << 62) return std::nullopt;
    if (value.is_number_integer()) return value.get<std::int64_t>();
    if (!value.is_number_float()) return std::nullopt;
    const double x = value.get<double>();
    if (!(std::abs(x) <= kLargestExact) || std::trunc(x) != x) return std::nullopt;
    return static_cast<std::int64_t>(x);
}

class Checker {
  public:
    Checker(const GltfSchema& schema, const GltfSchema::OnReference& onReference)
        : schema_(schema), onReference_(onReference) {}

    json object(const json& value, const std::vector<Field>& fields, const std::string& label,
                const std::string& path) const {
        if (!value.is_object()) fail(label, path, "must be an object");
        json copy = json::object();
        for (const Field& field : fields) {
            const auto found = value.find(field.name);
            if (found == value.end() && !field.isRequired) continue;
            const std::string name = path.empty() ? field.name : path + "." + field.name;
            if (found == value.end()) fail(label, name, "is missing");
            copy[field.name] = property(*found, field, label, name);
        }
        return copy;
    }

    [[noreturn]] static void fail(const std::string& label, const std::string& path, const std::string& problem) {
        throw GltfProblem{label, (path.empty() ? "" : "\"" + path + "\" ") + problem};
    }

  private:
    json property(const json& value, const Field& field, const std::string& label, const std::string& path) const {
        if (!field.choices.empty()) {
            for (const json& choice : field.choices)
                if (choice == value) return choice;  // 5126.0 is 5126
            fail(label, path, "must be one of " + json(field.choices).dump());
        }
        switch (field.kind) {
            case Field::Integer: {
                // A number that is too large for an integer is reported by checkRange().
                const auto number = whole(value);
                if (!number && !value.is_number_integer()) fail(label, path, "must be a whole number");
                checkRange(value, field.low, field.high, label, path);
                return *number;
            }
            case Field::Number:
                if (!value.is_number()) fail(label, path, "must be a number");
                checkRange(value, field.low, field.high, label, path);
                return value;
            case Field::Numbers: {
                if (!value.is_array() || value.size() != static_cast<std::size_t>(field.low))
                    fail(label, path, "must be " + std::to_string(static_cast<int>(field.low)) + " numbers");
                for (const json& item : value) {
                    if (!item.is_number()) fail(label, path, "must hold numbers only");
                    checkRange(item, -field.high, field.high, label, path);
                }
                return value;
            }
            case Field::Text:
                if (!value.is_string()) fail(label, path, "must be text");
                return value;
            case Field::Texts:
                if (!value.is_array()) fail(label, path, "must be a list of texts");
                for (const json& item : value)
                    if (!item.is_string()) fail(label, path, "must be a list of texts");
                return value;
            case Field::Flag:
                if (!value.is_boolean()) fail(label, path, "must be true or false");
                return value;
            case Field::Index:
                return indexInto(field.target, value, label, path);
            case Field::Indices: {
                if (!value.is_array()) fail(label, path, "must be a list of indices");
                json copy = json::array();
                for (const json& item : value) copy.push_back(indexInto(field.target, item, label, path));
                return copy;
            }
            case Field::Object:
                return object(value, field.fields, label, path);
            case Field::Objects:
                return list(value, field, label, path);
        }
        return value;
    }

    json list(const json& value, const Field& field, const std::string& label, const std::string& path) const {
        if (!value.is_array()) fail(label, path, "must be a list");
        json copy = json::array();
        const std::string prefix = label + ", " + singular(field.name) + " ";
        for (std::size_t i = 0; i < value.size(); ++i)
            copy.push_back(object(value[i], field.fields, prefix + std::to_string(i), ""));
        return copy;
    }

    static void checkRange(const json& value, double low, double high, const std::string& label,
                           const std::string& path) {
        const double x = value.get<double>();
        if (!(x >= low && x <= high))
            fail(label, path, "is " + value.dump() + ", not within " + json(low).dump() + " to " + json(high).dump());
    }

    std::int64_t indexInto(const char* target, const json& value, const std::string& label,
                           const std::string& path) const {
        const auto index = whole(value);
        if (!index && !value.is_number_integer()) fail(label, path, "must be an index");
        const std::size_t size = schema_.size(target);
        if (!index || *index < 0 || static_cast<std::size_t>(*index) >= size)
            fail(label, path, "is " + value.dump() + " but the file has " + std::to_string(size) + " " + target);
        onReference_(target, static_cast<std::size_t>(*index));
        return *index;
    }

    const GltfSchema& schema_;
    const GltfSchema::OnReference& onReference_;
};

const GltfSchema::OnReference ignore = [](std::string_view, std::size_t) {};

}  // namespace

const std::vector<std::string_view>& GltfSchema::arrays() {
    static const std::vector<std::string_view> names = [] {
        std::vector<std::string_view> all;
        for (const Field& field : arrayFields()) all.push_back(field.name);
        return all;
    }();
    return names;
}

std::size_t GltfSchema::size(std::string_view array) const {
    const auto found = document_.find(array);
    if (found == document_.end()) return 0;
    if (!found->is_array()) Checker::fail("", std::string(array), "must be a list");
    return found->size();
}

json GltfSchema::header() const { return Checker(*this, ignore).object(document_, headerFields(), "", ""); }

std::optional<std::size_t> GltfSchema::defaultScene() const {
    const json found = Checker(*this, ignore).object(document_, {index("scene", "scenes")}, "", "");
    if (!found.contains("scene")) return std::nullopt;
    return found["scene"].get<std::size_t>();
}

json GltfSchema::object(std::string_view array, std::size_t index, const OnReference& onReference) const {
    const auto fields = std::find_if(arrayFields().begin(), arrayFields().end(),
                                     [&](const Field& field) { return field.name == array; });
    return Checker(*this, onReference).object((*document_.find(array))[index], fields->fields, label(array, index), "");
}

std::string GltfSchema::label(std::string_view array, std::size_t index) const {
    const json& object = (*document_.find(array))[index];
    const auto name = object.is_object() ? object.find("name") : object.end();
    const bool isNamed = object.is_object() && name != object.end() && name->is_string();
    return objectLabel(singular(array), index, isNamed ? name->get<std::string>() : "");
}

}  // namespace touchstone::engine
