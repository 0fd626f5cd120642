#include "haptics/device/phantom.hpp"

#include "haptics/device/phantom_link.hpp"

namespace touchstone {

std::unique_ptr<Device> makePhantom(const DeviceContext& context) {
    return makeArm(PhantomLink::connect(context.file), context.X_WT_start);
}

DeviceCheck examinePhantom() { return PhantomLink::examine(); }

}  // namespace touchstone
