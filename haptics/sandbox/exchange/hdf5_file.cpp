// Demonstrations as HDF5, in the layout that robomimic reads. The library writes; reading back needs only the places of
// the arrays, which the file names at its end: every byte is checked before anything is believed.
#include <hdf5.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "haptics/files/output_file.hpp"
#include "haptics/math/hash.hpp"
#include "haptics/sandbox/exchange/demonstration_file.hpp"
#include "haptics/sandbox/record/tick_file.hpp"

namespace touchstone::sandbox {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

// The user block, which HDF5 leaves to the program: one line, padded with zeros, that says how long the file is and
// where its seal lies: the list of all arrays with their places and hashes.
constexpr std::size_t kUserBlock = 512;
constexpr std::string_view kMark = "Touchstone demonstrations 1, bytes ";
constexpr const char* kSealPart = "seal.json";
constexpr std::string_view kSignature("\x89HDF\r\n\x1a\n", 8);

std::string hashText(std::string_view bytes) { return hexadecimal(Hash().add(bytes.data(), bytes.size()).value()); }

std::string userBlock(std::uint64_t size, std::uint64_t seal, std::uint64_t sealSize, const std::string& hash) {
    std::string block = std::string(kMark) + std::to_string(size) + ", seal " + std::to_string(seal) + " " +
                        std::to_string(sealSize) + " " + hash + "\n";
    block.resize(kUserBlock, '\0');
    return block;
}

/// An object of the library, closed at the end of its scope.
class Handle {
  public:
    Handle(hid_t id, herr_t (*closing)(hid_t)) : id_(id), close_(closing) {
        if (id_ < 0) throw std::runtime_error("");  // Hdf5Writer says which file
    }
    ~Handle() {
        if (id_ >= 0) close_(id_);
    }
    Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
    Handle& operator=(Handle&&) = delete;
    operator hid_t() const { return id_; }
    /// Closes now; false if that failed, as on a full disk.
    bool close() { return close_(std::exchange(id_, -1)) >= 0; }

