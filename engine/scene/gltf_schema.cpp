#include "engine/scene/gltf_schema.hpp"

#include <cmath>
#include <limits>
#include <string_view>

#include "engine/scene/gltf_container.hpp"

namespace touchstone::engine {
namespace {

using nlohmann::json;

/// One property of an object: its kind and, as the kind needs them, range, choices, array referred to, and fields.
struct Field {
    enum Kind { Integer, Number, Numbers, Text, Texts, Flag, Index, Indices, IndexMap, Object, Objects };
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
/// Beyond any scene, and small enough that products of two stay finite in single precision.
constexpr double kMaxNumber = 1e12;

Field integer(const char* name, double low, double high = kMaxInt) { return {name, Field::Integer, low, high}; }
Field number(const char* name) { return {name, Field::Number, -kMaxNumber, kMaxNumber}; }
Field numbers(const char* name, int length) { return {name, Field::Numbers, double(length), kMaxNumber}; }
Field text(const char* name, std::vector<json> choices = {}) { return {name, Field::Text, 0, 0, std::move(choices)}; }
Field texts(const char* name) { return {name, Field::Texts}; }
Field flag(const char* name) { return {name, Field::Flag}; }
Field index(const char* name, const char* target) { return {name, Field::Index, 0, 0, {}, target}; }
Field indices(const char* name, const char* target) { return {name, Field::Indices, 0, 0, {}, target}; }
Field indexMap(const char* name, const char* target) { return {name, Field::IndexMap, 0, 0, {}, target}; }
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

const std::vector<Field>& documentFields() {
    static const std::vector<Field> fields = {
        required(object("asset", {required(text("version")), text("minVersion")})),
        texts("extensionsUsed"),
        texts("extensionsRequired"),
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
                           required(objects("primitives", {required(indexMap("attributes", "accessors")),
                                                           index("indices", "accessors"),
                                                           index("material", "materials"), integer("mode", 0, 6)}))}),
        objects("nodes", {text("name"), index("mesh", "meshes"), indices("children", "nodes"), numbers("matrix", 16),
                          numbers("translation", 3), numbers("rotation", 4), numbers("scale", 3)}),
        index("scene", "scenes"),
        objects("scenes", {text("name"), indices("nodes", "nodes")}),
        objects("materials", {text("name"),
                              object("pbrMetallicRoughness", {numbers("baseColorFactor", 4), number("metallicFactor"),
                                                              number("roughnessFactor"), texture("baseColorTexture"),
                                                              texture("metallicRoughnessTexture")}),
                              texture("normalTexture", {number("scale")}), texture("emissiveTexture"),
                              numbers("emissiveFactor", 3)}),
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

class Checker {
  public:
    Checker(const std::filesystem::path& file, const json& document) : file_(file), document_(document) {}

    json object(const json& value, const std::vector<Field>& fields, const std::string& label,
                const std::string& path) {
        if (!value.is_object()) fail(label, path, "must be an object");
        json copy = json::object();
        for (const Field& field : fields) {
            const std::string name = path.empty() ? field.name : path + "." + field.name;
            const auto found = value.find(field.name);
            if (found != value.end())
                copy[field.name] = property(*found, field, label, name);
            else if (field.isRequired)
                fail(label, name, "is missing");
        }
        return copy;
    }

  private:
    [[noreturn]] void fail(const std::string& label, const std::string& path, const std::string& problem) {
        failIn(file_, label,
               (path.empty() ? "" : "\"" + path + "\" ") + problem + "; correct it or export the file again");
    }

    json property(const json& value, const Field& field, const std::string& label, const std::string& path) {
        if (!field.choices.empty()) {
            for (const json& choice : field.choices)
                if (choice == value) return choice;
            fail(label, path, "must be one of " + json(field.choices).dump());
        }
        switch (field.kind) {
            case Field::Integer:
                if (!value.is_number_integer()) fail(label, path, "must be a whole number");
                return inRange(value, field.low, field.high, label, path);
            case Field::Number:
                if (!value.is_number()) fail(label, path, "must be a number");
                return inRange(value, field.low, field.high, label, path);
            case Field::Numbers: {
                if (!value.is_array() || value.size() != static_cast<std::size_t>(field.low))
                    fail(label, path, "must be " + std::to_string(static_cast<int>(field.low)) + " numbers");
                for (const json& item : value) {
                    if (!item.is_number()) fail(label, path, "must hold numbers only");
                    inRange(item, -field.high, field.high, label, path);
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
            case Field::Indices:
                if (!value.is_array()) fail(label, path, "must be a list of indices");
                for (const json& item : value) indexInto(field.target, item, label, path);
                return value;
            case Field::IndexMap:
                if (!value.is_object()) fail(label, path, "must be an object");
                for (const auto& [name, item] : value.items())
                    indexInto(field.target, item, label, path + "." + printable(name));
                return value;
            case Field::Object:
                return object(value, field.fields, label, path);
            case Field::Objects:
                return list(value, field, label, path);
        }
        return value;
    }

    json list(const json& value, const Field& field, const std::string& label, const std::string& path) {
        if (!value.is_array()) fail(label, path, "must be a list");
        json copy = json::array();
        for (std::size_t i = 0; i < value.size(); ++i) {
            std::string itemLabel = label.empty() ? "" : label + ", ";
            std::string name;
            if (value[i].is_object() && value[i].contains("name") && value[i]["name"].is_string())
                name = value[i]["name"].get<std::string>();
            itemLabel += objectLabel(singular(field.name), i, name);
            copy.push_back(object(value[i], field.fields, itemLabel, ""));
        }
        return copy;
    }

    const json& inRange(const json& value, double low, double high, const std::string& label, const std::string& path) {
        const double x = value.get<double>();
        if (!(x >= low && x <= high))
            fail(label, path, "is " + value.dump() + ", not within " + json(low).dump() + " to " + json(high).dump());
        return value;
    }

    const json& indexInto(const char* target, const json& value, const std::string& label, const std::string& path) {
        if (!value.is_number_integer()) fail(label, path, "must be an index");
        const auto array = document_.find(target);
        const std::size_t size = array != document_.end() && array->is_array() ? array->size() : 0;
        const double x = value.get<double>();
        if (!(x >= 0 && x < static_cast<double>(size)))
            fail(label, path, "is " + value.dump() + " but the file has " + std::to_string(size) + " " + target);
        return value;
    }

    const std::filesystem::path& file_;
    const json& document_;
};

}  // namespace

json checkedDocument(const std::filesystem::path& file, const json& document) {
    return Checker(file, document).object(document, documentFields(), "", "");
}

}  // namespace touchstone::engine
