#pragma once
// A file of demonstrations in either format: named parts, each with a checksum, and a manifest that says what they are.
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "haptics/sandbox/exchange/demonstration.hpp"

namespace touchstone::sandbox {

/// Names of the parts, the same in both formats.
inline constexpr const char* kManifestPart = "manifest.json";
inline std::string partOf(const std::string& demonstration, const std::string& array) {
    return "data/" + demonstration + "/" + array;
}
inline std::string partOf(const SceneFile& file) { return "files/" + file.scene + "/" + file.name.generic_string(); }

/// Writes a file that is complete after finish() and absent before. Errors throw std::runtime_error with one sentence.
class DemonstrationWriter {
  public:
    virtual ~DemonstrationWriter() = default;
    virtual void addFile(const std::string& part, std::string_view bytes) = 0;
    virtual void add(const Demonstration& demonstration) = 0;
    virtual void finish(const nlohmann::ordered_json& manifest) = 0;
};
std::unique_ptr<DemonstrationWriter> makeHdf5Writer(const std::filesystem::path& file);
std::unique_ptr<DemonstrationWriter> makeMcapWriter(const std::filesystem::path& file);

/// A file's bytes in memory, as long as this lives.
class MappedFile {
  public:
    /// Throws std::runtime_error with one sentence.
    explicit MappedFile(const std::filesystem::path& file);
    ~MappedFile();
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;
    std::string_view bytes() const { return bytes_; }

  private:
    std::string_view bytes_;
};

/// What a reader finds: every byte of the file belongs to a part or is covered by a checksum of its own.
struct FoundParts {
    std::map<std::string, std::string_view> parts;
    std::vector<std::string> changed;  ///< parts whose checksum is wrong
    std::string damage;                ///< one clause: what else is wrong; empty: nothing
};
FoundParts readHdf5Parts(std::string_view file);
FoundParts readMcapParts(std::string_view file);
bool isHdf5(std::string_view file);
bool isMcap(std::string_view file);

/// The parts that a format makes of a demonstration for its readers, beyond what a replay needs. `messages`: number of
/// MCAP chunks before, which this increases.
using Views = std::vector<std::pair<std::string, std::string>>;
Views hdf5Views(const Demonstration& demonstration);
Views mcapViews(const Demonstration& demonstration, std::size_t& messages);

/// A file that was read and whose every byte is as it was written.
class DemonstrationFile {
  public:
    /// Throws std::runtime_error if the file has another format, is cut off, or was changed; the message names the
    /// part.
    explicit DemonstrationFile(std::filesystem::path file);

    const nlohmann::json& manifest() const { return manifest_; }
    /// Throws std::runtime_error if the file lacks it.
    std::string_view part(const std::string& name) const;
    bool has(const std::string& name) const { return found_.parts.contains(name); }
    Views views(const Demonstration& demonstration, std::size_t& messages) const;
    [[noreturn]] void fail(const std::string& what) const;

  private:
    std::string changeIn(const std::string& part) const;

    std::filesystem::path file_;
    MappedFile mapped_;
    FoundParts found_;
    nlohmann::json manifest_;
};

}  // namespace touchstone::sandbox
