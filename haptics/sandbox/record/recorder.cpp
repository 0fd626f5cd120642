#include "haptics/sandbox/record/recorder.hpp"

#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>

#include "haptics/files/output_file.hpp"
#include "haptics/math/hash.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "haptics/sandbox/record/recording.hpp"
#include "haptics/sandbox/record/recording_json.hpp"

namespace touchstone::sandbox {
namespace {

using nlohmann::ordered_json;

// At most a quarter of a second may be lost in a crash; this leaves room for a caller that adds its ticks late.
constexpr auto kFlushInterval = std::chrono::milliseconds(100);

std::string dumped(const ordered_json& json, int indent = -1) {
    return json.dump(indent, ' ', false, ordered_json::error_handler_t::replace);
}

std::string timeNow() {
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    gmtime_r(&now, &utc);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
    return text;
}

}  // namespace

Recorder::Recorder(std::filesystem::path folder)
    : folder_(std::move(folder)), flushed_(std::chrono::steady_clock::now()) {
    if (isRecording(folder_))
        throw std::runtime_error("'" + folder_.string() + "' holds a recording already: choose another folder");
    std::error_code error;
    std::filesystem::create_directories(folder_, error);
    if (error) throw std::runtime_error("cannot make the folder '" + folder_.string() + "': " + error.message());
    if (access(folder_.c_str(), W_OK) != 0)
        throw std::runtime_error("cannot write the recording to '" + folder_.string() +
                                 "': " + std::generic_category().message(errno));
}

Recorder::~Recorder() { flush(); }

void Recorder::announce(std::uint64_t session, RecordedScene scene, std::string device) {
    sessions_.erase(sessions_.begin(), before_ ? sessions_.lower_bound(before_->session) : sessions_.begin());
    sessions_[session] = {std::move(scene), std::move(device)};
}

void Recorder::fail(const std::exception& error) {
    rows_ = ticks_ ? ticks_->rows() - ticks_->waiting() : 0;
    try {
        // This leaves the changes written so far as valid JSON. The end needs no more disk space than it had before.
        if (notes_) {
            notes_->write(kNotesEnd, changesEnd_);
            notes_->cut(changesEnd_ + std::string_view(kNotesEnd).size());
        }
    } catch (const std::exception&) {
        // 'touchstone recover' repairs the file.
    }
    ticks_.reset();
    notes_.reset();
    failure_ = "the recording in '" + folder_.string() + "' stopped after " + std::to_string(rows_) +
               " ticks: " + error.what();
}

void Recorder::add(const RecordedTick& tick, std::span<const Pose> X_WO) {
    if (!failure_.empty() || (!before_ && !tick.start)) return;
    try {
        if (!before_)
            begin(tick, X_WO);
        else
            noteChanges(tick, X_WO);
        ticks_->append(tick);
        before_ = tick;
        rows_ = ticks_->rows();
    } catch (const std::exception& error) {
        fail(error);
        return;
    }
    if (std::chrono::steady_clock::now() - flushed_ > kFlushInterval) flush();
}

void Recorder::flush() {
    if (!ticks_) return;
    try {
        // Notes are written first: notes of a tick that is missing do no harm, a tick without its notes does.
        if (!pendingChanges_.empty()) {
            notes_->write(pendingChanges_ + kNotesEnd, changesEnd_);
            changesEnd_ += pendingChanges_.size();
            pendingChanges_.clear();
        }
        ticks_->flush();
    } catch (const std::exception& error) {
        fail(error);
    }
    flushed_ = std::chrono::steady_clock::now();
}

void Recorder::begin(const RecordedTick& first, std::span<const Pose> X_WO) {
    const SessionFacts& facts = sessions_[first.session];
    ordered_json notes = {{"format", kFormat},
                          {"version", kFormatVersion},
                          {"begun", timeNow()},
                          {"layout", hexadecimal(tickLayout())},
                          {"program", buildInfo()},
                          {"scene", toJson(facts.scene)},
                          {"device", facts.device},
                          {"settings", toJson(first.settings, nullptr)},
                          {"start", toJson(*first.start, X_WO)}};
    std::string text = dumped(notes, 1);
    text.resize(text.rfind('\n'));
    text += std::string(",\n ") + kChangesBegin;
    // Both files appear with the first tick and are complete from then on: a process that is killed before that leaves
    // no recording.
    ticks_ = std::make_unique<TickFileWriter>(folder_ / kTicksFile);
    writeFile(folder_ / kNotesFile, "the recording", text + kNotesEnd);
    notes_ = std::make_unique<RandomAccessFile>(folder_ / kNotesFile, true);
    changesEnd_ = text.size();
}

void Recorder::noteChange(const RecordedTick& tick, const char* kind, ordered_json what) {
    ordered_json entry = {{"row", ticks_->rows()}, {"tick", tick.record.tick}, {"kind", kind}};
    for (auto& [key, value] : what.items()) entry[key] = std::move(value);
    pendingChanges_ += (anyChange_ ? ",\n  " : "\n  ") + dumped(entry);
    anyChange_ = true;
}

void Recorder::noteChanges(const RecordedTick& tick, std::span<const Pose> X_WO) {
    if (tick.session != before_->session) {
        const SessionFacts& facts = sessions_[tick.session];
        noteChange(tick, "scene", {{"scene", toJson(facts.scene)}, {"device", facts.device}});
    }
    const ordered_json settings = toJson(tick.settings, &before_->settings);
    if (!settings.empty()) noteChange(tick, "settings", {{"settings", settings}});
    if (tick.start) {
        noteChange(tick, "start", {{"start", toJson(*tick.start, X_WO)}});
    } else if (tick.session != before_->session) {
        noteChange(tick, "gap", ordered_json::object());  // the first ticks of the session
    } else if (tick.record.tick != before_->record.tick + 1) {
        const std::uint64_t lost = tick.record.tick - before_->record.tick - 1;
        lost_ += lost;
        noteChange(tick, "gap", {{"lost", lost}});
    }
}

}  // namespace touchstone::sandbox
