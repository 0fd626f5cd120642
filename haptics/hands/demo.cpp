#include "haptics/hands/demo.hpp"

#include <stdexcept>

namespace touchstone {

std::shared_ptr<const Motion> chosenMotion(const DeviceContext& context, const std::string& name) {
    if (!context.demonstration)
        throw std::runtime_error(context.mouse ? "this scene has no demonstration: choose the device mouse, and record "
                                                 "a demonstration with it"
                                               : "this scene has no demonstration: choose the device rest, which holds "
                                                 "the tool at its start, or replay:FILE");
    if (name.empty()) return context.demonstration;
    std::string names;
    for (const NamedMotion& motion : context.motions) {
        if (motion.name == name) return motion.motion;
        names += (names.empty() ? "" : ", ") + motion.name;
    }
    throw std::runtime_error("this scene has no motion '" + name + "': choose one of " + names);
}

std::unique_ptr<Device> makeDemo(const DeviceContext& context) {
    return std::make_unique<MotionDevice>(chosenMotion(context, context.file));
}

std::unique_ptr<Device> makeRest(const DeviceContext& context) {
    return std::make_unique<MotionDevice>(
        std::make_shared<RecordedMotion>(std::vector<MotionKey>{{0, context.X_WT_start}}));
}

}  // namespace touchstone
