#include "engine/scene/cad_parts.hpp"

#include <cstring>
#include <type_traits>

namespace touchstone::engine {
namespace {

constexpr std::string_view kCadFormat = "touchstone cad 1\n";

/// Appends values to bytes. The same list of fields serves both directions.
class CadWriter {
  public:
    template <class T>
    void operator()(const T& value) {
        if constexpr (std::is_same_v<T, std::string>) {
            count(value.size());
            bytes += value;
        } else {
            bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
        }
    }
    template <class T>
    void operator()(const std::optional<T>& value) {
        (*this)(value.has_value());
        if (value) (*this)(*value);
    }
    template <class T, class Each>
    void list(const std::vector<T>& values, const Each& each) {
        count(values.size());
        for (const T& value : values) each(*this, value);
    }
    template <class T>
    void plain(const std::vector<T>& values) {
        count(values.size());
        bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
    }

    std::string bytes{kCadFormat};

  private:
    void count(std::size_t n) { (*this)(std::uint64_t(n)); }
};

class CadReader {
  public:
    explicit CadReader(std::string_view bytes) : bytes_(bytes) {}

    template <class T>
    void operator()(T& value) {
        if constexpr (std::is_same_v<T, std::string>) {
            const std::size_t size = count(1);
            value.assign(bytes_.substr(0, size));
            bytes_.remove_prefix(size);
        } else {
            take(&value, sizeof value);
        }
    }
    template <class T>
    void operator()(std::optional<T>& value) {
        std::uint8_t present = 0;
        (*this)(present);
        if (present) (*this)(value.emplace());
    }
    template <class T, class Each>
    void list(std::vector<T>& values, const Each& each) {
        const std::size_t size = count(1);
        for (std::size_t i = 0; i < size && !failed; ++i) each(*this, values.emplace_back());
    }
    template <class T>
    void plain(std::vector<T>& values) {
        values.resize(count(sizeof(T)));
        take(values.data(), values.size() * sizeof(T));
    }

    bool finished() const { return !failed && bytes_.empty(); }
    bool failed = false;

  private:
    /// The number of items that follow, each of at least `size` bytes.
    std::size_t count(std::size_t size) {
        std::uint64_t n = 0;
        take(&n, sizeof n);
        if (n > bytes_.size() / size) failed = true;
        return failed ? 0 : std::size_t(n);
    }
    void take(void* to, std::size_t size) {
        if (size > bytes_.size()) failed = true;
        if (failed || size == 0) return;
        std::memcpy(to, bytes_.data(), size);
        bytes_.remove_prefix(size);
    }

    std::string_view bytes_;
};

template <class Archive, class Assembly>
void fields(Archive& archive, Assembly& assembly) {
    archive(assembly.name);
    archive(assembly.schema);
    archive(assembly.unit);
    archive(assembly.metersPerUnit);
    archive.list(assembly.shapes, [](Archive& a, auto& shape) {
        a.plain(shape.faces);
        a.plain(shape.vertices);
        a.plain(shape.triangles);
        a(shape.clearance);
        a(shape.asked);
        a(shape.deviation);
        a(shape.volume);
        a(shape.limited);
        a(shape.problem);
    });
    archive.list(assembly.parts, [](Archive& a, auto& part) {
        a(part.name);
        a(part.path);
        a(part.shape);
        a(part.placement);
        a(part.color);
    });
    archive.list(assembly.notes, [](Archive& a, auto& note) { a(note); });
}

/// Whether all indices are within what they point to.
bool isSound(const CadAssembly& assembly) {
    for (const CadShape& shape : assembly.shapes) {
        std::uint64_t count = 0;
        for (const CadFace& face : shape.faces) count += face.triangles;
        if (count != shape.triangles.size()) return false;
        for (const auto& triangle : shape.triangles)
            for (const std::uint32_t corner : triangle)
                if (corner >= shape.vertices.size()) return false;
    }
    for (const CadPart& part : assembly.parts)
        if (part.shape >= assembly.shapes.size()) return false;
    return true;
}

}  // namespace

const char* name(CadSurface surface) {
    constexpr std::array kNames{"plane", "cylinder", "cone", "sphere", "torus", "helicoid", "free-form surface"};
    return kNames[std::size_t(surface)];
}

std::string cadBytes(std::span<const CadAssembly> assemblies) {
    CadWriter writer;
    writer(std::uint64_t(assemblies.size()));
    for (const CadAssembly& assembly : assemblies) fields(writer, assembly);
    return std::move(writer.bytes);
}

std::optional<std::vector<CadAssembly>> cadFromBytes(std::string_view bytes) {
    if (!bytes.starts_with(kCadFormat)) return {};
    CadReader reader(bytes.substr(kCadFormat.size()));
    std::vector<CadAssembly> assemblies;
    std::uint64_t count = 0;
    reader(count);
    for (std::uint64_t i = 0; i < count && !reader.failed; ++i) fields(reader, assemblies.emplace_back());
    if (!reader.finished()) return {};
    for (const CadAssembly& assembly : assemblies)
        if (!isSound(assembly)) return {};
    return assemblies;
}

}  // namespace touchstone::engine
