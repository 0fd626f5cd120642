#include "haptics/device/forcedimension.hpp"

#include <stdexcept>

#include "haptics/device/forcedimension_link.hpp"

namespace touchstone {

std::unique_ptr<Device> makeForceDimension(const DeviceContext& context) {
    std::shared_ptr<ForceDimensionLink> link = ForceDimensionLink::connect(context.file);
    if (!context.mouse && !link->ready()) throw std::runtime_error(link->howToInitialize());
    return makeArm(std::move(link), context.X_WT_start);
}

DeviceCheck examineForceDimension() { return ForceDimensionLink::examine(); }

}  // namespace touchstone
