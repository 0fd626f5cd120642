#include "engine/scene/gltf_write.hpp"

#include <stb_image_write.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/transforms.hpp"

namespace touchstone::engine {
namespace {

using nlohmann::json;
using Bytes = std::vector<std::uint8_t>;

enum Target { kNone = 0, kVertices = 34962, kIndices = 34963 };
constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;

class SceneWriter {
  public:
    SceneWriter(const Scene& scene, const std::filesystem::path& file) : scene_(scene), file_(file) {}

    void write() {
        document_["asset"] = {{"version", "2.0"}, {"generator", "Touchstone"}};
        collectNodes();
        writeImages();
        writeMaterials();
        writeNodes();
        writeAnimations();
        writeExtensions();
        const std::string extension = file_.extension().string();
        if (extension != ".glb" && extension != ".gltf") fail("", "must be named .glb or .gltf; choose one of the two");
        const bool binary = extension == ".glb";
        if (!bin_.empty()) document_["buffers"][0]["byteLength"] = bin_.size();
        if (!bin_.empty() && !binary) document_["buffers"][0]["uri"] = dataUri(bin_);
        const std::string text = document_.dump(binary ? -1 : 1);
        if (binary)
            writeBytes(file_, glbBytes(text, bin_.empty() ? Bytes() : binChunk(std::move(bin_))));
        else
            writeBytes(file_, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    }

  private:
    [[noreturn]] void fail(const std::string& object, const std::string& problem) const {
        failIn(file_, object, problem);
    }

    /// Appends bytes at a multiple of 4 and returns the index of their buffer view.
    std::size_t addView(const void* data, std::size_t size, Target target) {
        bin_.resize((bin_.size() + 3) / 4 * 4);
        json view = {{"buffer", 0}, {"byteOffset", bin_.size()}, {"byteLength", size}};
        if (target != kNone) view["target"] = target;
        const auto* bytes = static_cast<const std::uint8_t*>(data);
        bin_.insert(bin_.end(), bytes, bytes + size);
        return add("bufferViews", std::move(view));
    }

    std::size_t add(const char* array, json item) {
        document_[array].push_back(std::move(item));
        return document_[array].size() - 1;
    }

    /// Adds an accessor with `components` floats per element. `withRange`: write min and max, which glTF requires for
    /// some uses.
    std::size_t addFloats(const std::vector<float>& values, std::size_t components, Target target, bool withRange) {
        constexpr const char* kTypes[] = {"", "SCALAR", "VEC2", "VEC3", "VEC4"};
        json accessor = {{"bufferView", addView(values.data(), values.size() * sizeof(float), target)},
                         {"componentType", kFloat},
                         {"count", values.size() / components},
                         {"type", kTypes[components]}};
        for (std::size_t k = 0; withRange && k < components; ++k) {
            float low = values[k], high = values[k];
            for (std::size_t i = k; i < values.size(); i += components) {
                low = std::min(low, values[i]);
                high = std::max(high, values[i]);
            }
            accessor["min"].push_back(low);
            accessor["max"].push_back(high);
        }
        return add("accessors", std::move(accessor));
    }

    template <class V>
    static std::vector<float> flat(const std::vector<V>& vectors) {
        std::vector<float> values;
        values.reserve(vectors.size() * static_cast<std::size_t>(V::length()));
        for (const V& v : vectors)
            for (int k = 0; k < V::length(); ++k) values.push_back(static_cast<float>(v[k]));
        return values;
    }

    std::size_t addIndices(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
        const bool isShort = vertices <= 0xFFFF;  // the largest value of a type is reserved for primitive restart
        const std::vector<std::uint16_t> narrow(isShort ? indices.begin() : indices.end(), indices.end());
        const std::size_t view = isShort ? addView(narrow.data(), narrow.size() * sizeof(std::uint16_t), kIndices)
                                         : addView(indices.data(), indices.size() * sizeof(std::uint32_t), kIndices);
        return add("accessors", {{"bufferView", view},
                                 {"componentType", isShort ? kUnsignedShort : kUnsignedInt},
                                 {"count", indices.size()},
                                 {"type", "SCALAR"}});
    }

    void checkMesh(const MeshData& mesh, const std::string& user) const {
        const std::size_t count = mesh.positions.size();
        const auto isFinite = [](const auto& v) {
            for (int k = 0; k < v.length(); ++k)
                if (!std::isfinite(v[k])) return false;
            return true;
        };
        const auto allFinite = [&](const auto& items) { return std::all_of(items.begin(), items.end(), isFinite); };
        if (!allFinite(mesh.positions) || !allFinite(mesh.normals) || !allFinite(mesh.texcoords) ||
            !allFinite(mesh.colors))
            fail(user, "its mesh holds a non-finite number; repair the mesh");
        if ((!mesh.normals.empty() && mesh.normals.size() != count) ||
            (!mesh.texcoords.empty() && mesh.texcoords.size() != count) ||
            (!mesh.colors.empty() && mesh.colors.size() != count))
            fail(user,
                 "its mesh has a different number of normals, texture coordinates or colors than positions; repair the "
                 "mesh");
        if (mesh.indices.empty() || mesh.indices.size() % 3 != 0 ||
            *std::max_element(mesh.indices.begin(), mesh.indices.end()) >= count)
            fail(user, "its mesh has no triangles or indices beyond its vertices; repair the mesh");
    }

    /// Attributes and indices of a mesh, which are written only once.
    const json& geometry(const std::shared_ptr<const MeshData>& data, const std::string& user) {
        const auto found = geometries_.find(data.get());
        if (found != geometries_.end()) return found->second;
        if (!data) fail(user, "has a primitive without a mesh; add one");
        checkMesh(*data, user);
        json primitive;
        primitive["attributes"]["POSITION"] = addFloats(flat(data->positions), 3, kVertices, true);
        if (!data->normals.empty() && !data->flat) {
            std::vector<glm::vec3> unit = data->normals;
            for (glm::vec3& n : unit) {
                const double length = glm::length(glm::dvec3(n));
                n = length > 0 ? glm::vec3(glm::dvec3(n) / length) : glm::vec3(0, 0, 1);
            }
            primitive["attributes"]["NORMAL"] = addFloats(flat(unit), 3, kVertices, false);
        }
        if (!data->texcoords.empty())
            primitive["attributes"]["TEXCOORD_0"] = addFloats(flat(data->texcoords), 2, kVertices, false);
        if (!data->colors.empty())
            primitive["attributes"]["COLOR_0"] = addFloats(flat(data->colors), 4, kVertices, false);
        primitive["indices"] = addIndices(data->indices, data->positions.size());
        return geometries_.emplace(data.get(), std::move(primitive)).first->second;
    }

    static std::vector<std::pair<const MeshData*, int>> keyOf(const MeshInstance& instance) {
        std::vector<std::pair<const MeshData*, int>> key;
        for (const Primitive& primitive : instance.primitives)
            key.emplace_back(primitive.mesh.get(), primitive.material);
        return key;
    }

    /// Index of a mesh with these primitives; equal meshes are shared.
    std::size_t meshOf(const MeshInstance& instance, const std::string& user) {
        const auto found = meshes_.find(keyOf(instance));
        return found != meshes_.end() ? found->second : addMesh(instance, user);
    }

    std::size_t addMesh(const MeshInstance& instance, const std::string& user) {
        json mesh;
        for (const Primitive& primitive : instance.primitives) {
            json item = geometry(primitive.mesh, user);
            if (primitive.material >= static_cast<int>(scene_.materials.size()))
                fail(user, "uses material " + std::to_string(primitive.material) + ", which does not exist; add it");
            if (primitive.material >= 0) {
                item["material"] = primitive.material;
                const auto textures = scene_.materials[static_cast<std::size_t>(primitive.material)].textures();
                if (primitive.mesh->texcoords.empty() && std::ranges::any_of(textures, [](int t) { return t >= 0; }))
                    fail(user, "has a textured material but no texture coordinates; add them or remove the texture");
            }
            mesh["primitives"].push_back(std::move(item));
        }
        const std::size_t index = add("meshes", std::move(mesh));
        meshes_.emplace(keyOf(instance), index);
        return index;
    }

    void writeImages() {
        for (std::size_t i = 0; i < scene_.images.size(); ++i) {
            const Image& image = scene_.images[i];
            const std::string label = objectLabel("image", i);
            if (image.width < 1 || image.height < 1 ||
                image.rgba.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) * 4)
                fail(label, "has a number of pixels that does not match its size; repair it");
            const Bytes png = pngBytes(image);
            if (png.empty()) fail(label, "cannot be stored as PNG; make it smaller");
            add("images", {{"mimeType", "image/png"}, {"bufferView", addView(png.data(), png.size(), kNone)}});
            add("textures", {{"source", i}});
        }
    }

