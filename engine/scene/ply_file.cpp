#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "engine/scene/mesh_readers.hpp"
#include "engine/scene/text_cursor.hpp"

namespace touchstone::engine {
namespace {

enum class Scalar { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64 };
enum class Encoding { Ascii, LittleEndian, BigEndian };

struct ScalarName {
    std::string_view name, alias;
    Scalar type;
};
constexpr ScalarName kScalars[] = {{"char", "int8", Scalar::Int8},        {"uchar", "uint8", Scalar::UInt8},
                                   {"short", "int16", Scalar::Int16},     {"ushort", "uint16", Scalar::UInt16},
                                   {"int", "int32", Scalar::Int32},       {"uint", "uint32", Scalar::UInt32},
                                   {"float", "float32", Scalar::Float32}, {"double", "float64", Scalar::Float64}};

struct Property {
    std::string name;
    Scalar type{};
    std::optional<Scalar> count;  // type of the count of a list; none: not a list
};

struct Element {
    std::string name;
    std::uint64_t count = 0, line = 0;
    std::vector<Property> properties;

    std::size_t indexOf(std::string_view property) const {
        const auto found = std::find_if(properties.begin(), properties.end(),
                                        [&](const Property& known) { return known.name == property; });
        return static_cast<std::size_t>(found - properties.begin());
    }
};

struct Header {
    Encoding encoding = Encoding::Ascii;
    std::vector<Element> elements;
    std::size_t end = 0;  // offset of the data
};

class HeaderReader {
  public:
    HeaderReader(std::string_view bytes, TextCursor& text, PolygonMesh& mesh)
        : bytes_(bytes), text_(text), mesh_(mesh) {}

    Header read() {
        if (!text_.nextLine() || text_.rest() != "ply")
            mesh_.refuse({}, "does not begin with the line 'ply'; export the part as PLY");
        // Binary data may start with LF. The line ending of the first header line decides whether that LF is part of
        // the header.
        const bool endsWithCr = bytes_[text_.nextOffset() - 1] == '\r';
        bool hasFormat = false;
        while (text_.nextLine()) {
            const std::string_view keyword = text_.word();
            if (keyword == "format") {
                format();
                hasFormat = true;
            } else if (keyword == "element") {
                element();
            } else if (keyword == "property") {
                property();
            } else if (keyword == "end_header") {
                if (!hasFormat) refuse("the header has no format line; export the part again");
                header_.end = text_.nextOffset();
                if (endsWithCr && bytes_.substr(header_.end - 2, 2) == "\r\n") --header_.end;
                return std::move(header_);
            } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
                mesh_.note(atLine(text_.line()),
                           "this header line is ignored, since " + quote(keyword) + " is unknown");
            }
        }
        mesh_.refuse({}, "the header does not end; export or copy the file again");
    }

  private:
    void format() {
        const std::string_view name = text_.word(), version = text_.rest();
        if (name == "ascii")
            header_.encoding = Encoding::Ascii;
        else if (name == "binary_little_endian")
            header_.encoding = Encoding::LittleEndian;
        else if (name == "binary_big_endian")
            header_.encoding = Encoding::BigEndian;
        else
            refuse(quote(name) + " is not a PLY format; export the part as ascii or binary");
        if (version != "1.0") refuse("has version " + quote(version) + ", not 1.0; export the part again");
    }

    void element() {
        Element element;
        element.name = text_.word();
        element.line = text_.line();
        const std::string_view count = text_.rest();
        const std::optional<std::int64_t> value = integerIn(count);
        if (element.name.empty() || !value || *value < 0)
            refuse(quote(count) + " is not a valid element count; export the part again");
        for (const Element& other : header_.elements)
            if (other.name == element.name)
                refuse("the element " + quote(element.name) + " is declared twice; export the part again");
        element.count = static_cast<std::uint64_t>(*value);
        header_.elements.push_back(std::move(element));
    }

    void property() {
        if (header_.elements.empty()) refuse("a property precedes all elements; export the part again");
        Property property;
        std::string_view type = text_.word();
        if (type == "list") {
            property.count = scalar(text_.word());
            if (*property.count >= Scalar::Float32)
                refuse("the count of a list has a floating-point type; export the part with whole numbers");
            type = text_.word();
        }
        property.type = scalar(type);
        property.name = text_.rest();
        Element& element = header_.elements.back();
        if (property.name.empty()) refuse("a property has no name; export the part again");
        if (element.indexOf(property.name) < element.properties.size())
            refuse("the property " + quote(property.name) + " is declared twice; export the part again");
        element.properties.push_back(std::move(property));
    }

    Scalar scalar(std::string_view name) const {
        for (const ScalarName& known : kScalars)
            if (name == known.name || name == known.alias) return known.type;
        refuse(quote(name) + " is not a PLY type; export the part again");
    }

