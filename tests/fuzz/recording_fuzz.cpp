// Arbitrary bytes as a recording: four bytes give the length of recording.json, the rest is ticks.npy. The recording is
// read, given to step(), converted to a motion, recovered and exported.
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/session/replay_pass.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/support/scene_maker.hpp"
#include "tests/support/temp_folder.hpp"

using namespace touchstone;
using fuzz::require;

namespace {

namespace fs = std::filesystem;

void write(const fs::path& file, const std::uint8_t* data, std::size_t size) {
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
}

/// Requires that its exception is one sentence.
template <class Work>
bool succeedsOrExplains(Work&& work) {
    try {
        work();
        return true;
    } catch (const std::exception& error) {
        fuzz::requireSentence(error.what());
        return false;
    }
}

const sandbox::HapticScene& scene() {
    static const sandbox::HapticScene opened = [] {
        engine::Scene small = test::pressScene();  // small, because trees are slow under the sanitizers
        for (const engine::Entity node : small.nodes) {
            nlohmann::json extras = *small.registry.get<engine::NodeMarking>(node).extras;
            extras["touchstone"]["leaves"] = 16;
            setExtras(small, node, extras);
        }
        return sandbox::openScene(std::move(small));
    }();
    return opened;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static const test::TempFolder folder;
    const fs::path recording = folder.path() / "recording";
    fs::create_directory(recording);
    const std::size_t notes =
        std::min<std::size_t>(fuzz::Bytes(data, size).take<std::uint32_t>(), size - std::min<std::size_t>(size, 4));
    const std::uint8_t* rest = data + std::min<std::size_t>(size, 4);
    write(recording / "recording.json", rest, notes);
    write(recording / "ticks.npy", rest + notes, static_cast<std::size_t>(data + size - rest) - notes);

    std::uint64_t rows = 0;
    const bool readable = succeedsOrExplains([&] {
        sandbox::Recording whole(recording);
        RecordedTick tick;
        while (whole.next(tick)) ++rows;
        require(rows == whole.rows(), "as many rows as it says");
    });
    if (readable && rows < 200)  // a fuzzer must not open scenes of other files
        succeedsOrExplains([&] {
            sandbox::ReplayPass pass(scene(), recording, {});
            TickRecord record;
            for (std::uint64_t row = 0; row < rows && pass.next(record, {}, true); ++row) {
                require(record.X_WT.isFinite() && record.wrench_C.isFinite(), "the tool and its force are finite");
                require(!(record.penetration > 1e7), "no more penetration than there is space");
            }
        });
    succeedsOrExplains([&] { sandbox::recordedHand(recording); });
    succeedsOrExplains([&] { sandbox::exportCsv(recording, folder.path() / "ticks.csv"); });
    if (succeedsOrExplains([&] { sandbox::recoverRecording(recording); })) {
        succeedsOrExplains([&] { sandbox::Recording{recording}; });
        // A recovered recording needs no further repair.
        const std::string once = sandbox::recoverRecording(recording);
        require(once.find("torn") == std::string::npos, "recovered once is recovered");
    }
    return 0;
}
