#include "haptics/sandbox/scene/role.hpp"

namespace touchstone::sandbox {

engine::Entity roleOwner(const engine::Registry& registry, engine::Entity node) {
    while (node && !registry.has<Role>(node)) {
        const engine::Hierarchy* hierarchy = registry.find<engine::Hierarchy>(node);
        node = hierarchy ? hierarchy->parent : engine::Entity{};
    }
    return node;
}

}  // namespace touchstone::sandbox
