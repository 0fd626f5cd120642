#include "haptics/sandbox/devices/inverse3.hpp"

#include "haptics/sandbox/devices/inverse_link.hpp"

namespace touchstone::sandbox {

std::unique_ptr<Device> makeInverse3(const DeviceContext& context) {
    return makeArm(InverseLink::connect(context.file), context.X_WT_start);
}

DeviceCheck examineInverse3() { return InverseLink::examine(); }

}  // namespace touchstone::sandbox
