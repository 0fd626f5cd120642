#include "engine/scene/gltf_read.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <set>

#include "engine/scene/gltf_accessor.hpp"
#include "engine/scene/gltf_container.hpp"
#include "engine/scene/gltf_instances.hpp"
#include "engine/scene/gltf_load.hpp"
#include "engine/scene/transforms.hpp"

namespace touchstone::engine {
namespace {

using nlohmann::json;

/// Element of an array by an index that glTF stores as int.
template <class T>
const T& at(const std::vector<T>& items, int index) {
    return items[static_cast<std::size_t>(index)];
}

bool contains(const json& names, std::string_view name) {
    return std::any_of(names.begin(), names.end(), [&](const json& item) { return item == name; });
}

/// Triangles of the index list of a primitive (glTF 2.0, section 3.7.2.1). Triangles without three distinct corners,
/// which are common in strips, are dropped.
std::vector<std::uint32_t> triangles(int mode, const std::vector<std::uint32_t>& list) {
    std::vector<std::uint32_t> out;
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != b && b != c && c != a) out.insert(out.end(), {a, b, c});
    };
    const std::size_t count = list.size();
    if (mode == TINYGLTF_MODE_TRIANGLES)
        for (std::size_t i = 0; i + 2 < count; i += 3) add(list[i], list[i + 1], list[i + 2]);
    else if (mode == TINYGLTF_MODE_TRIANGLE_STRIP)
        for (std::size_t i = 0; i + 2 < count; ++i) add(list[i], list[i + 1 + i % 2], list[i + 2 - i % 2]);
    else
        for (std::size_t i = 0; i + 2 < count; ++i) add(list[i + 1], list[i + 2], list[0]);
    return out;
}

class SceneReader {
  public:
    SceneReader(const std::filesystem::path& file, int sceneIndex)
        : file_(file),
          gltf_(loadGltf(file, sceneIndex, warnings_)),
          model_(gltf_.model),
          accessors_(file_, model_,
                     contains(gltf_.document.value("extensionsUsed", json::array()), "KHR_mesh_quantization")) {
        scene_.file = file;
        scene_.index = static_cast<int>(gltf_.scene);
    }

    Scene read() {
        checkSize();
        findParents();
        readMaterials();
        readMeshes();
        readNodes();
        readAnimations();
        readMarkings();
        updateWorldTransforms(scene_);
        checkWorld();
        scene_.warnings = warnings_.sentences();
        return std::move(scene_);
    }

  private:
    [[noreturn]] void fail(const std::string& object, const std::string& problem) const {
        failIn(file_, object, problem);
    }
    void warn(const std::string& object, const std::string& what) { warnings_.add(object, what); }

    std::string label(const char* kind, int index, const std::string& name) const {
        return objectLabel(kind, static_cast<std::size_t>(index), name);
    }
    std::string nodeName(int node) const { return label("node", node, at(model_.nodes, node).name); }

    /// A property of an object in the file that the model does not hold; null if it is absent.
    const json* raw(const char* array, int index, std::initializer_list<const char*> path) const {
        const json* at = &gltf_.document[array][static_cast<std::size_t>(index)];
        for (const char* key : path) {
            if (!at->is_object() || !at->contains(key)) return nullptr;
            at = &(*at)[key];
        }
        return at;
    }
    const json* instancing(int node) const {
        return raw("nodes", node, {"extensions", "EXT_mesh_gpu_instancing", "attributes"});
    }

