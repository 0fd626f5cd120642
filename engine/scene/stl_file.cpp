#include <bit>
#include <cstring>

#include "engine/scene/mesh_readers.hpp"
#include "engine/scene/text_cursor.hpp"

namespace touchstone::engine {
namespace {

static_assert(std::endian::native == std::endian::little, "binary STL is read as the processor stores it");

constexpr std::size_t kHeader = 84, kTriangle = 50, kNormal = 12;

/// Compares a word in any case with one in lower case.
bool is(std::string_view word, std::string_view lowerCase) {
    return word.size() == lowerCase.size() &&
           std::equal(word.begin(), word.end(), lowerCase.begin(), [](char a, char b) { return (a | 0x20) == b; });
}

/// Size of a binary file according to its header; 0 if the file is shorter than a header.
std::uint64_t binarySize(std::string_view bytes) {
    std::uint32_t triangles = 0;
    if (bytes.size() < kHeader) return 0;
    std::memcpy(&triangles, bytes.data() + kHeader - sizeof triangles, sizeof triangles);
    return kHeader + std::uint64_t{triangles} * kTriangle;
}

/// Whether the file is ASCII STL. The word `solid` alone does not decide, since binary headers may start with it.
bool isText(std::string_view bytes) {
    TextCursor text(bytes);
    if (!is(text.nextWord(), "solid")) return false;
    text.rest();
    const std::string_view next = text.nextWord();
    return is(next, "facet") || is(next, "endsolid") || bytes.find('\0') == bytes.npos;
}

class AsciiStl {
  public:
    AsciiStl(std::string_view bytes, PolygonMesh& mesh) : text_(bytes), mesh_(mesh) {}

    void read() {
        std::uint64_t solid = 0, facets = 0;  // line of the current solid (0: none), and number of its facets
        for (std::string_view word = text_.nextWord(); !word.empty(); word = text_.nextWord()) {
            if (is(word, "solid") && !solid) {
                solid = text_.line();
                facets = 0;
                text_.rest();
            } else if (is(word, "facet") && solid) {
                facet();
                ++facets;
            } else if (is(word, "endsolid") && solid) {
                if (!facets) mesh_.note(atLine(solid), "this solid has no facet");
                solid = 0;
                text_.rest();
            } else if (!solid) {
                mesh_.note(atLine(text_.line()), "everything from here on is ignored, since no solid begins here");
                return;
            } else {
                refuse(quote(word) + " is not a facet or the end of the solid; export the part again");
            }
        }
        if (solid) mesh_.note(atLine(solid), "this solid has no end, so the file may be truncated");
    }

  private:
    void facet() {
        const std::uint64_t line = text_.line();
        constexpr int kMaxWords = 4;  // `normal` and its three numbers, which are ignored
        std::string_view word = text_.nextWord();
        for (int i = 0; i < kMaxWords && !word.empty() && !is(word, "outer"); ++i) word = text_.nextWord();
        expect(word, "outer");
        expect(text_.nextWord(), "loop");
        corners_.clear();
        for (word = text_.nextWord(); is(word, "vertex"); word = text_.nextWord()) {
            corners_.push_back(static_cast<std::uint32_t>(mesh_.vertexCount()));
            glm::dvec3 vertex;
            for (int k = 0; k < 3; ++k) {
                const std::string_view given = text_.nextWord();
                vertex[k] = number(given);
                mesh_.wrote(vertex[k], given);
            }
            mesh_.addVertex(vertex);
        }
        expect(word, "endloop");
        expect(text_.nextWord(), "endfacet");
        mesh_.addFace(corners_, line);
    }

    double number(std::string_view word) const {
        const std::optional<double> value = numberIn(word);
        if (!value && word.empty()) expect(word, "number");
        if (!value) refuse(quote(word) + " is not a number; write it with a decimal point and no unit");
        return *value;
    }

    void expect(std::string_view word, const char* what) const {
        if (word.empty()) refuse("the file ends within a facet; export or copy it again");
        if (!is(word, what)) refuse(quote(word) + " was found instead of '" + what + "'; export the part again");
    }

    [[noreturn]] void refuse(const std::string& problem) const { mesh_.refuse(atLine(text_.line()), problem); }

    TextCursor text_;
    PolygonMesh& mesh_;
    std::vector<std::uint32_t> corners_;
};

void readBinary(std::string_view bytes, PolygonMesh& mesh) {
    mesh.countFacesIn("triangle");
    mesh.storesFloats();
    const std::uint64_t size = binarySize(bytes);
    for (std::size_t at = kHeader; at < size; at += kTriangle) {
        std::uint32_t corners[3];
        for (std::size_t k = 0; k < 3; ++k) {
            float vertex[3];
            std::memcpy(vertex, bytes.data() + at + kNormal + k * sizeof vertex, sizeof vertex);
            corners[k] = static_cast<std::uint32_t>(mesh.vertexCount());
            mesh.addVertex({vertex[0], vertex[1], vertex[2]});
        }
        mesh.addFace(corners, (at - kHeader) / kTriangle + 1);
    }
    if (size < bytes.size())
        mesh.note({}, std::to_string(bytes.size() - size) + " bytes after the " +
                          std::to_string((size - kHeader) / kTriangle) +
                          " triangles declared in the header are ignored");
}

}  // namespace

void readStl(std::string_view bytes, PolygonMesh& mesh) {
    const std::uint64_t size = binarySize(bytes);
    // A matching size proves a binary file: text in place of the count gives sizes far beyond any file.
    if (size == bytes.size()) return readBinary(bytes, mesh);
    if (isText(bytes)) return AsciiStl(bytes, mesh).read();
    if (size == 0)
        mesh.refuse({},
                    "is neither ASCII STL, which begins with 'solid', nor long enough to be binary STL; "
                    "export the part again");
    if (size > bytes.size())
        mesh.refuse({}, "is truncated or not STL: as binary STL it would have " +
                            std::to_string((size - kHeader) / kTriangle) + " triangles, but only " +
                            std::to_string((bytes.size() - kHeader) / kTriangle) +
                            " are present; export or copy it again");
    readBinary(bytes, mesh);
}

}  // namespace touchstone::engine
