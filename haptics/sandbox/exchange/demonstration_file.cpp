#include "haptics/sandbox/exchange/demonstration_file.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>

#include "engine/scene/gltf_container.hpp"
#include "engine/scene/scene.hpp"
#include "haptics/sandbox/record/tick_file.hpp"

namespace touchstone::sandbox {
namespace {

using nlohmann::json;

/// The first key of the settings in which two recording.json differ; empty if they differ elsewhere.
std::string changedSetting(const json& then, std::string_view notes) {
    const json now = json::parse(notes, nullptr, false);
    if (!now.is_object() || !now.contains("settings") || !then.is_object()) return {};
    for (const auto& [key, value] : then.items())
        if (!now["settings"].is_object() || !now["settings"].contains(key) || now["settings"][key] != value) return key;
    return {};
}

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& file) {
    const auto fail = [&](const std::string& why) {
        return std::runtime_error("cannot read '" + file.string() + "': " + why);
    };
    const FileHandle handle(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
    struct stat status {};
    if (handle < 0 || fstat(handle, &status) != 0) throw fail(std::generic_category().message(errno));
    if (!S_ISREG(status.st_mode)) throw fail("it is not a regular file");
    if (status.st_size == 0) return;
    const auto size = static_cast<std::size_t>(status.st_size);
    void* begin = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, handle, 0);
    if (begin == MAP_FAILED) throw fail(std::generic_category().message(errno));
    bytes_ = {static_cast<const char*>(begin), size};
}

MappedFile::~MappedFile() {
    if (!bytes_.empty()) munmap(const_cast<char*>(bytes_.data()), bytes_.size());
}

DemonstrationFile::DemonstrationFile(std::filesystem::path file) : file_(std::move(file)), mapped_(file_) {
    const std::string_view bytes = mapped_.bytes();
    if (isHdf5(bytes))
        found_ = readHdf5Parts(bytes);
    else if (isMcap(bytes))
        found_ = readMcapParts(bytes);
    else
        fail("it is not a file that `touchstone export` wrote, or its beginning was changed");
    const auto changed = [&](const std::string& part) {
        return std::find(found_.changed.begin(), found_.changed.end(), part) != found_.changed.end();
    };
    if (has(kManifestPart) && !changed(kManifestPart))
        manifest_ = engine::parseJson(file_, std::string(part(kManifestPart)));
    for (const std::string& part : found_.changed)
        if (part != kManifestPart) fail(changeIn(part));
    if (changed(kManifestPart)) fail("the manifest was changed after the export");
    if (!found_.damage.empty()) fail(found_.damage);
    if (!manifest_.is_object() || !manifest_.contains("version"))
        fail("it has no demonstrations that `touchstone export` wrote");
    if (manifest_["version"] != 1) fail("its version is unknown: use the program that wrote it");
}

void DemonstrationFile::fail(const std::string& what) const {
    throw std::runtime_error(file_.string() + ": " + engine::escaped(what));
}

std::string_view DemonstrationFile::part(const std::string& name) const {
    const auto found = found_.parts.find(name);
    if (found == found_.parts.end()) fail("it lacks the part " + engine::escaped(name));
    return found->second;
}

Views DemonstrationFile::views(const Demonstration& demonstration, std::size_t& messages) const {
    return isHdf5(mapped_.bytes()) ? hdf5Views(demonstration) : mcapViews(demonstration, messages);
}

/// Says what was changed in a part, as closely as the other parts allow.
std::string DemonstrationFile::changeIn(const std::string& part) const {
    const std::string name = engine::escaped(part);
    if (part.starts_with("files/"))
        return "the scene or mesh file " + name.substr(name.rfind('/') + 1) + " in it was changed after the export";
    std::string what = name + " was changed after the export";
    const std::string folder = part.substr(0, part.rfind('/') + 1);
    const auto intact = [&](const std::string& other) {
        return has(other) && std::find(found_.changed.begin(), found_.changed.end(), other) == found_.changed.end();
    };
    if (part == folder + "recording.json" && manifest_.is_object() && manifest_.contains("demonstrations") &&
        manifest_["demonstrations"].is_array()) {
        for (const json& demo : manifest_["demonstrations"])
            if (demo.is_object() && demo.contains("name") && demo.contains("settings") &&
                demo["name"] == folder.substr(5, folder.size() - 6))
                if (const std::string key = changedSetting(demo["settings"], found_.parts.at(part)); !key.empty())
                    what += ": the setting " + key + " differs";
    } else if (part == folder + "ticks" && intact(folder + "chain") && intact(folder + "recording.json")) {
        // The chain says where: every link follows from its own row and the link before.
        const std::string_view stored = found_.parts.at(folder + "chain");
        const auto chain = chainOf(found_.parts.at(folder + "recording.json"), found_.parts.at(part));
        for (std::size_t i = 0; i < std::min(chain.size(), stored.size() / sizeof chain[0]); ++i)
            if (std::memcmp(&chain[i], stored.data() + i * sizeof chain[0], sizeof chain[0]) != 0)
                return what + ": row " + std::to_string(i) + " is the first";
    }
    return what;
}

}  // namespace touchstone::sandbox
