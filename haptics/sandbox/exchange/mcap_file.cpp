// Demonstrations as MCAP, written and read after the published format (https://mcap.dev/spec): poses, wrench and
// contact as JSON messages for viewers, and the recording itself as attachments, which is what a replay needs.
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <ctime>
#include <stdexcept>

#include "haptics/files/output_file.hpp"
#include "haptics/sandbox/exchange/demonstration_file.hpp"
#include "haptics/sandbox/record/build_info.hpp"
#include "haptics/sandbox/record/tick_fields.hpp"
#include "haptics/sandbox/record/tick_file.hpp"

namespace touchstone::sandbox {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kRecordHead = 9;       // opcode and length of the content
constexpr std::size_t kTicksPerChunk = 256;  // about 200 kB
constexpr const char* kArrayFile = ".npy";

enum Opcode : std::uint8_t {
    kHeader = 1,
    kFooter,
    kSchema,
    kChannel,
    kMessage,
    kChunk,
    kMessageIndex,
    kChunkIndex,
    kAttachment,
    kAttachmentIndex,
    kStatistics,
    kMetadata,
    kMetadataIndex,
    kSummaryOffset,
    kDataEnd
};

std::uint32_t crcOf(std::string_view bytes, std::uint32_t before = 0) {
    return static_cast<std::uint32_t>(
        crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

/// The content of a record, field by field.
class Fields {
  public:
    template <class T>
    Fields& number(T value) {
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
        return *this;
    }
    Fields& u16(std::size_t value) { return number(static_cast<std::uint16_t>(value)); }
    Fields& u32(std::size_t value) { return number(static_cast<std::uint32_t>(value)); }
    Fields& u64(std::uint64_t value) { return number(value); }
    Fields& text(std::string_view value) {
        u32(value.size());
        bytes_ += value;
        return *this;
    }
    Fields& raw(std::string_view value) {
        bytes_ += value;
        return *this;
    }
    const std::string& bytes() const { return bytes_; }
    std::string record(Opcode opcode) const {
        return std::string(1, static_cast<char>(opcode)) + Fields().u64(bytes_.size()).bytes() + bytes_;
    }

  private:
    std::string bytes_;
};

/// Takes fields from the content of a record. Throws std::out_of_range at its end.
class Taker {
  public:
    explicit Taker(std::string_view bytes) : bytes_(bytes) {}
    std::string_view raw(std::uint64_t size) {
        if (size > bytes_.size()) throw std::out_of_range("");
        const std::string_view taken = bytes_.substr(0, size);
        bytes_.remove_prefix(size);
        return taken;
    }
    template <class T>
    T number() {
        T value;
        std::memcpy(&value, raw(sizeof value).data(), sizeof value);
        return value;
    }
    std::string_view text() { return raw(number<std::uint32_t>()); }

  private:
    std::string_view bytes_;
};

// Each demonstration has these topics, with lengths in m and torques in N·m as viewers expect them.
struct Topic {
    const char *name, *schema;
};
constexpr Topic kTopics[] = {{"device_pose", "foxglove.PoseInFrame"},
                             {"tool_pose", "foxglove.PoseInFrame"},
                             {"wrench", "touchstone.Wrench"},
                             {"contact", "touchstone.Contact"}};
constexpr const char* kContactColumns[] = {"rows", "pairs", "sticking", "sliding"};

json numbersNamed(std::initializer_list<const char*> names) {
    json properties = json::object();
    for (const char* name : names) properties[name] = {{"type", "number"}};
    return {{"type", "object"}, {"properties", properties}};
}

/// The schemas in the order of their numbers, from 1.
std::vector<std::pair<std::string, json>> schemas() {
    const json stamp = {{"type", "object"},
                        {"title", "time"},
                        {"properties", {{"sec", {{"type", "integer"}}}, {"nsec", {{"type", "integer"}}}}}};
    const auto message = [&](const char* title, json properties) {
        properties["timestamp"] = stamp;
        properties["frame_id"] = {{"type", "string"}};
        return std::pair<std::string, json>(title, {{"title", title}, {"type", "object"}, {"properties", properties}});
    };
    json counts = json::object();
    for (const char* column : kContactColumns) counts[column] = {{"type", "integer"}};
    counts["in_goal"] = {{"type", "boolean"}};
    return {message("foxglove.PoseInFrame", {{"pose",
                                              {{"type", "object"},
                                               {"properties",
                                                {{"position", numbersNamed({"x", "y", "z"})},
                                                 {"orientation", numbersNamed({"x", "y", "z", "w"})}}}}}}),
            message("touchstone.Wrench",
                    {{"force", numbersNamed({"x", "y", "z"})}, {"torque", numbersNamed({"x", "y", "z"})}}),
            message("touchstone.Contact", counts)};
}

std::size_t schemaNumber(const std::string& name) {
    const auto all = schemas();
    for (std::size_t i = 0; i < all.size(); ++i)
        if (all[i].first == name) return i + 1;
    return 0;
}

/// Number of a demonstration from its name, which is demo_N.
std::size_t numberOf(const Demonstration& demo) {
    std::size_t number = 0;
    const char* end = demo.name.data() + demo.name.size();
    std::from_chars(demo.name.data() + demo.name.find('_') + 1, end, number);
    return number;
}

/// When the recording began, ns since 1970; 0 if it does not say.
std::uint64_t beginOf(const Demonstration& demo) {
    const json notes = json::parse(demo.notes, nullptr, false);
    std::tm utc{};
    const std::string begun = notes.is_object() && notes.contains("begun") && notes["begun"].is_string()
                                  ? notes["begun"].get<std::string>()
                                  : std::string();
    if (!strptime(begun.c_str(), "%Y-%m-%dT%H:%M:%SZ", &utc)) return 0;
    const std::time_t seconds = timegm(&utc);
    return seconds > 0 ? static_cast<std::uint64_t>(seconds) * 1'000'000'000 : 0;
}

void appendNumber(std::string& text, double value) {
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

/// {"x":1,"y":2,"z":3}, and w where there are four; each divided by `unit`.
void appendVector(std::string& text, const double* values, std::string_view names, double unit) {
    for (std::size_t i = 0; i < names.size(); ++i) {
        text += i == 0 ? "{\"" : ",\"";
        text += names[i];
        text += "\":";
        appendNumber(text, values[i] / unit);
    }
    text += '}';
}

std::string messageOf(const Demonstration& demo, std::size_t tick, std::size_t topic, std::uint64_t time) {
    std::string text = "{\"timestamp\":{\"sec\":" + std::to_string(time / 1'000'000'000) +
                       ",\"nsec\":" + std::to_string(time % 1'000'000'000) + "},\"frame_id\":\"scene\",";
    double v[7];
    if (topic < 2) {
        std::memcpy(v, demo.at(tick, topic == 0 ? "device_x_mm" : "tool_x_mm"), sizeof v);
        text += "\"pose\":{\"position\":";
        appendVector(text, v, "xyz", 1000);
        text += ",\"orientation\":";
        appendVector(text, v + 3, "wxyz", 1);
        text += '}';
    } else if (topic == 2) {
        std::memcpy(v, demo.at(tick, "force_o_x_N"), 6 * sizeof v[0]);
        text += "\"force\":";
        appendVector(text, v, "xyz", 1);
        text += ",\"torque\":";
        appendVector(text, v + 3, "xyz", 1000);
    } else {
        for (const char* column : kContactColumns) {
            std::int32_t count = 0;
            std::memcpy(&count, demo.at(tick, column), sizeof count);
            text += "\"" + std::string(column) + "\":" + std::to_string(count) + ",";
        }
        text += std::string("\"in_goal\":") + (demo.inGoal[tick] ? "true" : "false");
    }
    return text + "}";
}

/// Some ticks as a chunk, with what its index says.
struct Chunk {
    std::uint64_t begin = 0, end = 0;  // ns
    std::string records;
    std::vector<std::string> index = std::vector<std::string>(std::size(kTopics));  // time and offset, by topic
    std::string content() const {
        return Fields()
            .u64(begin)
            .u64(end)
            .u64(records.size())
            .u32(crcOf(records))
            .text("")
            .u64(records.size())
            .raw(records)
            .bytes();
    }
};

Chunk chunkOf(const Demonstration& demo, std::size_t first, std::uint64_t begun) {
    Chunk chunk;
    const std::size_t channel = numberOf(demo) * std::size(kTopics);
    const auto timeOf = [&](std::size_t tick) {
        return begun + static_cast<std::uint64_t>(std::llround(demo.time[tick] * 1e6));
    };
    const std::size_t last = std::min(first + kTicksPerChunk, demo.ticks()) - 1;
    chunk.begin = timeOf(first);
    chunk.end = timeOf(last);
    for (std::size_t tick = first; tick <= last; ++tick)
        for (std::size_t topic = 0; topic < std::size(kTopics); ++topic) {
            const std::uint64_t time = timeOf(tick);
            chunk.index[topic] += Fields().u64(time).u64(chunk.records.size()).bytes();
            chunk.records += Fields()
                                 .u16(channel + topic)
                                 .u32(tick)
                                 .u64(time)
                                 .u64(time)
                                 .raw(messageOf(demo, tick, topic, time))
                                 .record(kMessage);
        }
    return chunk;
}

class McapWriter final : public DemonstrationWriter {
  public:
    explicit McapWriter(const std::filesystem::path& file) : out_(file, "the demonstrations") {
        put(kMagic);
        put(Fields().text("").text("touchstone " + buildInfo()["version"].get<std::string>()).record(kHeader));
        const auto all = schemas();
        for (std::size_t i = 0; i < all.size(); ++i)
            schemas_ +=
                Fields().u16(i + 1).text(all[i].first).text("jsonschema").text(all[i].second.dump()).record(kSchema);
        put(schemas_);
    }

    void addFile(const std::string& part, std::string_view bytes) override {
        attach(part,
               part.ends_with(".gltf")  ? "model/gltf+json"
               : part.ends_with(".glb") ? "model/gltf-binary"
                                        : "application/octet-stream",
               bytes);
    }

    void add(const Demonstration& demo) override {
        const std::size_t channel = numberOf(demo) * std::size(kTopics);
        if (channel + std::size(kTopics) > 0xffff)
            throw std::runtime_error("MCAP has room for " + std::to_string(0xffff / std::size(kTopics)) +
                                     " demonstrations in a file: write several files");
        attach(partOf(demo.name, "recording.json"), "application/json", demo.notes);
        for (const Array& array : arraysOf(demo))
            if (!*array.type || array.name == "chain")
                attach(partOf(demo.name, array.name) + kArrayFile, "application/x-npy",
                       npyHeader(array.type, demo.ticks()) + array.bytes);
        for (std::size_t topic = 0; topic < std::size(kTopics); ++topic) {
            const std::string record = Fields()
                                           .u16(channel + topic)
                                           .u16(schemaNumber(kTopics[topic].schema))
                                           .text("/" + demo.name + "/" + kTopics[topic].name)
                                           .text("json")
                                           .u32(0)
                                           .record(kChannel);
            channels_ += record;
            put(record);
            ++channelCount_;
            counts_ += Fields().u16(channel + topic).u64(demo.ticks()).bytes();
        }
        const std::uint64_t begun = beginOf(demo);
        for (std::size_t first = 0; first < demo.ticks(); first += kTicksPerChunk)
            addChunk(chunkOf(demo, first, begun), channel);
        messages_ += demo.ticks() * std::size(kTopics);
    }

    void finish(const ordered_json& manifest) override {
        const std::string text = manifest.dump(1);
        attach(kManifestPart, "application/json", text);
        // The same in short, where viewers show it.
        Fields entries;
        const auto entry = [&](const std::string& key, const std::string& value) { entries.text(key).text(value); };
        for (const char* key : {"version", "commit", "compiler", "flags"}) entry(key, manifest["program"][key]);
        for (const auto& demo : manifest["demonstrations"])
            entry(demo["name"], demo["scene"].get<std::string>() + ", " +
                                    std::to_string(demo["ticks"].get<std::size_t>()) + " ticks, chain " +
                                    demo["chain"].get<std::string>());
        const std::uint64_t place = at_;
        put(Fields().text("touchstone").u32(entries.bytes().size()).raw(entries.bytes()).record(kMetadata));
        const std::string metadata = Fields().u64(place).u64(at_ - place).text("touchstone").record(kMetadataIndex);
        put(Fields().u32(crc_).record(kDataEnd));

        const std::uint64_t begin = at_;
        std::string summary, offsets;
        const auto group = [&](Opcode opcode, const std::string& records) {
            if (records.empty()) return;
            offsets += Fields().number(opcode).u64(begin + summary.size()).u64(records.size()).record(kSummaryOffset);
            summary += records;
        };
        group(kSchema, schemas_);
        group(kChannel, channels_);
        group(kStatistics, Fields()
                               .u64(messages_)
                               .u16(schemas().size())
                               .u32(channelCount_)
                               .u32(attachmentCount_)
                               .u32(1)
                               .u32(chunkCount_)
                               .u64(chunkCount_ ? first_ : 0)
                               .u64(last_)
                               .u32(counts_.size())
                               .raw(counts_)
                               .record(kStatistics));
        group(kMetadataIndex, metadata);
        group(kAttachmentIndex, attachments_);
        group(kChunkIndex, chunks_);
        const std::uint64_t offsetsBegin = begin + summary.size();
        summary += offsets;
        // The checksum covers the summary and the footer up to the checksum.
        const std::string footer = Fields().u64(begin).u64(offsetsBegin).u32(0).record(kFooter);
        const std::string_view covered = std::string_view(footer).substr(0, footer.size() - 4);
        put(summary);
        put(covered);
        put(Fields().u32(crcOf(covered, crcOf(summary))).bytes());
        put(kMagic);
        out_.close();
    }

  private:
    void put(std::string_view bytes) {
        out_.write(bytes);
        crc_ = crcOf(bytes, crc_);
        at_ += bytes.size();
    }

    void attach(const std::string& name, const char* mediaType, std::string_view bytes) {
        const std::uint64_t place = at_;
        const std::string head = Fields().u64(0).u64(0).text(name).text(mediaType).u64(bytes.size()).bytes();
        put(std::string(1, static_cast<char>(kAttachment)) + Fields().u64(head.size() + bytes.size() + 4).bytes());
        put(head);
        put(bytes);
        put(Fields().u32(crcOf(bytes, crcOf(head))).bytes());
        attachments_ += Fields()
                            .u64(place)
                            .u64(at_ - place)
                            .u64(0)
                            .u64(0)
                            .u64(bytes.size())
                            .text(name)
                            .text(mediaType)
                            .record(kAttachmentIndex);
        ++attachmentCount_;
    }

    void addChunk(const Chunk& chunk, std::size_t channel) {
        const std::uint64_t place = at_;
        put(Fields().raw(chunk.content()).record(kChunk));
        const std::uint64_t size = at_ - place;
        Fields offsets;
        for (std::size_t topic = 0; topic < chunk.index.size(); ++topic) {
            offsets.u16(channel + topic).u64(at_);
            put(Fields().u16(channel + topic).text(chunk.index[topic]).record(kMessageIndex));
        }
        chunks_ += Fields()
                       .u64(chunk.begin)
                       .u64(chunk.end)
                       .u64(place)
                       .u64(size)
                       .text(offsets.bytes())
                       .u64(at_ - place - size)
                       .text("")
                       .u64(chunk.records.size())
                       .u64(chunk.records.size())
                       .record(kChunkIndex);
        first_ = std::min(first_, chunk.begin);
        last_ = std::max(last_, chunk.end);
        ++chunkCount_;
    }

    OutputFile out_;
    std::uint64_t at_ = 0, messages_ = 0, first_ = ~std::uint64_t{0}, last_ = 0;
    std::uint32_t crc_ = 0;  // of everything up to here
    std::size_t channelCount_ = 0, attachmentCount_ = 0, chunkCount_ = 0;
    std::string schemas_, channels_, attachments_, chunks_, counts_;  // of the summary
};

/// Takes an attachment into the parts: arrays without their header, as in the other format.
void takeAttachment(FoundParts& found, std::string_view content) {
    Taker taker(content);
    taker.raw(16);
    std::string name(taker.text());
    taker.text();
    std::string_view data = taker.raw(taker.number<std::uint64_t>());
    const std::size_t covered = static_cast<std::size_t>(data.data() + data.size() - content.data());
    const bool intact = taker.number<std::uint32_t>() == crcOf(content.substr(0, covered));
    if (name.starts_with("data/") && name.ends_with(kArrayFile)) {
        name.resize(name.size() - std::strlen(kArrayFile));
        Taker header(data);
        header.raw(8);
        header.raw(header.number<std::uint16_t>());
        data.remove_prefix(static_cast<std::size_t>(header.raw(0).data() - data.data()));
    }
    if (!intact) found.changed.push_back(name);
    found.parts[name] = data;
}

}  // namespace

std::unique_ptr<DemonstrationWriter> makeMcapWriter(const std::filesystem::path& file) {
    return std::make_unique<McapWriter>(file);
}

Views mcapViews(const Demonstration& demo, std::size_t& messages) {
    Views views;
    views.emplace_back(partOf(demo.name, "chain"), "");
    for (Array& array : arraysOf(demo))
        if (array.name == "chain") views.back().second = std::move(array.bytes);
    const std::uint64_t begun = beginOf(demo);
    for (std::size_t first = 0; first < demo.ticks(); first += kTicksPerChunk)
        views.emplace_back("messages/" + std::to_string(messages++), chunkOf(demo, first, begun).content());
    return views;
}

bool isMcap(std::string_view file) { return file.starts_with(kMagic); }

FoundParts readMcapParts(std::string_view file) {
    FoundParts found;
    std::size_t at = kMagic.size(), messages = 0, summary = 0;
    const auto damaged = [&](const std::string& what) {
        if (found.damage.empty()) found.damage = what;
    };
    const std::string cutOff = file.ends_with(kMagic) ? "it was changed" : "it is cut off or was changed";
    const std::size_t end = file.size() - std::min(file.size(), kMagic.size());  // of the last record
    try {
        for (bool ended = false; !ended;) {
            Taker head(file.substr(std::min(at, end), end - std::min(at, end)));
            const auto opcode = head.number<std::uint8_t>();
            const std::string_view content = head.raw(head.number<std::uint64_t>());
            Taker taker(content);
            if (opcode == kAttachment) {
                takeAttachment(found, content);
            } else if (opcode == kChunk) {
                taker.raw(24);
                const auto crc = taker.number<std::uint32_t>();
                taker.text();
                const std::string name = "messages/" + std::to_string(messages++);
                if (crcOf(taker.raw(taker.number<std::uint64_t>())) != crc) found.changed.push_back(name);
                found.parts[name] = content;
            } else if (opcode == kDataEnd) {
                summary = at + kRecordHead + content.size();
                if (taker.number<std::uint32_t>() != crcOf(file.substr(0, at)))
                    damaged("its data section was changed after the export: its checksum is wrong");
            } else if (opcode == kFooter) {
                const auto place = taker.number<std::uint64_t>();
                taker.raw(8);
                const std::string_view covered = file.substr(summary, at + kRecordHead + 16 - summary);
                if (summary == 0 || place != summary || content.size() != 20 ||
                    taker.number<std::uint32_t>() != crcOf(covered))
                    damaged("its summary was changed after the export: its checksum is wrong");
                ended = true;
            }
            at += kRecordHead + content.size();
        }
        if (at != end || !file.ends_with(kMagic)) damaged(cutOff + " at its end");
    } catch (const std::out_of_range&) {
        damaged(cutOff + ": the record at byte " + std::to_string(at) + " ends after the file");
    }
    return found;
}

}  // namespace touchstone::sandbox
