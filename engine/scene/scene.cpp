#include "engine/scene/scene.hpp"

#include <algorithm>
#include <cassert>

namespace touchstone::engine {

Entity addNode(Scene& scene, std::string name, Entity parent, const LocalTransform& local) {
    Registry& registry = scene.registry;
    assert(!parent || registry.alive(parent));
    const Entity node = registry.create();
    registry.add(node, Name{std::move(name)});
    registry.add(node, local);
    registry.add(node, Hierarchy{parent, {}});
    registry.add(node, WorldTransform{});
    registry.add(node, Visibility{});
    if (parent)
        registry.get<Hierarchy>(parent).children.push_back(node);
    else
        scene.roots.push_back(node);
    scene.nodes.push_back(node);
    return node;
}

void addMesh(Scene& scene, Entity node, std::shared_ptr<const MeshData> mesh, int material) {
    Registry& registry = scene.registry;
    MeshInstance* instance = registry.find<MeshInstance>(node);
    if (!instance) instance = &registry.add(node, MeshInstance{});
    instance->primitives.push_back({std::move(mesh), material});
}

int addMaterial(Scene& scene, Material material) {
    scene.materials.push_back(std::move(material));
    return static_cast<int>(scene.materials.size()) - 1;
}

int addImage(Scene& scene, Image image) {
    scene.images.push_back(std::move(image));
    return static_cast<int>(scene.images.size()) - 1;
}

void setExtras(Scene& scene, Entity node, nlohmann::json extras) {
    if (NodeMarking* marking = scene.registry.find<NodeMarking>(node))
        marking->extras = std::move(extras);
    else
        scene.registry.add(node, NodeMarking{std::move(extras), nullptr});
}

int nodeIndex(const Scene& scene, Entity node) {
    const auto found = node ? std::find(scene.nodes.begin(), scene.nodes.end(), node) : scene.nodes.end();
    return found == scene.nodes.end() ? -1 : static_cast<int>(found - scene.nodes.begin());
}

Entity appendScene(Scene& scene, const Scene& part, std::string name) {
    const int firstImage = static_cast<int>(scene.images.size()),
              firstMaterial = static_cast<int>(scene.materials.size());
    scene.images.insert(scene.images.end(), part.images.begin(), part.images.end());
    for (Material material : part.materials) {
        for (int* image : {&material.texture, &material.metallicRoughnessTexture, &material.normalTexture,
                           &material.emissiveTexture})
            if (*image >= 0) *image += firstImage;
        scene.materials.push_back(std::move(material));
    }
    struct Visit {
        Entity from, below;
    };
    const Entity root = addNode(scene, std::move(name));
    std::vector<Visit> open;
    const auto visitLater = [&](const std::vector<Entity>& nodes, Entity below) {
        for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) open.push_back({*node, below});  // first on top
    };
    visitLater(part.roots, root);
    while (!open.empty()) {
        const Visit visit = open.back();
        open.pop_back();
        const Registry& from = part.registry;
        const Entity node =
            addNode(scene, from.get<Name>(visit.from).value, visit.below, from.get<LocalTransform>(visit.from));
        if (const MeshInstance* instance = from.find<MeshInstance>(visit.from))
            for (const Primitive& primitive : instance->primitives)
                addMesh(scene, node, primitive.mesh, primitive.material < 0 ? -1 : firstMaterial + primitive.material);
        visitLater(from.get<Hierarchy>(visit.from).children, node);
    }
    return root;
}

bool isBelow(const Registry& registry, Entity node, Entity ancestor) {
    while (node && node != ancestor) node = registry.get<Hierarchy>(node).parent;
    return bool(node);
}

bool isVisible(const Registry& registry, Entity node) {
    for (; node; node = registry.get<Hierarchy>(node).parent)
        if (const Visibility* visibility = registry.find<Visibility>(node); visibility && !visibility->visible)
            return false;
    return true;
}

std::string printable(const std::string& text) {
    constexpr std::size_t kLongest = 60;
    std::size_t end = std::min(text.size(), kLongest);
    while (end > 0 && end < text.size() && (text[end] & 0xC0) == 0x80) --end;  // never inside a UTF-8 character
    std::string shown = text.substr(0, end);
    std::replace_if(
        shown.begin(), shown.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }, ' ');
    return end < text.size() ? shown + "…" : shown;
}

std::string objectLabel(const std::string& kind, std::size_t index, const std::string& name) {
    return kind + ' ' + std::to_string(index) + (name.empty() ? "" : " \"" + printable(name) + '"');
}

std::string nodeLabel(const Scene& scene, Entity node) {
    const Name* name = scene.registry.find<Name>(node);
    const int index = nodeIndex(scene, node);
    return objectLabel("node", index < 0 ? node.index : static_cast<std::size_t>(index), name ? name->value : "");
}

}  // namespace touchstone::engine
