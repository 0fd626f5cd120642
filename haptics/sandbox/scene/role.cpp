#include "haptics/sandbox/scene/role.hpp"

#include <cmath>

#include "haptics/sandbox/scene/units.hpp"

namespace touchstone::sandbox {

engine::Entity roleOwner(const engine::Registry& registry, engine::Entity node) {
    while (node && !registry.has<Role>(node)) {
        const engine::Hierarchy* hierarchy = registry.find<engine::Hierarchy>(node);
        node = hierarchy ? hierarchy->parent : engine::Entity{};
    }
    return node;
}

std::array<std::array<double, 4>, 4> matrixInFile(const FileFrame& file, const Pose& X_WT) {
    const Pose motion = file.X_WF.inverse() * X_WT * file.X_TF;
    const Mat3 rotation = motion.R();
    // What rounding leaves of a zero: 1e-16 of a rotation, 1e-13 of lengths of a meter in mm.
    constexpr double kTiny = 1e-12;
    const auto clean = [](double value) { return std::abs(value) < kTiny ? 0.0 : value; };
    std::array<std::array<double, 4>, 4> rows{};
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) rows[std::size_t(i)][std::size_t(j)] = clean(rotation(i, j));
        rows[std::size_t(i)][3] = clean(motion.p[i] / (kMmPerMeter * file.unit));
    }
    rows[3][3] = 1;
    return rows;
}

}  // namespace touchstone::sandbox
