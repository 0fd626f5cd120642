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
