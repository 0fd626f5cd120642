#include "haptics/sandbox/session/workspace_file.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "engine/scene/fields.hpp"
#include "haptics/files/output_file.hpp"
#include "haptics/math/numbers.hpp"

namespace touchstone::sandbox {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Options of a device do not change its workspace.
std::string keyOf(const fs::path& scene, const std::string& device) {
    std::error_code error;
    const fs::path whole = fs::absolute(scene, error).lexically_normal();
    std::string name = device.substr(0, device.find(','));
    // What follows the colon is an option, and not a name.
    if (name.find('=') != std::string::npos) name.resize(std::min(name.find(':'), name.size()));
    return name + " in " + (error ? scene : whole).string();
}

std::runtime_error wrong(const fs::path& file, const std::string& what) {
    return std::runtime_error(file.string() + ": " + what + "; correct it or delete the file");
}

json readAll(const fs::path& file) {
    std::ifstream in(file);
    if (!in) return json::object();
    const json all = json::parse(in, nullptr, false);
    if (!all.is_object()) throw wrong(file, "is not a JSON object");
    return all;
}

Workspace fromJson(const fs::path& file, const std::string& key, const json& from) {
    Workspace workspace;
    const auto numbers = [&](const char* field, double* to, std::size_t count) {
        if (!from.contains(field)) return;
        const json& values = from[field];
        const std::string name = "'" + key + "'." + field;
        if (!values.is_array() || values.size() != count)
            throw wrong(file, name + " must be a list of " + std::to_string(count) + " numbers");
        for (std::size_t i = 0; i < count; ++i) {
            const auto number = engine::numberIn(values[i], -kLargestCoordinate, kLargestCoordinate);
            if (!number) throw wrong(file, name + " must be numbers from -1e6 to 1e6");
            to[i] = *number;
        }
    };
    if (!from.is_object()) throw wrong(file, "'" + key + "' must be an object");
    if (from.contains("scale")) {
        const auto scale = engine::numberIn(from["scale"], kSmallestScale, kLargestScale);
        if (!scale) throw wrong(file, "'" + key + "'.scale must be " + rangeWords(kSmallestScale, kLargestScale));
        workspace.scale = *scale;
    }
    numbers("offset_mm", workspace.offset.data(), 3);
    numbers("axes_xyzw", workspace.q_WD.coeffs().data(), 4);
    if (from.contains("clutch_button")) {
        const json& button = from["clutch_button"];
        if (!button.is_number_integer() || button < 0 || button > 32)
            throw wrong(file, "'" + key + "'.clutch_button must be 0 for none to 32");
        const int number = button.get<int>();
        workspace.clutch = number == 0 ? 0 : 1u << (number - 1);
    }
    if (const std::string why = checkWorkspace(workspace); !why.empty()) throw wrong(file, "'" + key + "': " + why);
    return workspace;
}

json toJson(const Workspace& workspace) {
    int button = 0;
    for (int i = 0; i < 32; ++i)
        if (workspace.clutch == 1u << i) button = i + 1;
    const Vec3& o = workspace.offset;
    const auto& q = workspace.q_WD.coeffs();
    return {{"scale", workspace.scale},
            {"offset_mm", {o.x(), o.y(), o.z()}},
            {"axes_xyzw", {q.x(), q.y(), q.z(), q.w()}},
            {"clutch_button", button}};
}

}  // namespace

WorkspaceFile::WorkspaceFile(fs::path folder) : file_(folder.empty() ? fs::path() : folder / "workspaces.json") {}

Workspace WorkspaceFile::load(const fs::path& scene, const std::string& device) const {
    const std::string key = keyOf(scene, device);
    if (const auto found = changed_.find(key); found != changed_.end()) return found->second;
    if (file_.empty()) return {};
    const json all = readAll(file_);
    return all.contains(key) ? fromJson(file_, key, all[key]) : Workspace{};
}

void WorkspaceFile::save(const fs::path& scene, const std::string& device, const Workspace& workspace) {
    const std::string key = keyOf(scene, device);
    changed_[key] = workspace;
    if (file_.empty()) return;
    json all = readAll(file_);
    all[key] = toJson(workspace);
    std::error_code error;
    fs::create_directories(file_.parent_path(), error);
    writeFile(file_, "the workspace of the device", all.dump(2) + "\n");
}

}  // namespace touchstone::sandbox
