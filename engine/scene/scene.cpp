#include "engine/scene/scene.hpp"

#include <algorithm>
#include <cassert>
#include <nlohmann/json.hpp>

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
        scene.registry.add(node, NodeMarking{std::move(extras), {}});
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
        for (auto node = nodes.rbegin(); node != nodes.rend(); ++node)
            open.push_back({*node, below});  // the first node ends on top of the stack
    };
    visitLater(part.roots, root);
    while (!open.empty()) {
        const Visit visit = open.back();
        open.pop_back();
        const Registry& from = part.registry;
        if (const Visibility* shown = from.find<Visibility>(visit.from); shown && !shown->visible) continue;
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

namespace {

/// Length in bytes and code point of the UTF-8 character at `at`; length 0 if the bytes are invalid.
std::pair<std::size_t, std::uint32_t> characterAt(const std::string& text, std::size_t at) {
    const auto byte = [&](std::size_t i) {
        return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0u;
    };
    const std::uint32_t first = byte(0);
    if (first < 0x80) return {1, first};
    const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
    if (first < 0xC2 || first > 0xF4) return {0, 0};
    std::uint32_t code = first & (0x7Fu >> length);
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(i) & 0xC0) != 0x80) return {0, 0};
        code = code << 6 | (byte(i) & 0x3F);
    }
    return {length, code};
}

std::string escapeOf(std::uint32_t code) {
    constexpr char kDigits[] = "0123456789abcdef";
    if (code == '\n') return "\\n";
    if (code == '\t') return "\\t";
    if (code == '\r') return "\\r";
    std::string digits;
    for (int shift = code > 0xFF ? 12 : 4; shift >= 0; shift -= 4) digits += kDigits[code >> shift & 15];
    return (code > 0xFF ? "\\u" : "\\x") + digits;
}

}  // namespace

std::string escaped(const std::string& text) {
    std::string shown;
    for (std::size_t at = 0; at < text.size();) {
        const auto [length, code] = characterAt(text, at);
        const bool isControl = code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029;
        const bool isBidiControl = (code >= 0x200E && code <= 0x200F) || (code >= 0x202A && code <= 0x202E) ||
                                   (code >= 0x2066 && code <= 0x2069);
        if (length == 0)
            shown += escapeOf(static_cast<unsigned char>(text[at]));
        else if (isControl || isBidiControl)
            shown += escapeOf(code);
        else
            shown.append(text, at, length);
        at += std::max<std::size_t>(length, 1);
    }
    return shown;
}

std::string printable(const std::string& text) {
    constexpr std::size_t kLongest = 60;
    std::size_t end = std::min(text.size(), kLongest);
    while (end > 0 && end < text.size() && (text[end] & 0xC0) == 0x80) --end;  // do not split a UTF-8 character
    return escaped(text.substr(0, end)) + (end < text.size() ? "…" : "");
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
