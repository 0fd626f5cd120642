#include <algorithm>
#include <array>

#include "engine/scene/mesh_readers.hpp"
#include "engine/scene/text_cursor.hpp"

namespace touchstone::engine {
namespace {

template <std::size_t n>
using Words = std::array<std::string_view, n>;

// Statements that do not affect the surface. A name extends over the whole line and may end with a backslash.
constexpr Words<6> kNames{"o", "g", "s", "usemtl", "mtllib", "usemap"};
constexpr Words<2> kAttributes{"vt", "vn"};
constexpr Words<20> kFreeForm{"vp",   "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim",
                              "hole", "scrv",   "sp",  "end",  "con",  "bzp",  "bsp",   "cdc",  "cdp",  "res"};

template <std::size_t n>
bool isOneOf(const Words<n>& known, std::string_view word) {
    return std::find(known.begin(), known.end(), word) != known.end();
}

class ObjReader {
  public:
    ObjReader(std::string_view text, PolygonMesh& mesh) : text_(text), mesh_(mesh) { mesh.countVerticesFrom(1); }

    void read() {
        while (text_.nextLine()) {
            line_ = text_.line();
            continued_ = false;
            statement();
        }
    }

  private:
    void statement() {
        const std::string_view given = text_.word();
        if (given.empty() || given.front() == '#') return;
        keyword_ = given;
        for (char& c : keyword_) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
        if (keyword_ == "v")
            vertex();
        else if (keyword_ == "f" || keyword_ == "fo")  // `fo` in files older than version 3
            face();
        else if (!isOneOf(kNames, keyword_))
            skip(given);
    }

    /// The next word of the statement, which continues on the next line after a backslash; empty at its end.
    std::string_view word() {
        for (;;) {
            if (continued_ && !text_.nextLine()) return {};
            continued_ = false;
            std::string_view found = text_.word();
            if (!found.empty() && found.front() == '#') {
                text_.rest();
                return {};
            }
            if (!found.empty() && found.back() == '\\' && text_.atLineEnd()) {
                continued_ = true;
                found.remove_suffix(1);
            }
            if (!found.empty() || !continued_) return found;
        }
    }

    void vertex() {
        std::array<double, 7> values{};
        std::size_t count = 0;
        for (std::string_view given = word(); !given.empty(); given = word()) {
            const std::optional<double> value = numberIn(given);
            if (!value) refuse(quote(given) + " is not a number; write it with a decimal point and no unit");
            if (count == values.size()) refuse("a vertex has more than 7 numbers; write x y z");
            if (count < 3) mesh_.wrote(*value, given);
            values[count++] = *value;
        }
        // x y z alone, with a weight, with an RGB color or with an RGBA color.
        if (count != 3 && count != 4 && count != 6 && count != 7)
            refuse("a vertex has " + std::to_string(count) + (count == 1 ? " number" : " numbers") + "; write x y z");
        if (count == 4 && values[3] != 1) note("vertex weights are ignored, since faces do not use them");
        mesh_.addVertex({values[0], values[1], values[2]});
    }

    void face() {
        corners_.clear();
        for (std::string_view given = word(); !given.empty(); given = word()) corners_.push_back(corner(given));
        mesh_.addFace(corners_, line_);
    }

    /// The vertex of v, v/vt, v//vn or v/vt/vn. Texture coordinates and normals need not exist.
    std::uint32_t corner(std::string_view given) const {
        std::int64_t vertex = 0;
        std::string_view rest = given;
        for (int part = 0; part < 3 && (part == 0 || !rest.empty()); ++part) {
            const std::size_t slash = std::min(rest.find('/'), rest.size());
            const std::string_view digits = rest.substr(0, slash);
            rest.remove_prefix(std::min(slash + 1, rest.size()));
            if (part > 0 && digits.empty()) continue;
            const std::optional<std::int64_t> index = integerIn(digits);
            if (!index) refuse(quote(given) + " is not a corner of a face; write it as v, v/vt, v//vn or v/vt/vn");
            if (part == 0) vertex = *index;
        }
        if (!rest.empty()) refuse(quote(given) + " has more than three indices; write it as v/vt/vn");
        if (vertex == 0) refuse("refers to vertex 0, but OBJ counts from 1; export the part again");
        const auto known = static_cast<std::int64_t>(mesh_.vertexCount());
        if (vertex < -known)
            refuse("refers to vertex " + std::to_string(vertex) + ", but only " + std::to_string(known) +
                   " vertices precede it; export the part again");
        if (vertex > UINT32_MAX)
            refuse("refers to vertex " + std::to_string(vertex) + ", which is too large; export the part again");
        return static_cast<std::uint32_t>(vertex < 0 ? known + vertex : vertex - 1);
    }

    void skip(std::string_view given) {
        if (keyword_ == "l" || keyword_ == "p")
            note("lines and points are ignored, since only faces form a surface");
        else if (isOneOf(kFreeForm, keyword_))
            note("free-form curves and surfaces are ignored; export the part as polygons");
        else if (keyword_ == "call")
            note("the file included by this line is ignored; merge the two files");
        else if (!isOneOf(kAttributes, keyword_))
            unknown(given);
        while (!word().empty()) {
        }
    }

    /// All unknown statements share one note, which quotes the first one.
    void unknown(std::string_view given) {
        if (firstUnknown_.empty()) firstUnknown_ = "unknown statements are ignored, for example " + quote(given);
        note(firstUnknown_);
    }

    void note(std::string_view what) { mesh_.note(atLine(line_), what); }
    [[noreturn]] void refuse(const std::string& problem) const { mesh_.refuse(atLine(line_), problem); }

    TextCursor text_;
    PolygonMesh& mesh_;
    std::uint64_t line_ = 0;  // first line of the statement
    bool continued_ = false;
    std::string keyword_, firstUnknown_;
    std::vector<std::uint32_t> corners_;
};

}  // namespace

void readObj(std::string_view bytes, PolygonMesh& mesh) { ObjReader(bytes, mesh).read(); }

}  // namespace touchstone::engine