    [[noreturn]] void refuse(const std::string& problem) const { mesh_.refuse(atLine(text_.line()), problem); }

    std::string_view bytes_;
    TextCursor& text_;
    PolygonMesh& mesh_;
    Header header_;
};

/// Reads ASCII data: one line per instance of an element.
class AsciiData {
  public:
    AsciiData(TextCursor& text, const PolygonMesh& mesh) : text_(text), mesh_(mesh) {}

    /// False at the end of the data.
    bool begin(const Element&, std::uint64_t) {
        do {
            if (!text_.nextLine()) return false;
        } while (text_.atLineEnd());
        return true;
    }
    void end() const {
        if (!text_.atLineEnd()) refuse("has more values than the header declares properties; export the part again");
    }
    std::uint64_t number() const { return text_.line(); }
    FilePlace place() const { return atLine(number()); }

    double coordinate(Scalar type, PolygonMesh& mesh) {
        const double number = value(type);
        mesh.wrote(number, last_);
        return number;
    }
    double value(Scalar) {
        const std::string_view word = text_.word();
        if (word.empty()) refuse("has fewer values than the header declares properties; export the part again");
        const std::optional<double> value = numberIn(word);
        if (!value) refuse(quote(word) + " is not a number; write it with a decimal point and no unit");
        last_ = word;
        return *value;
    }
    void skip(Scalar type, std::uint64_t count) {
        for (; count > 0; --count) value(type);
    }

    std::string leftover() const {
        return text_.nextWord().empty() ? ""
                                        : "everything from here on is ignored, since the header does not declare it";
    }

  private:
    [[noreturn]] void refuse(const std::string& problem) const { mesh_.refuse(place(), problem); }

    TextCursor& text_;
    const PolygonMesh& mesh_;
    std::string_view last_;  // word of the last value
};

/// Reads binary data of either byte order.
class BinaryData {
  public:
    BinaryData(std::string_view bytes, Encoding encoding, const PolygonMesh& mesh)
        : bytes_(bytes),
          mesh_(mesh),
          swap_((encoding == Encoding::BigEndian) != (std::endian::native == std::endian::big)) {}

    bool begin(const Element& element, std::uint64_t index) {
        element_ = &element;
        index_ = index;
        return !bytes_.empty();
    }
    void end() const {}
    std::uint64_t number() const { return index_; }
    FilePlace place() const { return {element_->name, index_}; }

    double coordinate(Scalar type, PolygonMesh& mesh) {
        if (type == Scalar::Float32) mesh.storesFloats();
        return value(type);
    }
    double value(Scalar type) {
        switch (type) {
            case Scalar::Int8:
                return take<std::int8_t>();
            case Scalar::UInt8:
                return take<std::uint8_t>();
            case Scalar::Int16:
                return take<std::int16_t>();
            case Scalar::UInt16:
                return take<std::uint16_t>();
            case Scalar::Int32:
                return take<std::int32_t>();
            case Scalar::UInt32:
                return take<std::uint32_t>();
            case Scalar::Float32:
                return take<float>();
            case Scalar::Float64:
                break;
        }
        return take<double>();
    }
    void skip(Scalar type, std::uint64_t count) {
        constexpr std::uint64_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
        const std::uint64_t size = kSizes[static_cast<int>(type)];
        if (bytes_.size() / size < count) refuse();
        bytes_.remove_prefix(count * size);
    }

    std::string leftover() const {
        return bytes_.empty() ? "" : std::to_string(bytes_.size()) + " bytes after the data are ignored";
    }

  private:
    template <class T>
    T take() {
        char raw[sizeof(T)];
        if (bytes_.size() < sizeof raw) refuse();
        std::memcpy(raw, bytes_.data(), sizeof raw);
        bytes_.remove_prefix(sizeof raw);
        if (swap_) std::reverse(raw, raw + sizeof raw);
        return std::bit_cast<T>(raw);
    }
    [[noreturn]] void refuse() const { mesh_.refuse(place(), "exceeds the end of the file; export or copy it again"); }

    std::string_view bytes_;
    const PolygonMesh& mesh_;
    bool swap_;
    const Element* element_ = nullptr;
    std::uint64_t index_ = 0;
};

template <class Data>
class ElementReader {
  public:
    ElementReader(Data& data, PolygonMesh& mesh) : data_(data), mesh_(mesh) {}