    void writeMaterials() {
        for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
            const Material& material = scene_.materials[i];
            json factors = {{"metallicFactor", material.metallic}, {"roughnessFactor", material.roughness}};
            for (int k = 0; k < 4; ++k) factors["baseColorFactor"].push_back(material.baseColor[k]);
            const auto addTexture = [&](json& to, const char* key, int image) {
                if (image >= static_cast<int>(scene_.images.size()))
                    fail(objectLabel("material", i, material.name), "uses an image that does not exist; add it");
                if (image >= 0) to[key] = {{"index", image}};
            };
            addTexture(factors, "baseColorTexture", material.texture);
            addTexture(factors, "metallicRoughnessTexture", material.metallicRoughnessTexture);
            json item = {{"pbrMetallicRoughness", std::move(factors)}};
            addTexture(item, "normalTexture", material.normalTexture);
            if (material.normalTexture >= 0 && material.normalScale != 1)
                item["normalTexture"]["scale"] = material.normalScale;
            addTexture(item, "emissiveTexture", material.emissiveTexture);
            if (material.emissive != glm::vec3(0))
                for (int k = 0; k < 3; ++k) item["emissiveFactor"].push_back(material.emissive[k]);
            if (!material.name.empty()) item["name"] = material.name;
            if (material.alphaMode != AlphaMode::Opaque)
                item["alphaMode"] = material.alphaMode == AlphaMode::Blend ? "BLEND" : "MASK";
            if (material.alphaMode == AlphaMode::Mask && material.alphaCutoff != 0.5f)
                item["alphaCutoff"] = material.alphaCutoff;
            add("materials", std::move(item));
        }
    }

