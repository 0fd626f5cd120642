#include "haptics/hands/replay.hpp"

#include <stdexcept>

#include "haptics/hands/motion.hpp"

namespace touchstone {

std::unique_ptr<Device> makeReplay(const DeviceContext& context) {
    if (context.file.empty())
        throw std::runtime_error(
            "replay needs a recording or a motion: write --device replay:FOLDER or replay:FILE.csv");
    return std::make_unique<MotionDevice>(std::make_shared<RecordedMotion>(readMotion(context.file)));
}

}  // namespace touchstone