    /// Bounds the size of the scene before anything is read, since a small file may use one large accessor many times.
    void checkSize() const {
        constexpr std::size_t kMaxElements = std::size_t{1} << 26;
        std::size_t total = 0;
        const auto add = [&](int accessor, const std::string& user, std::size_t times = 1) {
            total += accessor < 0 ? 0 : accessors_.count(accessor) * times;
            if (total > kMaxElements)
                fail(user, "brings the scene above 67 million vertices, corners and keys; simplify it");
        };
        const auto addMesh = [&](int mesh, const std::string& user, std::size_t times) {
            for (const tinygltf::Primitive& primitive : at(model_.meshes, mesh).primitives) {
                const auto position = primitive.attributes.find("POSITION");
                if (position != primitive.attributes.end()) add(position->second, user, times);
                add(primitive.indices, user, times);
            }
        };
        for (int i = 0; i < static_cast<int>(model_.meshes.size()); ++i)
            addMesh(i, label("mesh", i, at(model_.meshes, i).name), 1);
        for (int i = 0; i < static_cast<int>(model_.nodes.size()); ++i)
            if (const int mesh = at(model_.nodes, i).mesh;
                gltf_.uses("nodes", static_cast<std::size_t>(i)) && mesh >= 0)
                if (const json* attributes = instancing(i))
                    addMesh(mesh, nodeName(i), instanceCount(*attributes, accessors_));
        for (int i = 0; i < static_cast<int>(model_.animations.size()); ++i)
            for (const tinygltf::AnimationChannel& channel : at(model_.animations, i).channels) {
                const auto& samplers = at(model_.animations, i).samplers;
                const std::string user = label("animation", i, at(model_.animations, i).name);
                if (channel.sampler >= static_cast<int>(samplers.size()))
                    fail(user, "refers to sampler " + std::to_string(channel.sampler) + " of " +
                                   std::to_string(samplers.size()) + "; export the animation again");
                add(at(samplers, channel.sampler).input, user);
                add(at(samplers, channel.sampler).output, user);
            }
    }

    void findParents() {
        parents_.assign(model_.nodes.size(), -1);
        for (int node = 0; node < static_cast<int>(model_.nodes.size()); ++node)
            for (const int child : at(model_.nodes, node).children) parents_[static_cast<std::size_t>(child)] = node;
    }

    /// The texture coordinate set of a material: that of its first texture.
    static int texcoordSet(const tinygltf::Material& material) {
        const auto& pbr = material.pbrMetallicRoughness;
        for (const auto& [texture, set] : {std::pair{pbr.baseColorTexture.index, pbr.baseColorTexture.texCoord},
                                           {pbr.metallicRoughnessTexture.index, pbr.metallicRoughnessTexture.texCoord},
                                           {material.normalTexture.index, material.normalTexture.texCoord},
                                           {material.emissiveTexture.index, material.emissiveTexture.texCoord}})
            if (texture >= 0) return set;
        return 0;
    }

    void readMaterials() {
        std::vector<int> imageIndex(model_.images.size(), -1);
        const auto imageOf = [&](const auto& texture, int set) {
            if (texture.index < 0) return -1;
            const std::string name = label("texture", texture.index, at(model_.textures, texture.index).name);
            const int source = at(model_.textures, texture.index).source;
            if (source < 0) warn(name, "has no PNG or JPEG image and is ignored");
            if (source >= 0 && texture.texCoord != set)
                warn(name, "uses another set of coordinates than its material's first texture and is ignored");
            if (source < 0 || texture.texCoord != set) return -1;
            int& index = imageIndex[static_cast<std::size_t>(source)];
            if (index < 0) index = addImage(scene_, rgba8(at(model_.images, source)));
            return index;
        };
        for (const tinygltf::Material& from : model_.materials) {
            const auto& pbr = from.pbrMetallicRoughness;
            Material material;
            material.name = from.name;
            for (int k = 0; k < 4; ++k)
                material.baseColor[k] =
                    static_cast<float>(std::clamp(pbr.baseColorFactor[static_cast<std::size_t>(k)], 0.0, 1.0));
            material.metallic = static_cast<float>(std::clamp(pbr.metallicFactor, 0.0, 1.0));
            material.roughness = static_cast<float>(std::clamp(pbr.roughnessFactor, 0.0, 1.0));
            for (int k = 0; k < 3; ++k)
                material.emissive[k] =
                    static_cast<float>(std::max(from.emissiveFactor[static_cast<std::size_t>(k)], 0.0));
            material.normalScale = static_cast<float>(from.normalTexture.scale);
            material.alphaMode = from.alphaMode == "BLEND"  ? AlphaMode::Blend
                                 : from.alphaMode == "MASK" ? AlphaMode::Mask
                                                            : AlphaMode::Opaque;
            material.alphaCutoff = static_cast<float>(std::max(from.alphaCutoff, 0.0));
            const int set = texcoordSet(from);
            material.texture = imageOf(pbr.baseColorTexture, set);
            material.metallicRoughnessTexture = imageOf(pbr.metallicRoughnessTexture, set);
            material.normalTexture = imageOf(from.normalTexture, set);
            material.emissiveTexture = imageOf(from.emissiveTexture, set);
            addMaterial(scene_, std::move(material));
        }
    }