    /// Numbers the nodes: nodes with a glTF index keep it, other nodes below the roots follow.
    void collectNodes() {
        nodes_ = scene_.nodes;
        for (std::size_t i = 0; i < nodes_.size(); ++i)
            if (scene_.registry.alive(nodes_[i])) indices_[nodes_[i].index] = i;
        std::vector<Entity> open(scene_.roots.rbegin(), scene_.roots.rend());
        while (!open.empty()) {
            const Entity node = open.back();
            open.pop_back();
            if (indices_.emplace(node.index, nodes_.size()).second) nodes_.push_back(node);
            if (const Hierarchy* hierarchy = scene_.registry.find<Hierarchy>(node))
                open.insert(open.end(), hierarchy->children.rbegin(), hierarchy->children.rend());
        }
    }

    void writeNodes() {
        // Write all meshes first, even equal ones, so that they keep their indices: colliders refer to them.
        std::size_t end = scene_.meshes.size();
        while (end > 0 && scene_.meshes[end - 1].primitives.empty()) --end;
        for (std::size_t i = 0; i < end; ++i) {
            if (scene_.meshes[i]
                    .primitives.empty())  // glTF requires a primitive: write a point, which the reader ignores
                add("meshes",
                    {{"primitives",
                      {{{"mode", 0}, {"attributes", {{"POSITION", addFloats({0, 0, 0}, 3, kVertices, true)}}}}}}});
            else
                addMesh(scene_.meshes[i], objectLabel("mesh", i));
        }
        for (std::size_t i = 0; i < nodes_.size(); ++i)
            add("nodes", scene_.registry.alive(nodes_[i]) ? nodeJson(nodes_[i], i) : json::object());
        json scene = json::object();
        if (!scene_.name.empty()) scene["name"] = scene_.name;
        for (const Entity root : scene_.roots) scene["nodes"].push_back(indices_.at(root.index));
        if (!scene_.extras->is_null()) scene["extras"] = *scene_.extras;
        add("scenes", std::move(scene));
        document_["scene"] = 0;
    }

