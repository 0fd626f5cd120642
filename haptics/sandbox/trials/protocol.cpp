#include "haptics/sandbox/trials/protocol.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <stdexcept>

#include "engine/scene/fields.hpp"
#include "engine/scene/gltf_container.hpp"
#include "engine/scene/text.hpp"
#include "haptics/loop/setting_table.hpp"
#include "haptics/math/nearest_name.hpp"
#include "haptics/math/numbers.hpp"
#include "haptics/sandbox/session/presets.hpp"

namespace touchstone::sandbox {
namespace {

using nlohmann::ordered_json;

constexpr double kMaxTrials = 1e6;  // of a study
constexpr int kMaxKeys = 20'000;    // of a protocol file: they are searched one by one

/// Reads one object of the file, key by key.
class Reader {
  public:
    Reader(std::string file, std::string path, const ordered_json& value)
        : file_(std::move(file)), path_(std::move(path)), value_(value) {
        if (!value_.is_object()) fail("", "an object");
    }

    [[noreturn]] void fail(const std::string& key, const std::string& must) const {
        const std::string where = path_.empty() || key.empty() ? path_ + key : path_ + "." + key;
        std::string sentence = (where.empty() ? "its content" : where) + " must be " + must;
        if (sentence.size() > 1000) sentence = sentence.substr(0, 1000) + "...";  // keys can be of any length
        throw std::runtime_error(file_ + ": " + engine::printable(sentence));
    }
    const ordered_json* find(const std::string& key) {
        known_.insert(key);
        const auto found = value_.find(key);
        return found == value_.end() ? nullptr : &*found;
    }
    const ordered_json& get(const std::string& key, const std::string& must) {
        const ordered_json* value = find(key);
        if (!value) fail(key, "given: " + must);
        return *value;
    }
    double number(const std::string& key, double usual, double min, double max) {
        const ordered_json* value = find(key);
        if (!value) return usual;
        const auto number = engine::numberIn(*value, min, max);
        if (!number) fail(key, rangeWords(min, max));
        return *number;
    }
    template <class Whole>
    Whole whole(const std::string& key, Whole usual, double min, double max) {
        const double value = number(key, static_cast<double>(usual), min, max);
        if (value != std::floor(value)) fail(key, "a whole number");
        return static_cast<Whole>(value);
    }
    std::string text(const std::string& key, const std::string& usual) {
        const ordered_json* value = find(key);
        if (!value) return usual;
        if (!value->is_string() || value->get<std::string>().empty()) fail(key, "a text");
        return value->get<std::string>();
    }
    std::optional<Reader> object(const std::string& key) {
        const ordered_json* value = find(key);
        if (!value) return std::nullopt;
        return Reader(file_, path_.empty() ? key : path_ + "." + key, *value);
    }
    /// A key of settingTable() with its value, as text.
    std::pair<std::string, std::string> setting(const std::string& key) const {
        const ordered_json& value = value_.at(key);
        std::pair<std::string, std::string> set{key, value.is_string() ? value.get<std::string>() : value.dump()};
        Settings scratch;
        const std::string wrong = setSetting(scratch, key, set.second), begin = key + " must be ";
        if (wrong.starts_with(begin)) fail(key, wrong.substr(begin.size()));
        if (!wrong.empty()) fail(key, "left out: " + wrong);
        return set;
    }
    auto items() const { return value_.items(); }
    /// Refuses unknown keys, since a misspelled key would silently change a condition.
    void refuseUnknown() const {
        std::string names;
        for (const std::string& key : known_) names += (names.empty() ? "" : ", ") + key;
        for (const auto& [key, value] : value_.items()) {
            if (known_.count(key)) continue;
            const std::string nearest = nearestName(key, known_);
            fail(key,
                 "left out: " + (nearest.empty() ? "the keys here are " + names : "did you mean '" + nearest + "'?"));
        }
    }