    static Image rgba8(const tinygltf::Image& from) {
        Image image{from.width, from.height, {}};
        if (from.bits != 16) {
            image.rgba = from.image;
        } else {  // keep the high bytes of little-endian words
            image.rgba.resize(from.image.size() / 2);
            for (std::size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = from.image[2 * i + 1];
        }
        return image;
    }

    void readMeshes() {
        for (int i = 0; i < static_cast<int>(model_.meshes.size()); ++i) {
            const tinygltf::Mesh& mesh = at(model_.meshes, i);
            MeshInstance& instance = scene_.meshes.emplace_back();
            for (std::size_t k = 0; k < mesh.primitives.size(); ++k) {
                const std::string name = label("mesh", i, mesh.name) + ", primitive " + std::to_string(k);
                const json& primitive = gltf_.document["meshes"][static_cast<std::size_t>(i)]["primitives"][k];
                if (auto data = readPrimitive(mesh.primitives[k], primitive, name); data && !data->indices.empty())
                    instance.primitives.push_back({std::move(data), mesh.primitives[k].material});
            }
            if (gltf_.uses("meshes", static_cast<std::size_t>(i))) warnOfMorphs(i);
        }
    }

    static bool hasNonZero(const json* weights) {
        return weights && weights->is_array() && std::any_of(weights->begin(), weights->end(), [](const json& weight) {
                   return weight.is_number() && weight.get<double>() != 0;
               });
    }

    void warnOfMorphs(int mesh) {
        const json& primitives = *raw("meshes", mesh, {"primitives"});
        if (std::none_of(primitives.begin(), primitives.end(), [](const json& p) { return p.contains("targets"); }))
            return;
        warn(
            label("mesh", mesh, at(model_.meshes, mesh).name),
            hasNonZero(raw("meshes", mesh, {"weights"}))
                ? "morph targets are ignored although their weights are not zero: the mesh keeps its shape without them"
                : "morph targets are ignored");
    }

    /// Returns null, with a warning, for primitives that are not surfaces. Primitives with the same accessors share a
    /// mesh.
    std::shared_ptr<const MeshData> readPrimitive(const tinygltf::Primitive& primitive, const json& raw,
                                                  const std::string& name) {
        constexpr std::array<const char*, 4> kSkipped = {"points", "lines", "a line loop", "a line strip"};
        if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
            warn(name, std::string("is ") + kSkipped[static_cast<std::size_t>(primitive.mode)] +
                           ", not triangles, and is ignored");
            return nullptr;
        }
        const auto attribute = [&](const std::string& key) {
            const auto found = primitive.attributes.find(key);
            return found == primitive.attributes.end() ? -1 : found->second;
        };
        const int position = attribute("POSITION"), normal = attribute("NORMAL");
        if (position < 0) {
            warn(name, "has no POSITION and is ignored");
            return nullptr;
        }
        const int set = primitive.material < 0 ? 0 : texcoordSet(at(model_.materials, primitive.material));
        const std::string texcoordKey = "TEXCOORD_" + std::to_string(set);
        const int texcoord = attribute(texcoordKey);
        const int color = attribute("COLOR_0");
        auto& shared = geometries_[{position, normal, texcoord, color, primitive.indices, primitive.mode}];
        if (shared) return shared;

        const auto checkCount = [&](int accessor, const std::string& key) {
            if (accessors_.count(accessor) != accessors_.count(position))
                fail(name, key + " has " + std::to_string(accessors_.count(accessor)) + " elements but POSITION has " +
                               std::to_string(accessors_.count(position)) + "; export the file again");
        };
        if (accessors_.hasNoData(position)) {
            if (raw.contains("extensions") && raw["extensions"].contains("KHR_draco_mesh_compression"))
                fail(name, "has its vertices in KHR_draco_mesh_compression, which is not supported; export without it");
            warn(name, "its POSITION has no data, so all vertices are at the origin");
        }
        MeshData mesh;
        mesh.positions = accessors_.read<glm::vec3>(position, AccessorUse::Position, name + ", POSITION");
        mesh.indices = readIndices(primitive, mesh.positions.size(), name);
        if (normal >= 0) {
            checkCount(normal, "NORMAL");
            mesh.normals = accessors_.read<glm::vec3>(normal, AccessorUse::Normal, name + ", NORMAL");
        }
        mesh.flat = normal < 0;
        completeNormals(mesh);
        if (color >= 0) readColors(mesh, color, name);
        if (texcoord >= 0) {
            checkCount(texcoord, texcoordKey);
            mesh.texcoords = accessors_.read<glm::vec2>(texcoord, AccessorUse::Texcoord, name + ", " + texcoordKey);
        }
        return shared = std::make_shared<const MeshData>(std::move(mesh));
    }

