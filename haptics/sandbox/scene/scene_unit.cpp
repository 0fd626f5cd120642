#include "haptics/sandbox/scene/scene_unit.hpp"

#include <algorithm>
#include <cstdio>

#include "engine/edit/scene_scale.hpp"
#include "engine/scene/gltf_container.hpp"
#include "engine/scene/text.hpp"

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

std::string scaleHint(const engine::Scene& scene, const UnitQuestion& question) {
    std::filesystem::path out = scene.file;
    out.replace_filename(scene.file.stem().string() + "-scaled" + scene.file.extension().string());
    try {
        engine::scaled(scene, question.scale, "touchstone");
    } catch (const engine::SceneError&) {
        return question.text + " Then scale it where it was made";
    }
    return engine::formatted("%s Then touchstone new --scene %s --scale %g -o %s writes it so, and the window asks",
                             question.text.c_str(), engine::shellQuoted(scene.file.string()).c_str(), question.scale,
                             engine::shellQuoted(out.string()).c_str());
}

}  // namespace touchstone::sandbox