    json nodeJson(Entity node, std::size_t index) {
        const Registry& registry = scene_.registry;
        json item = json::object();
        const Name* name = registry.find<Name>(node);
        const std::string label = objectLabel("node", index, name ? name->value : "");
        if (name && !name->value.empty()) item["name"] = name->value;
        if (const LocalTransform* local = registry.find<LocalTransform>(node))
            writeTransform(item, *local, node, label);
        if (const MeshInstance* mesh = registry.find<MeshInstance>(node); mesh && !mesh->primitives.empty())
            item["mesh"] = meshOf(*mesh, label);
        if (const Hierarchy* hierarchy = registry.find<Hierarchy>(node))
            for (const Entity child : hierarchy->children) item["children"].push_back(indices_.at(child.index));
        if (const NodeMarking* marking = registry.find<NodeMarking>(node)) {
            if (!marking->extras->is_null()) item["extras"] = *marking->extras;
            if (!marking->extensions->is_null()) item["extensions"] = *marking->extensions;
            noteExtensions(*marking->extensions);
        }
        return item;
    }

    void writeTransform(json& item, const LocalTransform& local, Entity node, const std::string& label) const {
        const glm::dmat4 matrix = localMatrix(local);
        for (int k = 0; k < 16; ++k)
            if (!std::isfinite(matrix[k / 4][k % 4])) fail(label, "has a non-finite transform; correct it");
        if (local.shear != glm::dmat3(1)) {
            for (const Animation& animation : scene_.animations)
                if (animates(animation, node))
                    fail(label, "is animated and sheared, which glTF does not support; remove the shear");
        }
        item.update(placeFields(local));
    }

    void writeAnimations() {
        for (std::size_t i = 0; i < scene_.animations.size(); ++i) {
            const Animation& animation = scene_.animations[i];
            json item;
            if (!animation.name.empty()) item["name"] = animation.name;
            for (const AnimationChannel& channel : animation.channels) {
                if (!scene_.registry.alive(channel.target)) continue;
                const std::string label = objectLabel("animation", i, animation.name);
                item["samplers"].push_back(samplerJson(channel, label));
                item["channels"].push_back(
                    {{"sampler", item["samplers"].size() - 1},
                     {"target", {{"node", indices_.at(channel.target.index)}, {"path", pathName(channel.path)}}}});
            }
            if (!animation.extras->is_null()) item["extras"] = *animation.extras;
            if (item.contains("channels")) add("animations", std::move(item));
        }
    }

    static const char* pathName(AnimationPath path) {
        return path == AnimationPath::Translation ? "translation"
               : path == AnimationPath::Rotation  ? "rotation"
                                                  : "scale";
    }