    /// Colors that do not follow the specification are left out with a warning: nothing is felt of them.
    void readColors(MeshData& mesh, int color, const std::string& name) {
        if (accessors_.count(color) != mesh.positions.size()) {
            warn(name, "COLOR_0 has " + std::to_string(accessors_.count(color)) + " elements but POSITION has " +
                           std::to_string(mesh.positions.size()) + "; it is ignored");
        } else if (accessors_.fits(color, AccessorUse::Color4)) {
            mesh.colors = accessors_.read<glm::vec4>(color, AccessorUse::Color4, name + ", COLOR_0");
        } else if (accessors_.fits(color, AccessorUse::Color3)) {
            for (const glm::vec3& rgb : accessors_.read<glm::vec3>(color, AccessorUse::Color3, name + ", COLOR_0"))
                mesh.colors.emplace_back(rgb, 1);
        } else {
            warn(name, "COLOR_0 is neither VEC3 nor VEC4 of floats or normalized integers; it is ignored");
        }
        for (glm::vec4& c : mesh.colors) c = glm::clamp(c, 0.f, 1.f);
    }

    std::vector<std::uint32_t> readIndices(const tinygltf::Primitive& primitive, std::size_t vertices,
                                           const std::string& name) {
        std::vector<std::uint32_t> list(primitive.indices < 0 ? vertices : 0);
        if (primitive.indices < 0)
            std::iota(list.begin(), list.end(), 0u);
        else
            list = accessors_.read<std::uint32_t>(primitive.indices, AccessorUse::Index, name + ", indices");
        for (std::size_t i = 0; i < list.size(); ++i)
            if (list[i] >= vertices)
                fail(name, "index " + std::to_string(i) + " is " + std::to_string(list[i]) + " but there are only " +
                               std::to_string(vertices) + " vertices; export the mesh again");
        if (primitive.mode == TINYGLTF_MODE_TRIANGLES && list.size() % 3 != 0)
            fail(name, "has " + std::to_string(list.size()) +
                           " corners, which is not a multiple of 3; export the mesh again");
        return triangles(primitive.mode, list);
    }

