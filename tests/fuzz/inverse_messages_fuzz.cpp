// Any bytes as a message of Haply's service: an inventory or a refusal, a state or a fault, an event or none.
#include <stdexcept>

#include "haptics/sandbox/devices/inverse_messages.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;
using namespace touchstone::sandbox;
using fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string message(reinterpret_cast<const char*>(data), size);
    std::string device = "049D", grip;
    try {
        const InverseInventory inventory = readInventory(message, "", "");
        device = inventory.device;
        require(!device.empty() && device.size() <= 64, "an identifier");
        require(inventory.state.p_DS.allFinite(), "a position");
        if (inventory.state.grip) grip = inventory.state.grip->id;
        require(ForceMessage(device, inventory.vectorCommand).text({1, 2, 3}).size() < 500,
                "a command that fits a frame");
    } catch (const std::runtime_error& error) {
        fuzz::requireSentence(error.what());
    }
    InverseState state;
    if (readState(message, device, grip, state) == InverseFault::None) {
        require(Pose{state.p_DS, Quat::Identity()}.isValid(), "a position within range");
        if (state.grip) require(Pose{Vec3::Zero(), state.grip->q_DS}.isValid(), "an orientation");
    }
    if (const auto event = readEvent(message, device)) fuzz::requireSentence(event->text);
    return 0;
}
