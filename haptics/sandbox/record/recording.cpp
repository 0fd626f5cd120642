#include "haptics/sandbox/record/recording.hpp"

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "haptics/sandbox/record/recording_json.hpp"

namespace touchstone::sandbox {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

std::string readText(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    if (!in || fs::is_directory(file))
        throw std::runtime_error("cannot read '" + file.string() +
                                 "': a recording is a folder with ticks.npy and recording.json");
    return {std::istreambuf_iterator<char>(in), {}};
}

json readNotes(const fs::path& folder) {
    json notes = json::parse(readText(folder / kNotesFile), nullptr, false);
    if (notes.is_discarded())
        throw std::runtime_error(
            (folder / kNotesFile).string() +
            ": it is not valid JSON: 'touchstone recover' repairs a recording that a crash interrupted");
    return notes;
}

}  // namespace

bool isRecording(const fs::path& folder) {
    std::error_code error;
    return fs::exists(folder / kTicksFile, error) || fs::exists(folder / kNotesFile, error);
}

Recording::Recording(fs::path folder)
    : folder_(std::move(folder)),
      header_(std::make_shared<const json>(readNotes(folder_))),
      ticks_(folder_ / kTicksFile) {
    try {
        if (textOf(header(), "format") != kFormat)
            throw std::invalid_argument("format must be '" + std::string(kFormat) + "'");
        if (countOf(header(), "version") != kFormatVersion)
            throw std::invalid_argument("version must be " + std::to_string(kFormatVersion) +
                                        ": use the program that wrote it");
        scene_ = toRecordedScene(fieldOf(header(), "scene"));
        device_ = textOf(header(), "device");
        settings_.geometry = Geometry::Spheres;  // of recordings that do not name it
        applySettings(settings_, fieldOf(header(), "settings"));
        begin(fieldOf(header(), "start"));
        if (!fieldOf(header(), "changes").is_array()) throw std::invalid_argument("changes must be a list");
        std::uint64_t row = 0;
        for (const json& change : header().at("changes")) {
            if (countOf(change, "row") < row) throw std::invalid_argument("changes must be in the order of their rows");
            row = countOf(change, "row");
        }
    } catch (const std::invalid_argument& wrong) {
        fail(wrong.what());
    }
}

void Recording::fail(const std::string& what) const {
    throw std::runtime_error((folder_ / kNotesFile).string() + ": " + what);
}

void Recording::begin(const json& start) {
    start_ = toStart(start);
    X_WO_ = toObstacles(start);
}

/// Ignores unknown kinds: later versions of the program may write them.
void Recording::apply(const json& change) {
    const std::string kind = textOf(change, "kind");
    if (kind == "settings") {
        applySettings(settings_, fieldOf(change, "settings"));
    } else if (kind == "start") {
        begin(fieldOf(change, "start"));
    } else if (kind == "scene") {
        scene_ = toRecordedScene(fieldOf(change, "scene"));
        device_ = textOf(change, "device");
        ++scenes_;
    } else if (kind == "gap") {
        gap_ = true;
    }
}

bool Recording::next(RecordedTick& tick) {
    const std::uint64_t row = ticks_.row();
    if (row == ticks_.rows()) return false;
    const json& changes = header().at("changes");
    try {
        for (; nextChange_ < changes.size() && countOf(changes[nextChange_], "row") <= row; ++nextChange_)
            apply(changes[nextChange_]);
    } catch (const std::invalid_argument& wrong) {
        fail("changes[" + std::to_string(nextChange_) + "]: " + wrong.what());
    }
    tick.session = scenes_;
    tick.settings = settings_;
    tick.start = std::exchange(start_, std::nullopt);
    ticks_.next(tick);
    if (const std::string wrong = checkSettings(tick.settings); !wrong.empty())
        throw std::runtime_error((folder_ / kTicksFile).string() + ": row " + std::to_string(row) + ": " + wrong);
    return true;
}

std::vector<std::string> Recording::programDifferences() const {
    std::vector<std::string> found;
    const json now = buildInfo();
    const json then = header().contains("program") ? header().at("program") : json::object();
    const auto compare = [&](const json& a, const json& b, const char* key) {
        const std::string recorded = a.is_object() ? a.value(key, "unknown") : "unknown",
                          here = b.value(key, "unknown");
        if (recorded != here)
            found.push_back(std::string("the program's ") + key + " was " + recorded + ", here it is " + here);
    };
    try {
        for (const char* key : {"version", "commit", "compiler", "flags"}) compare(then, now, key);
        compare(then.is_object() ? then.value("machine", json()) : json(), now["machine"], "processor");
    } catch (const json::exception&) {
        found.push_back("it does not say which program wrote it");
    }
    return found;
}