    /// Normalizes all normals; missing and zero normals are computed.
    static void completeNormals(MeshData& mesh) {
        const bool given = !mesh.normals.empty();
        const bool isWhole = given && std::all_of(mesh.normals.begin(), mesh.normals.end(),
                                                  [](const glm::vec3& n) { return glm::length(glm::dvec3(n)) > 0; });
        std::vector<glm::vec3> computed = isWhole ? std::vector<glm::vec3>() : smoothNormals(mesh);
        if (!given) {
            mesh.normals = std::move(computed);
            return;
        }
        for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
            const double length = glm::length(glm::dvec3(mesh.normals[i]));
            mesh.normals[i] = length > 0 ? glm::vec3(glm::dvec3(mesh.normals[i]) / length) : computed[i];
        }
    }

    LocalTransform readTransform(int index) {
        const tinygltf::Node& node = at(model_.nodes, index);
        if (!node.matrix.empty()) {
            const json& raw = gltf_.document["nodes"][static_cast<std::size_t>(index)];
            if (raw.contains("translation") || raw.contains("rotation") || raw.contains("scale"))
                fail(nodeName(index), "has a matrix as well as translation, rotation or scale; keep one of the two");
            glm::dmat4 matrix;
            for (int k = 0; k < 16; ++k) matrix[k / 4][k % 4] = at(node.matrix, k);
            if (matrix[0][3] != 0 || matrix[1][3] != 0 || matrix[2][3] != 0 || matrix[3][3] != 1)
                fail(nodeName(index), "has a matrix whose last row is not 0 0 0 1; replace it by an affine one");
            return localTransform(matrix);
        }
        LocalTransform local;
        for (int k = 0; k < 3; ++k) {
            if (!node.translation.empty()) local.translation[k] = at(node.translation, k);
            if (!node.scale.empty()) local.scale[k] = at(node.scale, k);
        }
        if (!node.rotation.empty()) {
            const glm::dquat rotation(at(node.rotation, 3), at(node.rotation, 0), at(node.rotation, 1),
                                      at(node.rotation, 2));
            if (!(glm::length(rotation) > 1e-6))
                fail(nodeName(index), "has a rotation of length zero; give it a unit quaternion");
            if (!isUnit(rotation)) warn(nodeName(index), "its rotation is not of unit length and was normalized");
            local.rotation = glm::normalize(rotation);
        }
        return local;
    }

    /// Creates the entities of the chosen scene in file order, so that a walk over the registry sees that order.
    void readNodes() {
        const tinygltf::Scene& from = at(model_.scenes, scene_.index);
        const std::string sceneName = label("scene", scene_.index, from.name);
        if (from.nodes.empty()) fail(sceneName, "lists no nodes; add the root nodes to it");
        std::vector<int> active;
        for (int node = 0; node < static_cast<int>(model_.nodes.size()); ++node)
            if (gltf_.uses("nodes", static_cast<std::size_t>(node))) active.push_back(node);

        std::vector<Entity> entities(model_.nodes.size());
        for (const int node : active)
            entities[static_cast<std::size_t>(node)] =
                addNode(scene_, at(model_.nodes, node).name, {}, readTransform(node));
        scene_.name = from.name;
        scene_.nodes = entities;
        scene_.roots.clear();
        for (const int root : from.nodes) scene_.roots.push_back(at(entities, root));
        for (const int node : active) {
            Hierarchy& hierarchy = scene_.registry.get<Hierarchy>(at(entities, node));
            if (at(parents_, node) >= 0) hierarchy.parent = at(entities, at(parents_, node));
            for (const int child : at(model_.nodes, node).children) hierarchy.children.push_back(at(entities, child));
            const int mesh = at(model_.nodes, node).mesh;
            if (const json* visible = raw("nodes", node, {"extensions", "KHR_node_visibility", "visible"});
                visible && !visible->get<bool>()) {
                scene_.registry.get<Visibility>(at(entities, node)).visible = false;
                warn(nodeName(node),
                     "is hidden by KHR_node_visibility: it is not drawn, but it collides if it has a role");
            }
            if (mesh < 0 || at(scene_.meshes, mesh).primitives.empty()) continue;
            if (raw("nodes", node, {"skin"}))
                warn(nodeName(node), "its skin is ignored: the mesh keeps its bind pose and is placed by this node");
            if (hasNonZero(raw("nodes", node, {"weights"})))
                warn(nodeName(node), "morph targets are ignored although its weights are not zero");
            const json* attributes = instancing(node);
            scene_.registry.add(at(entities, node), attributes ? instancedMesh(at(scene_.meshes, mesh),
                                                                               readInstances(*attributes, accessors_,
                                                                                             nodeName(node), warnings_))
                                                               : MeshInstance(at(scene_.meshes, mesh)));
        }
    }

    void readAnimations() {
        for (int i = 0; i < static_cast<int>(model_.animations.size()); ++i) {
            const tinygltf::Animation& from = at(model_.animations, i);
            const std::string name = label("animation", i, from.name);
            Animation& animation = scene_.animations.emplace_back();
            animation.name = from.name;
            std::set<std::pair<int, AnimationPath>> animated;
            for (const tinygltf::AnimationChannel& channel : from.channels) {
                if (!at(scene_.nodes, channel.target_node)) continue;  // of another scene
                const std::string channelName =
                    name + ", " + channel.target_path + " of " + nodeName(channel.target_node);
                auto read = readChannel(channel, at(from.samplers, channel.sampler), channelName);
                if (!read) continue;
                if (!animated.emplace(channel.target_node, read->path).second)
                    fail(channelName, "is animated twice; keep one channel");
                animation.channels.push_back(std::move(*read));
            }
        }
    }

    std::optional<AnimationChannel> readChannel(const tinygltf::AnimationChannel& from,
                                                const tinygltf::AnimationSampler& sampler, const std::string& name) {
        AnimationChannel channel;
        channel.target = at(scene_.nodes, from.target_node);
        AccessorUse use = AccessorUse::Vector;
        if (from.target_path == "translation") {
            channel.path = AnimationPath::Translation;
        } else if (from.target_path == "scale") {
            channel.path = AnimationPath::Scale;
        } else if (from.target_path == "rotation") {
            channel.path = AnimationPath::Rotation;
            use = AccessorUse::Rotation;
        } else {
            warn(name, "cannot be animated and is ignored");
            return std::nullopt;
        }
        if (!at(model_.nodes, from.target_node).matrix.empty())
            fail(name, "moves a node that has a matrix; give the node translation, rotation and scale");
        channel.interpolation = sampler.interpolation == "STEP"          ? Interpolation::Step
                                : sampler.interpolation == "CUBICSPLINE" ? Interpolation::CubicSpline
                                                                         : Interpolation::Linear;
        channel.times = accessors_.read<double>(sampler.input, AccessorUse::Time, name + ", times");
        if (use == AccessorUse::Rotation)
            channel.values = accessors_.read<glm::dvec4>(sampler.output, use, name);
        else
            for (const glm::dvec3& value : accessors_.read<glm::dvec3>(sampler.output, use, name))
                channel.values.emplace_back(value, 0);
        checkChannel(channel, name);
        return channel;
    }

    void checkChannel(const AnimationChannel& channel, const std::string& name) {
        const bool isCubic = channel.interpolation == Interpolation::CubicSpline;
        if (channel.times.front() < 0) fail(name, "starts before time 0; shift its keys");
        for (std::size_t i = 1; i < channel.times.size(); ++i)
            if (!(channel.times[i] > channel.times[i - 1]))
                fail(name, "key " + std::to_string(i) + " is not later than the key before it; sort the keys by time");
        if (const std::size_t needed = channel.times.size() * (isCubic ? 3 : 1); channel.values.size() != needed)
            fail(name, "has " + std::to_string(channel.values.size()) + " values but its " +
                           std::to_string(channel.times.size()) + " keys need " + std::to_string(needed) +
                           "; export the animation again");
        if (isCubic && channel.times.size() < 2) fail(name, "is a cubic spline with only one key; add a second key");
        if (channel.path != AnimationPath::Rotation) return;
        bool areUnit = true;
        for (std::size_t i = 0; i < channel.times.size(); ++i) {
            const glm::dvec4& value = channel.values[isCubic ? 3 * i + 1 : i];
            if (!(glm::length(value) > 1e-6))
                fail(name, "key " + std::to_string(i) + " is a rotation of length zero; give it a unit quaternion");
            areUnit &= isUnit(value);
        }
        if (!areUnit) warn(name, "has rotations that are not of unit length; they were normalized");
    }

    /// Reads extras and extensions, which were not passed to tinygltf.
    void readMarkings() {
        const json& document = gltf_.document;
        const auto extensionsOf = [&](const json& object, const std::string& name) {
            json extensions = object.value("extensions", json());
            if (!extensions.is_null() && !extensions.is_object())
                fail(name, "\"extensions\" must be an object; correct it or export the file again");
            return extensions;
        };
        scene_.extensions = extensionsOf(document, "");
        scene_.extras = document["scenes"][static_cast<std::size_t>(scene_.index)].value("extras", json());
        for (std::size_t i = 0; i < scene_.animations.size(); ++i)
            if (gltf_.uses("animations", i))
                scene_.animations[i].extras = document["animations"][i].value("extras", json());
        scene_.extensionsRequired = document.value("extensionsRequired", std::vector<std::string>());
        for (std::size_t i = 0; i < scene_.nodes.size(); ++i) {
            if (!scene_.nodes[i]) continue;
            const json& node = document["nodes"][i];
            NodeMarking marking{node.value("extras", json()), extensionsOf(node, nodeName(static_cast<int>(i)))};
            // The instances are part of the mesh now, and accessors get other indices when the scene is written.
            if (marking.extensions->is_object() && marking.extensions->erase("EXT_mesh_gpu_instancing") > 0 &&
                marking.extensions->empty())
                *marking.extensions = nullptr;
            if (!marking.extras->is_null() || !marking.extensions->is_null())
                scene_.registry.add(scene_.nodes[i], std::move(marking));
        }
    }

    /// A scene must have triangles: on its nodes, or anywhere in the file if physics extensions refer to meshes.
    void checkWorld() {
        std::size_t found = 0;
        bool hasPhysics = false;
        const auto add = [&](const MeshInstance& mesh) {
            for (const Primitive& primitive : mesh.primitives) found += primitive.mesh->indices.size() / 3;
        };
        for (std::size_t i = 0; i < scene_.nodes.size(); ++i) {
            if (!scene_.nodes[i]) continue;
            const glm::dmat4& world = scene_.registry.get<WorldTransform>(scene_.nodes[i]).matrix;
            for (int k = 0; k < 16; ++k)
                if (!(std::abs(world[k / 4][k % 4]) <= 1e12))
                    fail(nodeName(static_cast<int>(i)),
                         "its transform in the world goes beyond 1e12; correct the scales of it and its parents");
            if (const auto* mesh = scene_.registry.find<MeshInstance>(scene_.nodes[i])) add(*mesh);
            const auto* marking = scene_.registry.find<NodeMarking>(scene_.nodes[i]);
            hasPhysics |= marking && marking->extensions->contains("KHR_physics_rigid_bodies");
        }
        if (hasPhysics)
            for (const MeshInstance& mesh : scene_.meshes) add(mesh);
        if (found == 0)
            fail(label("scene", scene_.index, scene_.name),
                 "has no triangles; add a triangle mesh to one of its nodes");
    }

    const std::filesystem::path file_;
    Warnings warnings_;
    const LoadedGltf gltf_;
    const tinygltf::Model& model_;
    AccessorReader accessors_;
    std::vector<int> parents_;                                                  // by node index, -1 for roots
    std::map<std::array<int, 6>, std::shared_ptr<const MeshData>> geometries_;  // by accessors and mode
    Scene scene_;
};

}  // namespace

Scene readGltf(const std::filesystem::path& file, int sceneIndex) { return SceneReader(file, sceneIndex).read(); }

}  // namespace touchstone::engine
