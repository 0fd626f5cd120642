// Arbitrary bytes as the protocol of a study.
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "haptics/sandbox/trials/protocol.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace touchstone;
using fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const fuzz::ScratchFile file(".json");
    sandbox::Protocol protocol;
    try {
        protocol = sandbox::readProtocol(file.write(data, size));
    } catch (const std::runtime_error& error) {
        fuzz::requireSentence(error.what());
        require(std::string(error.what()).find(file.path().filename().string()) != std::string::npos, "names the file");
        return 0;
    }
    const std::size_t trials =
        protocol.participants.size() * protocol.conditions.size() * static_cast<std::size_t>(protocol.repetitions);
    require(trials >= 1 && trials <= 1'000'000, "as many trials as anybody can run");
    const auto all = protocol.trials();
    require(all.size() == trials, "every participant has every trial");
    for (const sandbox::Condition& condition : protocol.conditions) try {
            require(checkSettings(condition.settings(Settings{})).empty(), "settings that go together");
        } catch (const std::runtime_error& error) {
            fuzz::requireSentence(error.what());
        }
    // The copy that a study stores is the same protocol.
    const std::string kept = protocol.source.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    require(sandbox::readProtocol(file.write(kept.data(), kept.size())).source == protocol.source, "it reads back");
    return 0;
}