RecordedHand recordedHand(const fs::path& folder) {
    Recording recording(folder);
    RecordedHand hand;
    std::vector<MotionKey> keys;
    RecordedTick tick;
    for (double t = 0; recording.next(tick) && tick.session == 0;) {
        const Settings& settings = tick.settings;
        if (keys.empty() && tick.start) {
            // The tool begins where it was; the device pose may have been elsewhere.
            keys.push_back({t, tick.start->X_WT});
            if (tick.start->loadedBefore)
                t += 1000 / settings.rate;
            else
                keys.clear();
        }
        if (hand.changes.empty() || !(hand.changes.back().settings == settings)) hand.changes.push_back({t, settings});
        if (tick.input.X_WT_device.isValid()) keys.push_back({t, tick.input.X_WT_device});
        t += 1000 / settings.rate;
    }
    if (keys.empty()) throw std::runtime_error("the recording '" + folder.string() + "' has no tick to replay");
    hand.motion = std::make_shared<RecordedMotion>(std::move(keys));
    return hand;
}

std::string recoverRecording(const fs::path& folder) {
    const fs::path file = folder / kNotesFile;
    std::string text = readText(file), done;
    json notes = json::parse(text, nullptr, false);
    // Each change is one line at the end of the file; the complete ones are kept.
    const std::size_t begin = text.find(kChangesBegin);
    if (begin == std::string::npos)
        throw std::runtime_error(
            file.string() +
            ": scene and settings are lost; 'touchstone export' and numpy.load read the ticks without "
            "them");
    const std::size_t head = begin + std::string_view(kChangesBegin).size();
    std::vector<std::pair<std::uint64_t, std::string>> changes;
    for (std::size_t at = text.find('\n', head); at != std::string::npos && at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at + 1), text.size());
        std::string line = text.substr(at + 1, end - at - 1);
        while (!line.empty() && (line.back() == ',' || line.back() == ' ')) line.pop_back();
        const json change = json::parse(line, nullptr, false);
        if (!change.is_object() || !change.contains("row") || !change["row"].is_number_unsigned()) break;
        changes.emplace_back(change["row"], line);
        at = end;
    }
    const json header = json::parse(text.substr(0, head) + kNotesEnd, nullptr, false);
    if (!header.is_object()) throw std::runtime_error(file.string() + ": the part before its changes is broken");
    std::uint64_t layout = 0;
    if (header.contains("layout") && header["layout"].is_string())
        layout = std::strtoull(header["layout"].get<std::string>().c_str(), nullptr, 16);

    const TickFileRepair repair = repairTickFile(folder / kTicksFile, layout);
    done += folder.string() + ": " + std::to_string(repair.rows) + " ticks are complete, the header counted " +
            std::to_string(repair.rowsBefore) + (repair.cutBytes ? "; a torn tick at the end was cut off" : "") + "\n";
    std::size_t kept = 0;
    std::string repaired = text.substr(0, head);
    for (const auto& [row, line] : changes)
        if (row < repair.rows) repaired += (kept++ ? ",\n" : "\n") + line;
    repaired += kNotesEnd;
    if (repaired != text) {
        RandomAccessFile out(file, true);
        out.write(repaired, 0);
        out.cut(repaired.size());
        done += file.string() + ": repaired, with " + std::to_string(kept) + " changes\n";
    }
    return done;
}

void exportCsv(const fs::path& folder, const fs::path& file) {
    TickFileReader ticks(folder / kTicksFile);
    OutputFile out(file, "the ticks");
    std::string line;
    for (const TickField* field : ticks.fields()) line += (line.empty() ? "" : ",") + std::string(field->name);
    out.write(line + '\n');
    for (RecordedTick tick; ticks.next(tick);) {
        line.clear();
        for (const TickField* field : ticks.fields()) {
            if (!line.empty()) line += ',';
            appendField(line, *field, tick);
        }
        out.write(line + '\n');
    }
    out.close();
}

}  // namespace touchstone::sandbox