  private:
    std::string file_, path_;
    const ordered_json& value_;
    std::set<std::string> known_;
};

/// Turns a name into a random seed by FNV-1a.
std::uint64_t seedOf(const std::string& name) {
    std::uint64_t hash = 0xcbf29ce484222325ull;
    for (const unsigned char c : name) hash = (hash ^ c) * 0x100000001b3ull;
    return hash;
}

/// Combines two random seeds. Source: Steele, Lea and Flood's SplitMix64 (2014).
std::uint64_t mixed(std::uint64_t a, std::uint64_t b) {
    std::uint64_t z = a * 0x9e3779b97f4a7c15ull + b + 0x9e3779b97f4a7c15ull;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
}

/// Whether a name can be shown in tables, plots and a terminal.
bool isPlain(const std::string& name) { return name.find('"') == std::string::npos && engine::printable(name) == name; }

std::vector<Participant> readParticipants(Reader& reader) {
    constexpr const char* kMust = "a list of names or whole numbers (seeds), or the number of participants, 1 to 10000";
    const ordered_json& list = reader.get("participants", kMust);
    std::vector<Participant> participants;
    if (list.is_number_integer()) {
        const int count = reader.whole("participants", 1, 1, 10'000);
        for (int i = 1; i <= count; ++i) participants.push_back({std::to_string(i), static_cast<std::uint64_t>(i)});
        return participants;
    }
    if (!list.is_array() || list.empty()) reader.fail("participants", kMust);
    std::set<std::string> names;
    for (const ordered_json& one : list) {
        if (one.is_number_integer() && one.get<std::int64_t>() >= 0)
            participants.push_back({one.dump(), one.get<std::uint64_t>()});
        else if (one.is_string() && !one.get<std::string>().empty())
            participants.push_back({one.get<std::string>(), seedOf(one.get<std::string>())});
        else
            reader.fail("participants", kMust);
        if (!isPlain(participants.back().name))
            reader.fail("participants", "names without quotes and control characters");
        if (!names.insert(participants.back().name).second)
            reader.fail("participants", "different from each other: '" + participants.back().name + "' is given twice");
    }
    return participants;
}

Condition readCondition(Reader reader, const Condition& usual) {
    Condition condition = usual;
    condition.scene = reader.text("scene", usual.scene);
    if (condition.scene.empty()) reader.fail("scene", "given: the name of a scene or a .glb or .gltf file");
    condition.device = reader.text("device", usual.device);
    condition.timeLimit = reader.number("time_limit_s", usual.timeLimit, 0.1, 3600);
    std::set<std::string> beside;
    for (const char* key : {"mode", "solver", "tolerance", "stiffness", "friction_coefficient"}) {
        if (!reader.find(key)) continue;
        condition.set.push_back(reader.setting(key));
        beside.insert(key);
    }
    if (const auto settings = reader.object("settings")) {
        for (const auto& [key, value] : settings->items()) {
            if (key == "shadow" || key == "pause") settings->fail(key, "left out: trials do not use it");
            // The mode changes the solver as well, so it must be set first.
            if (key == "mode" || beside.count(key)) settings->fail(key, "left out here: write it beside settings");
            condition.set.push_back(settings->setting(key));
        }
    }
    std::string name = condition.scene;
    for (const auto& [key, value] : condition.set) name += " " + key + "=" + value;
    for (const char* key : {"device", "time_limit_s"})
        if (const ordered_json* value = reader.find(key))
            name += std::string(" ") + key + "=" + (value->is_string() ? value->get<std::string>() : value->dump());
    condition.name = reader.text("name", name);
    if (!isPlain(condition.name)) reader.fail("name", "a text without quotes and control characters");
    reader.refuseUnknown();
    return condition;
}

}  // namespace

Settings Condition::settings(Settings changed) const {
    const auto fail = [&](const std::string& wrong) { throw std::runtime_error("condition '" + name + "': " + wrong); };
    changed.shadow = kNoSolver;
    for (const auto& [key, value] : set) {
        Settings asked = changed;
        if (const std::string wrong = setSetting(asked, key, value); !wrong.empty()) fail(wrong);
        changed = key == "mode" ? withMode(changed, asked.mode) : asked;
        if (key == "mode") changed.shadow = kNoSolver;
    }
    for (const auto& [key, value] : set)
        if (const std::string wrong = checkAskedFriction(changed, key); !wrong.empty()) fail(wrong);
    if (const std::string wrong = checkSettings(changed); !wrong.empty()) fail(wrong);
    return changed;
}

std::vector<Trial> Protocol::trials() const {
    std::vector<Trial> all;
    for (std::size_t p = 0; p < participants.size(); ++p) {
        const std::uint64_t ownSeed = mixed(seed, participants[p].seed);
        std::vector<Trial> own;
        for (int repetition = 1; repetition <= repetitions; ++repetition)
            for (std::size_t c = 0; c < conditions.size(); ++c)
                own.push_back(
                    {.participant = static_cast<int>(p),
                     .condition = static_cast<int>(c),
                     .repetition = repetition,
                     .seed = mixed(ownSeed, static_cast<std::uint64_t>(repetition)) >> 32});  // fits a spreadsheet cell
        std::mt19937_64 random(ownSeed);  // std::shuffle may differ between standard libraries
        for (std::size_t i = own.size(); randomOrder && i > 1; --i) std::swap(own[i - 1], own[random() % i]);
        for (std::size_t i = 0; i < own.size(); ++i) {
            own[i].order = static_cast<int>(i) + 1;
            own[i].number = static_cast<int>(all.size()) + 1;
            all.push_back(own[i]);
        }
    }
    return all;
}

Protocol readProtocol(const ordered_json& source, const std::string& file) {
    Protocol protocol;
    protocol.source = source;
    Reader reader(file, "", source);
    if (reader.text("format", "") != "touchstone trials") reader.fail("format", "\"touchstone trials\"");
    if (reader.whole("version", 1, 1, 1'000'000) != 1) reader.fail("version", "1, the version that this program reads");
    protocol.seed = reader.whole("seed", protocol.seed, 0, 1e15);
    const std::string order = reader.text("order", "random");
    if (order != "random" && order != "fixed") reader.fail("order", "\"random\" or \"fixed\"");
    protocol.randomOrder = order == "random";
    protocol.repetitions = reader.whole("repetitions", 1, 1, 10'000);
    protocol.participants = readParticipants(reader);
    Condition usual;
    usual.scene = reader.text("scene", "");
    usual.device = reader.text("device", "insert");
    usual.timeLimit = reader.number("time_limit_s", usual.timeLimit, 0.1, 3600);
    const ordered_json& conditions = reader.get("conditions", "a list with an object for each");
    if (!conditions.is_array() || conditions.empty()) reader.fail("conditions", "a list with an object for each");
    std::set<std::string> names;
    for (const ordered_json& one : conditions) {
        const std::string path = "conditions[" + std::to_string(protocol.conditions.size()) + "]";
        protocol.conditions.push_back(readCondition({file, path, one}, usual));
        if (const std::string& name = protocol.conditions.back().name; !names.insert(name).second)
            reader.fail(path + ".name", "different from '" + name + "', which another condition has already");
    }
    const double trials =
        double(protocol.participants.size()) * double(protocol.conditions.size()) * protocol.repetitions;
    if (trials > kMaxTrials) reader.fail("repetitions", "smaller: the study has more than a million trials");
    if (auto jam = reader.object("jam")) {
        protocol.limits.jamForce = jam->number("force_N", protocol.limits.jamForce, 0, 1e3);
        protocol.limits.jamProgress = jam->number("progress_mm", protocol.limits.jamProgress, 0, 1e3);
        protocol.limits.jamMs = jam->number("time_ms", protocol.limits.jamMs, 1, 1e6);
        jam->refuseUnknown();
    }
    reader.refuseUnknown();
    return protocol;
}

ordered_json firstStudy(const std::string& scene, const std::string& condition) {
    return {{"format", "touchstone trials"},
            {"version", 1},
            {"participants", 5},
            {"scene", scene},
            {"time_limit_s", 20},
            {"conditions", ordered_json::array({{{"name", condition}}})}};
}

Protocol readProtocol(const std::filesystem::path& file) {
    const std::vector<std::uint8_t> bytes = engine::readBytes(file);
    ordered_json source;
    int keys = 0;
    // The keys keep their order and are searched linearly, so their number is limited.
    const auto count = [&](int, ordered_json::parse_event_t event, const ordered_json&) {
        if (event == ordered_json::parse_event_t::key && ++keys > kMaxKeys)
            throw std::runtime_error(file.string() + ": it has more than " + std::to_string(kMaxKeys) +
                                     " keys: remove those that do not belong to a protocol");
        return true;
    };
    try {
        source = ordered_json::parse(bytes, count);
    } catch (const nlohmann::json::exception& error) {
        std::string what = error.what();
        what = what.substr(what.find("] ") + 2);
        what = what.substr(0, what.find("; last read"));  // the quoted part may be the whole file
        throw std::runtime_error(file.string() + ": is not valid JSON, correct it: " + engine::printable(what));
    }
    return readProtocol(source, file.string());
}

}  // namespace touchstone::sandbox