    json samplerJson(const AnimationChannel& channel, const std::string& label) {
        const bool isCubic = channel.interpolation == Interpolation::CubicSpline;
        const bool isRotation = channel.path == AnimationPath::Rotation;
        if (channel.times.size() < (isCubic ? 2u : 1u) ||
            channel.values.size() != channel.times.size() * (isCubic ? 3 : 1))
            fail(label, "has a channel whose values do not match its keys; complete it");
        std::vector<float> times(channel.times.size()), values;
        for (std::size_t i = 0; i < times.size(); ++i) {
            times[i] = static_cast<float>(channel.times[i]);
            if (!std::isfinite(times[i]) || times[i] < 0 || (i > 0 && !(times[i] > times[i - 1])))
                fail(label,
                     "has keys whose times are not increasing from 0 in single precision; increase their spacing");
        }
        for (std::size_t i = 0; i < channel.values.size(); ++i) {
            glm::dvec4 value = channel.values[i];
            // Rotations must be unit quaternions, but the tangents of a spline are not rotations.
            if (isRotation && (!isCubic || i % 3 == 1)) value = glm::normalize(value);
            for (int k = 0; k < (isRotation ? 4 : 3); ++k) {
                values.push_back(static_cast<float>(value[k]));
                if (!std::isfinite(values.back()))
                    fail(label, "has a non-finite value or a rotation of length zero; correct it");
            }
        }
        // Channels that share their times share the accessor.
        auto found = timeAccessors_.find(times);
        if (found == timeAccessors_.end())
            found = timeAccessors_.emplace(times, addFloats(times, 1, kNone, true)).first;
        const char* interpolation = isCubic                                        ? "CUBICSPLINE"
                                    : channel.interpolation == Interpolation::Step ? "STEP"
                                                                                   : "LINEAR";
        return {{"input", found->second},
                {"output", addFloats(values, isRotation ? 4 : 3, kNone, false)},
                {"interpolation", interpolation}};
    }

    void noteExtensions(const json& extensions) {
        for (const auto& [name, value] : extensions.items()) extensionsUsed_.insert(name);
    }

    void writeExtensions() {
        if (!scene_.extensions->is_null()) document_["extensions"] = *scene_.extensions;
        noteExtensions(*scene_.extensions);
        for (const std::string& name : extensionsUsed_) document_["extensionsUsed"].push_back(name);
        for (const std::string& name : scene_.extensionsRequired)
            if (extensionsUsed_.contains(name)) document_["extensionsRequired"].push_back(name);
    }

    const Scene& scene_;
    const std::filesystem::path& file_;
    json document_;
    Bytes bin_;
    std::vector<Entity> nodes_;
    std::map<std::uint32_t, std::size_t> indices_;  // by entity index
    std::map<const MeshData*, json> geometries_;
    std::map<std::vector<std::pair<const MeshData*, int>>, std::size_t> meshes_;
    std::map<std::vector<float>, std::size_t> timeAccessors_;
    std::set<std::string> extensionsUsed_;
};

}  // namespace

Bytes pngBytes(const Image& image) {
    Bytes png;
    const auto append = [](void* context, void* data, int size) {
        const auto* bytes = static_cast<const std::uint8_t*>(data);
        static_cast<Bytes*>(context)->insert(static_cast<Bytes*>(context)->end(), bytes, bytes + size);
    };
    if (!stbi_write_png_to_func(append, &png, image.width, image.height, 4, image.rgba.data(), image.width * 4))
        return {};
    return png;
}

json placeFields(const LocalTransform& local) {
    json fields = json::object();
    if (local.shear != glm::dmat3(1)) {
        const glm::dmat4 matrix = localMatrix(local);
        for (int k = 0; k < 16; ++k) fields["matrix"].push_back(matrix[k / 4][k % 4]);
        return fields;
    }
    const glm::dvec3 &t = local.translation, &s = local.scale;
    const glm::dquat r = glm::normalize(local.rotation);
    if (t != glm::dvec3(0)) fields["translation"] = {t.x, t.y, t.z};
    if (r != glm::dquat(1, 0, 0, 0)) fields["rotation"] = {r.x, r.y, r.z, r.w};
    if (s != glm::dvec3(1)) fields["scale"] = {s.x, s.y, s.z};
    return fields;
}

void writeGltf(const Scene& scene, const std::filesystem::path& file) {
    if (scene.roots.empty()) failIn(file, "", "cannot be written: the scene has no nodes; add one");
    SceneWriter(scene, file).write();
}

}  // namespace touchstone::engine
