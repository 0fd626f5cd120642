#include "haptics/sandbox/scene/scene_unit.hpp"

#include <algorithm>
#include <cstdio>

#include "engine/scene/gltf_container.hpp"

namespace touchstone::sandbox {
namespace {

constexpr struct {
    double scale;
    const char* question;
} kUnits[] = {{0.001, "millimeters had been taken for meters"},
              {0.01, "centimeters had been taken for meters"},
              {0.0254, "inches had been taken for meters"},
              {25.4, "inches had been taken for millimeters"},
              {1000, "millimeters had been converted twice"}};

std::string sized(double mm) {
    char text[40];
    std::snprintf(text, sizeof text, mm < 1000 ? "%.3g mm" : "%.3g m", mm < 1000 ? mm : mm / 1000);
    return text;
}

}  // namespace

std::optional<UnitQuestion> unitQuestion(const std::vector<std::string>& labels, const std::vector<double>& sizes) {
    const auto likely = [&](double scale) {
        return std::all_of(sizes.begin(), sizes.end(),
                           [&](double size) { return size * scale >= kSmallestPart && size * scale <= kLargestPart; });
    };
    if (sizes.empty() || likely(1)) return {};
    const auto unit = std::find_if(std::begin(kUnits), std::end(kUnits), [&](auto& u) { return likely(u.scale); });
    if (unit == std::end(kUnits)) return {};
    // The part that shows it best.
    const auto most =
        unit->scale < 1 ? std::max_element(sizes.begin(), sizes.end()) : std::min_element(sizes.begin(), sizes.end());
    const std::string& label = labels[std::size_t(most - sizes.begin())];
    return UnitQuestion{unit->scale, label + " is " + sized(*most) + " across: should it be " +
                                         sized(*most * unit->scale) + ", as if " + unit->question + "?"};
}

std::vector<engine::SceneEdit> scaled(const engine::Scene& scene, double scale) {
    std::vector<engine::SceneEdit> edits;
    for (const engine::Entity root : scene.roots) {
        for (const engine::Animation& animation : scene.animations)
            if (engine::animates(animation, root))
                engine::failIn(scene.file, engine::nodeLabel(scene, root),
                               "it is animated, and its motion would not be scaled with it: scale the scene where it "
                               "was made");
        const auto from = scene.registry.get<engine::LocalTransform>(root);
        auto to = from;
        to.translation *= scale;
        to.scale *= scale;
        edits.push_back(engine::PlaceNode{engine::nodeIndex(scene, root), from, to});
    }
    return edits;
}

}  // namespace touchstone::sandbox