  private:
    hid_t id_;
    herr_t (*close_)(hid_t);
};

void require(herr_t result) {
    if (result < 0) throw std::runtime_error("");
}

/// A type of the library for one in NumPy's notation; a truth value as h5py writes it.
Handle typeFor(std::string_view type) {
    if (type == "|b1") {
        Handle boolean(H5Tenum_create(H5T_STD_I8LE), H5Tclose);
        const signed char no = 0, yes = 1;
        require(H5Tenum_insert(boolean, "FALSE", &no));
        require(H5Tenum_insert(boolean, "TRUE", &yes));
        return boolean;
    }
    const hid_t plain = type == "<f8"   ? H5T_IEEE_F64LE
                        : type == "<i4" ? H5T_STD_I32LE
                        : type == "<u4" ? H5T_STD_U32LE
                        : type == "<u8" ? H5T_STD_U64LE
                                        : H5T_STD_U8LE;
    return {H5Tcopy(plain), H5Tclose};
}

Handle tickType() {
    Handle row(H5Tcreate(H5T_COMPOUND, tickRowBytes()), H5Tclose);
    std::size_t offset = 0;
    for (const TickField& field : tickFields()) {
        require(H5Tinsert(row, field.name, offset, typeFor(field.type())));
        offset += field.size();
    }
    return row;
}

void setText(hid_t object, const char* name, const std::string& text) {
    const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
    require(H5Tset_size(type, H5T_VARIABLE));
    require(H5Tset_cset(type, H5T_CSET_UTF8));
    const Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    const char* value = text.c_str();
    require(H5Awrite(attribute, type, &value));
}

template <class T>
void setNumber(hid_t object, const char* name, hid_t type, T value) {
    Handle space(H5Screate(H5S_SCALAR), H5Sclose);
    Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
    require(H5Awrite(attribute, type, &value));
}

class Hdf5Writer final : public DemonstrationWriter {
  public:
    explicit Hdf5Writer(const std::filesystem::path& file) : out_(file, "the demonstrations") {
        H5dont_atexit();  // at exit the library would crash over a file that it could not write
        H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // errors become one sentence
        guarded([&] {
            Handle creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
            require(H5Pset_userblock(creation, kUserBlock));
            file_.emplace(H5Fcreate(out_.temporary().c_str(), H5F_ACC_TRUNC, creation, H5P_DEFAULT), H5Fclose);
            data_.emplace(H5Gcreate2(*file_, "data", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
        });
    }

    void addFile(const std::string& part, std::string_view bytes) override {
        guarded([&] { write(part, typeFor("|u1"), {bytes.size()}, bytes); });
    }

    void add(const Demonstration& demo) override {
        guarded([&] {
            const Handle group(H5Gcreate2(*data_, demo.name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
            setNumber(group, "num_samples", H5T_NATIVE_INT64, static_cast<std::int64_t>(demo.ticks()));
            setNumber(group, "penetration_mm", H5T_NATIVE_DOUBLE, demo.penetration);
            setText(group, "scene", demo.scenes.front().file.filename().string());
            setText(group, "device", demo.device);
            write(partOf(demo.name, "recording.json"), typeFor("|u1"), {demo.notes.size()}, demo.notes);
            for (const Array& array : arraysOf(demo)) {
                std::vector<hsize_t> shape{demo.ticks()};
                if (array.name.starts_with("obs/") || array.width > 1) shape.push_back(array.width);
                const Handle written = write(partOf(demo.name, array.name),
                                             *array.type ? typeFor(array.type) : tickType(), shape, array.bytes);
                setText(written, "help", array.help);
            }
            require(H5Lcreate_hard(group, "obs/wrench", group, "wrench", H5P_DEFAULT, H5P_DEFAULT));
        });
        total_ += demo.ticks();
        if (!demo.goal.is_null()) masks_[demo.goalMet() ? "goal_met" : "goal_missed"].push_back(demo.name);
        if (environment_.is_null())
            environment_ = {{"env_name", demo.scenes.front().file.stem().string()},
                            {"type", 2},  // robomimic's number of environments with the signatures of Gym
                            {"env_kwargs",
                             {{"scene", demo.scenes.front().file.filename().string()},
                              {"scene_hash", demo.scenes.front().hash},
                              {"goal", demo.goal},
                              {"settings", demo.settings}}}};
    }

    void finish(const ordered_json& manifest) override {
        guarded([&] {
            setNumber(*data_, "total", H5T_NATIVE_INT64, static_cast<std::int64_t>(total_));
            setText(*data_, "env_args", environment_.dump());
            for (const auto& [name, demos] : masks_) writeNames("mask/" + name, demos);
            const std::string text = manifest.dump(1);
            write(kManifestPart, typeFor("|u1"), {text.size()}, text);
            // Place and size of the seal must not depend on the hash in it, which is that of all other bytes.
            std::string seal = sealText(std::string(16, '0'));
            write(kSealPart, typeFor("|u1"), {seal.size()}, seal);
            data_.reset();
            require(file_->close() ? 0 : -1);
            file_.reset();
            stamp();
        });
        out_.close();
    }

  private:
    struct Extent {
        std::string name;
        std::uint64_t offset, size;
        std::string hash;
    };

    /// The library does not say what the system said, and a full disk is the likely reason.
    template <class Work>
    void guarded(Work&& work) {
        errno = 0;
        try {
            work();
        } catch (const std::runtime_error&) {
            if (errno == 0) errno = EIO;
            out_.fail();
        }
    }

    Handle write(const std::string& part, const Handle& type, const std::vector<hsize_t>& shape,
                 std::string_view bytes) {
        const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
        const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
        require(H5Pset_create_intermediate_group(links, 1));
        const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
        require(H5Pset_obj_track_times(creation, false));
        require(H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY));
        require(H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER));
        Handle set(H5Dcreate2(*file_, part.c_str(), type, space, links, creation, H5P_DEFAULT), H5Dclose);
        if (bytes.empty()) return set;
        require(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()));
        const haddr_t offset = H5Dget_offset(set);
        require(offset == HADDR_UNDEF ? -1 : 0);
        extents_.push_back({part, offset, bytes.size(), hashText(bytes)});
        return set;
    }

    void writeNames(const std::string& part, const std::vector<std::string>& names) {
        std::size_t width = 0;
        for (const std::string& name : names) width = std::max(width, name.size());
        std::string bytes;
        for (const std::string& name : names) bytes += name + std::string(width - name.size(), '\0');
        const Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
        require(H5Tset_size(type, width));
        require(H5Tset_strpad(type, H5T_STR_NULLPAD));
        write(part, type, {names.size()}, bytes);
    }

    std::string sealText(const std::string& rest) const {
        ordered_json parts = ordered_json::array();
        for (const Extent& extent : extents_)
            if (extent.name != kSealPart) parts.push_back({extent.name, extent.offset, extent.size, extent.hash});
        return ordered_json{{"rest", rest}, {"parts", parts}}.dump();
    }

    /// Writes the hash of everything outside the parts into the seal, and the place of the seal into the user block.
    void stamp();

    OutputFile out_;
    std::optional<Handle> file_, data_;
    std::vector<Extent> extents_;
    std::uint64_t total_ = 0;
    std::map<std::string, std::vector<std::string>> masks_;
    ordered_json environment_;
};

/// Hash of the bytes after the user block that belong to no part. Empty if parts lie outside the file or overlap.
std::string hashOfRest(std::string_view file, std::vector<std::pair<std::uint64_t, std::uint64_t>> extents) {
    std::sort(extents.begin(), extents.end());
    Hash hash;
    std::uint64_t at = kUserBlock;
    extents.emplace_back(file.size(), 0);
    for (const auto& [offset, size] : extents) {
        if (offset < at || offset > file.size() || size > file.size() - offset) return {};
        hash.add(file.data() + at, offset - at);
        at = offset + size;
    }
    return hexadecimal(hash.value());
}

void Hdf5Writer::stamp() {
    std::vector<std::pair<std::uint64_t, std::uint64_t>> extents;
    for (const Extent& extent : extents_) extents.emplace_back(extent.offset, extent.size);
    const Extent& place = extents_.back();  // of the seal
    std::uint64_t size = 0;
    std::string seal;
    {
        const MappedFile mapped(out_.temporary());
        size = mapped.bytes().size();
        seal = sealText(hashOfRest(mapped.bytes(), extents));
    }
    RandomAccessFile file(out_.temporary(), true);
    file.write(seal, place.offset);
    file.write(userBlock(size, place.offset, place.size, hashText(seal)), 0);
}

/// The numbers and the hash of the user block; false if it is not as userBlock() writes it.
bool readUserBlock(std::string_view block, std::uint64_t (&numbers)[3], std::string& hash) {
    const char* at = block.data() + kMark.size();
    const char* end = block.data() + block.size();
    for (std::uint64_t& number : numbers) {
        while (at < end && (*at < '0' || *at > '9')) ++at;
        const auto [next, error] = std::from_chars(at, end, number);
        if (error != std::errc()) return false;
        at = next;
    }
    if (end - at < 17) return false;
    hash.assign(at + 1, 16);
    return block == userBlock(numbers[0], numbers[1], numbers[2], hash);
}

}  // namespace

std::unique_ptr<DemonstrationWriter> makeHdf5Writer(const std::filesystem::path& file) {
    return std::make_unique<Hdf5Writer>(file);
}

Views hdf5Views(const Demonstration& demo) {
    Views views;
    for (Array& array : arraysOf(demo)) views.emplace_back(partOf(demo.name, array.name), std::move(array.bytes));
    return views;
}

bool isHdf5(std::string_view file) {
    return file.starts_with(kMark) || file.substr(std::min(kUserBlock, file.size())).starts_with(kSignature);
}

FoundParts readHdf5Parts(std::string_view file) {
    FoundParts found;
    std::uint64_t numbers[3];
    std::string hash;
    if (file.size() < kUserBlock || !readUserBlock(file.substr(0, kUserBlock), numbers, hash)) {
        found.damage = file.size() < kUserBlock ? "it is cut off within its first 512 bytes"
                                                : "its first 512 bytes were changed, or another program wrote it";
        return found;
    }
    const auto& [size, sealOffset, sealSize] = numbers;
    if (file.size() < size) {
        found.damage =
            "it is cut off: it has " + std::to_string(file.size()) + " of " + std::to_string(size) + " bytes";
        return found;
    }
    if (file.size() > size || sealOffset > size || sealSize > size - sealOffset) {
        found.damage = "bytes were added after the export, as by a split into sets: verify the file of " +
                       std::to_string(size) + " bytes that was exported";
        return found;
    }
    const std::string_view seal = file.substr(sealOffset, sealSize);
    const json list = json::parse(seal, nullptr, false);
    if (hashText(seal) != hash || !list.is_object()) {
        found.damage = "its list of parts (seal.json) was changed after the export";
        return found;
    }
    std::vector<std::pair<std::uint64_t, std::uint64_t>> extents{{sealOffset, sealSize}};
    try {
        for (const json& entry : list.at("parts")) {
            const auto offset = entry.at(1).get<std::uint64_t>(), length = entry.at(2).get<std::uint64_t>();
            if (offset > size || length > size - offset) throw std::out_of_range("");
            const std::string_view bytes = file.substr(offset, length);
            extents.emplace_back(offset, length);
            const auto name = entry.at(0).get<std::string>();
            found.parts[name] = bytes;
            if (hashText(bytes) != entry.at(3).get<std::string>()) found.changed.push_back(name);
        }
        if (hashOfRest(file, extents) != list.at("rest").get<std::string>())
            found.damage = "its structure (names, shapes and attributes) was changed after the export";
    } catch (const std::exception&) {
        found.damage = "its list of parts (seal.json) is broken";
    }
    return found;
}

}  // namespace touchstone::sandbox