    void read(const Element& element) {
        if (element.properties.empty()) return;  // such elements occupy no space, whatever their count
        if (element.name == "vertex") {
            std::array<std::size_t, 3> axes;
            for (std::size_t k = 0; k < 3; ++k) {
                const std::string name(1, "xyz"[k]);
                axes[k] = indexOf(element, name);
                if (element.properties[axes[k]].count) refuse(element, "its '" + name + "' is a list");
            }
            instances(element, [&] { vertex(element, axes); });
        } else if (element.name == "face" || element.name == "tristrips") {
            std::size_t list = element.indexOf("vertex_indices");
            if (list == element.properties.size()) list = indexOf(element, "vertex_index");
            if (!element.properties[list].count || element.properties[list].type >= Scalar::Float32)
                refuse(element, "its vertex indices are not a list of whole numbers");
            instances(element, [&] { element.name == "face" ? face(element, list) : strips(element, list); });
        } else {
            if (element.count > 0)
                mesh_.note(atLine(element.line), "the element " + quote(element.name) + " is ignored");
            instances(element, [&] {
                for (const Property& property : element.properties) skip(property);
            });
        }
    }

  private:
    template <class Read>
    void instances(const Element& element, Read read) {
        for (std::uint64_t i = 0; i < element.count; ++i) {
            if (!data_.begin(element, i))
                refuse(element, "the file ends after " + std::to_string(i) + " of its " +
                                    std::to_string(element.count) + " instances");
            read();
            data_.end();
        }
    }

    void vertex(const Element& element, const std::array<std::size_t, 3>& axes) {
        glm::dvec3 position(0);
        for (std::size_t i = 0; i < element.properties.size(); ++i) {
            const auto* axis = std::find(axes.begin(), axes.end(), i);
            if (axis == axes.end())
                skip(element.properties[i]);
            else
                position[static_cast<int>(axis - axes.begin())] = data_.coordinate(element.properties[i].type, mesh_);
        }
        mesh_.addVertex(position);
    }

    void face(const Element& element, std::size_t list) {
        indices(element, list);
        corners_.clear();
        for (const double index : indices_) corners_.push_back(corner(index));
        mesh_.addFace(corners_, data_.number());
    }

    /// A strip has a triangle for each index from the third on, with alternating orientation. -1 ends the strip.
    void strips(const Element& element, std::size_t list) {
        indices(element, list);
        std::uint32_t a = 0, b = 0;
        std::size_t length = 0;
        for (const double index : indices_) {
            if (index == -1) {
                length = 0;
                continue;
            }
            const std::uint32_t c = corner(index);
            const bool isLink = a == b || b == c || c == a;  // a repeated vertex links two strips
            if (++length >= 3 && !isLink) {
                const bool turned = length % 2 == 0;
                mesh_.addFace(turned ? std::array{b, a, c} : std::array{a, b, c}, data_.number());
            }
            a = b;
            b = c;
        }
    }

    void indices(const Element& element, std::size_t list) {
        for (std::size_t i = 0; i < element.properties.size(); ++i) {
            const Property& property = element.properties[i];
            if (i != list) {
                skip(property);
                continue;
            }
            indices_.clear();
            for (std::uint64_t left = count(property); left > 0; --left) indices_.push_back(data_.value(property.type));
        }
    }

    std::uint64_t count(const Property& property) {
        const double count = data_.value(*property.count);
        if (!(count >= 0 && count <= UINT32_MAX && count == std::floor(count)))
            mesh_.refuse(data_.place(), "the count of a list is not a whole number; export the part again");
        return static_cast<std::uint64_t>(count);
    }

    void skip(const Property& property) { data_.skip(property.type, property.count ? count(property) : 1); }

    std::uint32_t corner(double index) const {
        if (!(index >= 0 && index <= UINT32_MAX && index == std::floor(index)))
            mesh_.refuse(data_.place(), "a vertex index is not a non-negative whole number; export the part again");
        return static_cast<std::uint32_t>(index);
    }

    std::size_t indexOf(const Element& element, const std::string& property) const {
        const std::size_t index = element.indexOf(property);
        if (index == element.properties.size()) refuse(element, "it has no property '" + property + "'");
        return index;
    }

    [[noreturn]] void refuse(const Element& element, const std::string& problem) const {
        mesh_.refuse(atLine(element.line),
                     "the element " + quote(element.name) + ": " + problem + "; export the part again");
    }

    Data& data_;
    PolygonMesh& mesh_;
    std::vector<double> indices_;
    std::vector<std::uint32_t> corners_;
};

template <class Data>
void readElements(const Header& header, Data data, PolygonMesh& mesh) {
    ElementReader<Data> reader(data, mesh);
    for (const Element& element : header.elements) reader.read(element);
    if (const std::string left = data.leftover(); !left.empty()) mesh.note({}, left);
}

}  // namespace

void readPly(std::string_view bytes, PolygonMesh& mesh) {
    TextCursor text(bytes);
    const Header header = HeaderReader(bytes, text, mesh).read();
    if (header.encoding == Encoding::Ascii) {
        readElements(header, AsciiData(text, mesh), mesh);
    } else {
        mesh.countFacesIn("face");
        readElements(header, BinaryData(bytes.substr(header.end), header.encoding, mesh), mesh);
    }
}

}  // namespace touchstone::engine
