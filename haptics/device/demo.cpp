#include "haptics/device/demo.hpp"

#include <stdexcept>

#include "haptics/device/motion.hpp"

namespace touchstone {

std::unique_ptr<Device> makeDemo(const DeviceContext& context) {
    if (!context.demonstration)
        throw std::runtime_error(
            "this scene has no demonstration: animate its tool node, or choose --device mouse or replay:FILE");
    return std::make_unique<MotionDevice>(context.demonstration);
}

}  // namespace touchstone
