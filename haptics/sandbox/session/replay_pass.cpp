#include "haptics/sandbox/session/replay_pass.hpp"

#include <stdexcept>
#include <utility>

namespace touchstone::sandbox {

ReplayPass::ReplayPass(const HapticScene& scene, const std::filesystem::path& folder,
                       std::function<Settings(const Settings&)> adjust)
    : folder_(folder), recording_(folder), adjust_(std::move(adjust)), settings_(adjusted(recording_.settings())) {
    check_.differences = recording_.programDifferences();
    enterScene(scene.scene.file, scene.world);
}

void ReplayPass::enterScene(const std::filesystem::path& openedFile, const std::shared_ptr<const World>& opened) {
    const RecordedScene& then = recording_.scene();
    const RecordedScene now = recordedScene(openedFile, *opened);
    scene_ = then;
    scene_.file = now.file;
    const std::string name = then.file.filename().string();
    if (now.hash != then.hash)
        check_.differences.push_back("the scene file '" + now.file.string() + "' is not the recorded " + name +
                                     ": its content hash is " + (now.hash.empty() ? "unknown" : now.hash) +
                                     ", recorded is " + then.hash);
    std::string why;
    world_ = recordedWorld(then, opened, why);
    if (!world_) {
        check_.differences.push_back("the scene '" + now.file.string() + "' differs from the recorded " + name + ": " +
                                     why);
        // Another build may make other last bits of a mesh or a tree from the same file.
        if (now.hash != then.hash || recording_.programDifferences().empty())
            check_.otherPart = check_.differences.back();
        world_ = opened;
    }
    state_ = std::make_unique<TickState>(*world_);
}

bool ReplayPass::next(TickRecord& record, const TickClocks& clocks, bool audit) {
    if (!recording_.next(recorded_)) return false;
    if (recorded_.session != session_) {
        session_ = recorded_.session;
        const std::filesystem::path file =
            findRecordedScene(recording_.scene(), folder_, scene_.file.parent_path(), "put it beside the recording");
        const HapticScene opened = openScene(
            file, {.treeCache = treeCacheFolder(), .progress = {}, .allTrees = hadSpheres(recording_.scene())});
        if (!opened.world) throw std::runtime_error(file.string() + ": " + opened.missing);
        enterScene(file, opened.world);
    }
    if (recorded_.start) {
        state_->begin(*recorded_.start, recording_.obstacles());
        lost_ = false;
    }
    if (recording_.takeGap()) lost_ = true;
    settings_ = adjusted(recorded_.settings);
    if (!settingsNoted_ && !(settings_ == recorded_.settings)) {
        settingsNoted_ = true;
        check_.differences.push_back("the settings are not those recorded, as requested");
    }

    const double began = clocks.cpuMicroseconds ? clocks.cpuMicroseconds() : 0;
    record = step(*world_, settings_, recorded_.input, *state_, {.clock = clocks.stage, .audit = audit});
    if (clocks.cpuMicroseconds) record.totalUs = clocks.cpuMicroseconds() - began;
    replayed_ = recordedTick(*state_, record, session_);

    const std::uint64_t row = check_.ticks++;
    if (lost_)
        ++check_.notCompared;
    else if (sameBits(replayed_, recorded_))
        ++check_.same;
    else if (!check_.different)
        check_.different = row;
    return true;
}

}  // namespace touchstone::sandbox
