// OBJ, STL and PLY files of other programs: read, noted or refused, always with the line.
#include <sys/stat.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <clocale>
#include <cmath>

#include "engine/scene/mesh_file.hpp"
#include "tests/engine/scene/gltf_fixture.hpp"

namespace touchstone::mesh_format_tests {

using namespace touchstone::engine;
using namespace touchstone::engine::test;
using Catch::Contains;

namespace {

using Positions = std::vector<glm::vec3>;
using Indices = std::vector<std::uint32_t>;

const Positions kCorners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
const std::string kObj = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", kFace = "f 1 2 3\n";

MeshFile readText(const TemporaryFolder& folder, const std::string& name, const std::string& text) {
    writeFile(folder / name, text);
    return readMeshFile(folder / name, 1);
}

/// The sentence that refuses the file; empty if it is read.
std::string refusal(const TemporaryFolder& folder, const std::string& name, const std::string& text) {
    try {
        readText(folder, name, text);
    } catch (const SceneError& error) {
        return error.what();
    }
    return {};
}

template <class T>
void append(std::string& out, T value, bool bigEndian) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    if (bigEndian) std::reverse(raw, raw + sizeof raw);
    out.append(raw, sizeof raw);
}

std::string stlOf(const std::string& facets) { return "solid my part\n" + facets + "endsolid my part\n"; }
const std::string kFacet =
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";

std::string binaryStl(std::string header, int triangles) {
    header.resize(80, ' ');
    append(header, triangles, false);
    for (int i = 0; i < triangles; ++i) {
        for (const int x : {0, 0, 1, 0, 0, i, 1, 0, i, 0, 1, i}) append(header, static_cast<float>(x), false);
        header += std::string(2, '\0');
    }
    return header;
}

const std::string kPlyHeader =
    "ply\nformat ascii 1.0\ncomment made elsewhere\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kPly = kPlyHeader + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    REQUIRE(at != text.npos);
    return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("OBJ: reads every notation of a number", "[mesh]") {
    const TemporaryFolder folder;
    const MeshFile read = readText(folder, "part.obj",
                                   "v .5 5. 1e-3\nv +1 -.5e+1 1E2\nv 1e-400 -0 17.3\nv +.5e1 007 3.4e-46\n"
                                   "f 1 2 3\nf 1 2 4\n");
    CHECK(read.mesh.positions == Positions{{.5f, 5, 1e-3f}, {1, -5, 100}, {0, 0, 17.3f}, {5, 7, 0}});
    CHECK(read.mesh.indices == Indices{0, 1, 2, 0, 1, 3});
    CHECK(read.notes.empty());
}

TEST_CASE("OBJ: coordinates are rounded to the nearest float", "[mesh]") {
    // -0.000038535900 lies between two floats that differ in the last bit, and is nearer to the second.
    const TemporaryFolder folder;
    const MeshFile read = readText(folder, "part.obj", "v -0.0000385359 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    CHECK(read.mesh.positions[0].x == -0.0000385359f);
}

TEST_CASE("OBJ: faces may refer to missing texture coordinates or normals", "[mesh]") {
    const TemporaryFolder folder;
    for (const std::string face : {"f 1 2 3", "f 1/1 2/2 3/3", "f 1//1 2//2 3//3", "f 1/1/1 2/2/2 3/3/3", "f 1/ 2/ 3/",
                                   "f 1// 2// 3//", "f 1/9/-7 2/9/0 3/9/4", "fo 1 2 3", "F +1 2 3", "f -3 -2 -1"}) {
        CAPTURE(face);
        const MeshFile read = readText(folder, "part.obj", kObj + face);
        CHECK(read.mesh.positions == kCorners);
        CHECK(read.mesh.indices == Indices{0, 1, 2});
        CHECK(read.notes.empty());
    }
}

TEST_CASE("OBJ: reads line ends, indents and continuations of other programs", "[mesh]") {
    const TemporaryFolder folder;
    const std::vector<std::string> texts{
        "\xEF\xBB\xBFv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3",
        "# made elsewhere\r\nv 0 0 0\r\nv 1 0 0 # second\r\nv 0 1 0\r\n\r\nf 1 2 3\r\n",
        "v 0 0 0\rv 1 0 0\rv 0 1 0\rf 1 2 3\r",
        "\t v\t0 0 0  \n v 1 0 0\n\n  v 0 1 0\t\nf  1\t2 3 \n",
        "v 0 \\\n0 0\nv 1 0\\\r\n 0\nv 0 1 0\nf 1 \\ \n2 \\\n3\n",
        "# C:\\parts\\\nmtllib C:\\parts\\\nv 0 0 0\no a\\\nv 1 0 0\nv 0 1 0\ng b\\\nf 1 2 3\n",
        "f 1 2 3\nv 0 0 0 1\nv 1 0 0 0.1 0.2 0.3\nv 0 1 0 0.1 0.2 0.3 1\nusemtl gold\ns off\n",
    };
    for (const std::string& text : texts) {
        CAPTURE(text);
        const MeshFile read = readText(folder, "part.obj", text);
        CHECK(read.mesh.positions == kCorners);
        CHECK(read.mesh.indices == Indices{0, 1, 2});
        CHECK(read.notes.empty());
    }
}

TEST_CASE("OBJ: notes skipped statements by line, once for each kind", "[mesh]") {
    const TemporaryFolder folder;
    const std::vector<std::pair<std::string, std::string>> cases{
        {"l 1 2\nl 2 3\np 1\n", "part.obj: line 5: lines and points are ignored"},
        {"f 1 2\nf 1 1 2\nf 1 2 1 2\nf\n", "line 5: a face with fewer than three distinct corners is dropped (3 times"},
        {"cstype bezier\ndeg 3\nsurf 0 1 0 1 1 2 \\\n3\nend\n", "line 5: free-form curves and surfaces are ignored"},
        {"bevel on\nlod 3\n", "line 5: unknown statements are ignored, for example 'bevel' (2 times"},
        {"call other.obj\n", "line 5: the file included by this line"},
        {"v 0 0 0 2\n", "line 5: vertex weights are ignored"},
        {"v 2 0 0\nf 1 2 4 2\n", "line 6: a polygon without area is dropped"},
    };
    for (const auto& [text, words] : cases) {
        CAPTURE(text);
        const MeshFile read = readText(folder, "part.obj", kObj + kFace + text);
        CHECK(read.mesh.indices == Indices{0, 1, 2});
        REQUIRE(!read.notes.empty());
        CHECK_THAT(read.notes.front(), Contains(words) && Contains((folder / "part.obj").string()));
        for (const std::string& note : read.notes) CHECK(note.find('\n') == note.npos);
    }
}

TEST_CASE("OBJ: a malformed file is refused with the line", "[mesh]") {
    const TemporaryFolder folder;
    const std::vector<std::pair<std::string, std::string>> cases{
        {kObj + "v 1 0,5 0\n" + kFace, "line 4: '0,5' is not a number"},
        {kObj + "v 1 0 \n" + kFace, "line 4: a vertex has 2 numbers"},
        {kObj + "v 1 0 0 1 1\n" + kFace, "line 4: a vertex has 5 numbers"},
        {kObj + "v 1 0 3.1-e2\n" + kFace, "line 4: '3.1-e2'"},
        {kObj + "f 1 2 4\n", "line 4: refers to vertex 4, but the file has 3"},
        {kObj + "f 1 2 0\n", "line 4: refers to vertex 0"},
        {kObj + "f 1 2 -4\n", "line 4: refers to vertex -4, but only 3"},
        {kObj + "f 1 2 99999999999\n", "line 4: refers to vertex 99999999999"},
        {kObj + "f 1 2 3.0\n", "line 4: '3.0' is not a corner"},
        {kObj + "f 1/a 2 3\n", "line 4: '1/a'"},
        {kObj + "f 1/1/1/1 2 3\n", "line 4: '1/1/1/1' has more than three indices"},
        {kObj + "v nan 0 0\nf 1 2 4\n", "line 5: its vertex 4 is non-finite"},
        {kObj + "v 0 1e300 0\nf 1 2 4\n", "line 5: its vertex 4 is non-finite or beyond 1e12 m"},
        {kObj + "v 0 -1.1e12 0\nf 1 2 4\n", "line 5: its vertex 4"},
        {kObj + "p 1\n", "has no triangles: line 4: lines and points"},
        {"", "is empty"},
        {"\xFF\xFEv", "UTF-16"},
    };
    for (const auto& [text, words] : cases) {
        CAPTURE(text);
        const std::string sentence = refusal(folder, "my part.obj", text);
        CHECK_THAT(sentence, Contains(words) && Contains("my part.obj: "));
        CHECK(sentence.find('\n') == sentence.npos);
    }
    // Scanners write NaN for points that they did not see, without a face.
    CHECK(refusal(folder, "scan.obj", kObj + "v nan nan nan\n" + kFace).empty());
}

TEST_CASE("mesh file: notes that the digits of a part far from the origin are too few", "[mesh]") {
    const TemporaryFolder folder;
    const MeshFile far =
        readText(folder, "far.obj", "v 500000.01 0 0\nv 500010.02 0 0\nv 500000.01 10.03 0\nf 1 2 3\n");
    REQUIRE(far.notes.size() == 1);
    CHECK_THAT(far.notes[0], Contains("500010 file units from the origin") && Contains("exact to 0.005 only"));
    const MeshFile exact =
        readText(folder, "exact.obj", "v 500000.0100 0 0\nv 500010.0200 0 0\nv 500000.0100 10.0300 0\nf 1 2 3\n");
    CHECK(exact.notes.empty());
    CHECK(exact.mesh.positions[1].x - exact.mesh.positions[0].x == Approx(10.01).epsilon(1e-6));
    CHECK(readText(folder, "near.obj", "v 5.01 0 0\nv 10.02 0 0\nv 5.01 10.03 0\nf 1 2 3\n").notes.empty());
}

TEST_CASE("STL: reads text of any case and layout, and several solids", "[mesh]") {
    const TemporaryFolder folder;
    std::string upper = stlOf(kFacet);
    std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) { return std::toupper(c); });
    std::string oneLine = "solid\n" + kFacet + "endsolid";
    std::replace(oneLine.begin() + 6, oneLine.end(), '\n', ' ');
    std::string cr = stlOf(kFacet);
    std::replace(cr.begin(), cr.end(), '\n', '\r');
    for (const std::string& text :
         {stlOf(kFacet), upper, oneLine, cr, "\xEF\xBB\xBF\n " + stlOf(kFacet), stlOf(kFacet) + "\n\n",
          replaced(stlOf(kFacet), "normal 0 0 1", "normal -nan(ind) nan 1.#IND"), stlOf(kFacet) + stlOf(kFacet)}) {
        CAPTURE(text);
        const MeshFile read = readText(folder, "part.stl", text);
        CHECK(read.mesh.positions == kCorners);
        CHECK(read.notes.empty());
    }
}

TEST_CASE("STL: notes trailing data", "[mesh]") {
    const TemporaryFolder folder;
    const std::vector<std::pair<std::string, std::string>> cases{
        {stlOf(kFacet) + stlOf(""), "line 10: this solid has no facet"},
        {stlOf(kFacet) + std::string(4, '\0'), "line 10: everything from here on is ignored"},
        {stlOf(kFacet) + kFacet, "line 10: everything from here on is ignored"},
        {"solid a\n" + kFacet, "line 1: this solid has no end"},
        {binaryStl("part", 1) + std::string(7, 'x'), "7 bytes after the 1 triangles"},
        {binaryStl("solid part", 1) + std::string(60, '\0'), "60 bytes after the 1 triangles"},
    };
    for (const auto& [text, words] : cases) {
        CAPTURE(text);
        const MeshFile read = readText(folder, "my part.stl", text);
        CHECK(read.mesh.positions == kCorners);
        REQUIRE(read.notes.size() == 1);
        CHECK_THAT(read.notes[0], Contains(words) && Contains("my part.stl: "));
    }
}

TEST_CASE("STL: a malformed file is refused with the line or triangle", "[mesh]") {
    const TemporaryFolder folder;
    std::string broken = binaryStl("part", 3);
    const float nan = std::nanf("");
    std::memcpy(broken.data() + 84 + 50 + 12, &nan, sizeof nan);
    const std::vector<std::pair<std::string, std::string>> cases{
        {stlOf(replaced(kFacet, "1 0 0", "1 0,5 0")), "line 5: '0,5' is not a number"},
        {stlOf(replaced(kFacet, "1 0 0", "1 0")), "line 6: 'vertex' is not a number"},
        {stlOf(replaced(kFacet, "vertex 1", "vertx 1")), "line 5: 'vertx' was found instead of 'endloop'"},
        {stlOf(replaced(kFacet, "1 0 0", "1 inf 0")), "line 2: its vertex 1 is non-finite"},
        {stlOf("faset normal 0 0 1\n"), "line 2: 'faset'"},
        {stlOf(kFacet).substr(0, 57), "ends within a facet"},
        {stlOf(""), "has no triangles"},
        {broken, "triangle 2: its vertex 3 is non-finite"},
        {binaryStl("part", 3).substr(0, 200), "would have 3 triangles, but only 2 are present"},
        {binaryStl("solid part", 3).substr(0, 200), "would have 3 triangles, but only 2 are present"},
        {"hello", "is neither ASCII STL"},
        {kPly, "is truncated or not STL"},
    };
    for (const auto& [text, words] : cases) {
        CAPTURE(text);
        CHECK_THAT(refusal(folder, "my part.stl", text), Contains(words) && Contains("my part.stl: "));
    }
}

TEST_CASE("PLY: reads ASCII with other elements, properties, orders and line ends", "[mesh]") {
    const TemporaryFolder folder;
    std::string cr = kPly;
    std::replace(cr.begin(), cr.end(), '\n', '\r');
    const std::vector<std::string> texts{
        kPly,
        cr,
        replaced(kPly, "vertex_indices", "vertex_index"),
        replaced(kPly, "3 0 1 2", " 3.0\t0 1 2 \n\n"),
        "ply\nformat ascii 1.0\nobj_info x\nelement face 1\nproperty list uint8 float32 texcoord\n"
        "property list uint8 uint32 vertex_indices\nproperty uchar red\nelement vertex 3\nproperty uchar red\n"
        "property double z\nproperty list int int near\nproperty int16 y\nproperty int8 x\nelement nothing 7\n"
        "end_header\n2 .5 .5 3 0 1 2 255\n255 0 0 0 0\n255 0 2 1 2 0 1\n255 0 1 7 1 0\n",
    };
    for (const std::string& text : texts) {
        CAPTURE(text);
        const MeshFile read = readText(folder, "part.ply", text);
        CHECK(read.mesh.positions == kCorners);
        CHECK(read.mesh.indices == Indices{0, 1, 2});
        CHECK(read.notes.empty());
    }
}

TEST_CASE("PLY: reads binary of both byte orders, every scalar type, and data that begin with a line feed", "[mesh]") {
    const TemporaryFolder folder;
    for (const bool big : {false, true})
        for (const std::string line : {"\n", "\r\n", "\r"}) {
            CAPTURE(big, line);
            std::string text;
            for (const std::string word :
                 {"ply", big ? "format binary_big_endian 1.0" : "format binary_little_endian 1.0", "element other 1",
                  "property list ushort double skipped", "element vertex 4", "property double x", "property short y",
                  "property char z", "property uint id", "element face 1", "property ushort flags",
                  "property list uint ushort vertex_indices", "end_header"})
                text += word + line;
            append<std::uint16_t>(text, 10, big);  // in little endian the first byte is a line feed
            for (int i = 0; i < 10; ++i) append<double>(text, i, big);
            for (const auto& [x, y, z] : {std::array{-1, -300, -100}, {2, -300, -100}, {2, 5, -100}, {-1, 5, -100}}) {
                append<double>(text, x + 0.25, big);
                append<std::int16_t>(text, static_cast<std::int16_t>(y), big);
                append<std::int8_t>(text, static_cast<std::int8_t>(z), big);
                append<std::uint32_t>(text, 4000000000u, big);
            }
            append<std::uint16_t>(text, 0xFFFF, big);
            append<std::uint32_t>(text, 4, big);
            for (const int i : {3, 2, 1, 0}) append<std::uint16_t>(text, static_cast<std::uint16_t>(i), big);
            const MeshFile read = readText(folder, "part.ply", text);
            CHECK(read.mesh.positions ==
                  Positions{{-0.75f, 5, -100}, {2.25f, 5, -100}, {2.25f, -300, -100}, {-0.75f, -300, -100}});
            CHECK(read.mesh.indices.size() == 6);
            REQUIRE(read.notes.size() == 1);
            CHECK_THAT(read.notes[0], Contains("line 3: the element 'other' is ignored"));

            CHECK_THAT(readText(folder, "part.ply", text + "more").notes.back(), Contains("4 bytes after the data"));
            CHECK_THAT(refusal(folder, "part.ply", text.substr(0, text.size() - 1)),
                       Contains("face 0: exceeds the end of the file"));
        }
}

TEST_CASE("PLY: triangle strips keep their orientation, and -1 begins another strip", "[mesh]") {
    const TemporaryFolder folder;
    const MeshFile read = readText(folder, "part.ply",
                                   "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
                                   "property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
                                   "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n10 0 1 2 3 4 -1 2 3 4 5\n");
    CHECK(read.mesh.indices == Indices{0, 1, 2, 2, 1, 3, 2, 3, 4, 2, 3, 4, 4, 3, 5});
    for (const glm::vec3& normal : read.mesh.normals) CHECK(normal == glm::vec3(0, 0, 1));
}

TEST_CASE("PLY: a malformed file is refused with the line, and unknown header lines are noted", "[mesh]") {
    const TemporaryFolder folder;
    const std::string huge = "1152921504606846976";
    const std::vector<std::pair<std::string, std::string>> cases{
        {replaced(kPly, "ply", "plx"), "does not begin with the line 'ply'"},
        {"ply", "the header does not end"},
        {replaced(kPly, "ascii", "binary_middle_endian"), "line 2: 'binary_middle_endian' is not a PLY format"},
        {replaced(kPly, "1.0", "1.1"), "line 2: has version '1.1'"},
        {replaced(kPly, "format ascii 1.0\n", ""), "the header has no format line"},
        {replaced(kPly, "float x", "half x"), "line 5: 'half' is not a PLY type"},
        {replaced(kPly, "float y", "float x"), "line 6: the property 'x' is declared twice"},
        {replaced(kPly, "element face", "element vertex"), "line 8: the element 'vertex' is declared twice"},
        {replaced(kPly, "element vertex 3", "element vertex some"), "line 4: 'some' is not a valid element count"},
        {replaced(kPly, "element vertex 3", "element vertex " + huge), "line 14: has more values"},
        {replaced(kPly, "element face 1", "element face " + huge), "line 8: the element 'face': the file ends after 1"},
        {replaced(kPly, "property float z\n", ""), "line 4: the element 'vertex': it has no property 'z'"},
        {replaced(kPly, "float z", "list int int z"), "its 'z' is a list"},
        {replaced(kPly, "vertex_indices", "corners"), "it has no property 'vertex_index'"},
        {replaced(kPly, "uchar int", "uchar float"), "not a list of whole numbers"},
        {replaced(kPly, "uchar int", "float int"), "line 9: the count of a list has a floating-point type"},
        {replaced(kPly, "1 0 0", "1 0"), "line 12: has fewer values"},
        {replaced(kPly, "1 0 0", "1 0 0 0"), "line 12: has more values"},
        {replaced(kPly, "1 0 0", "1 0,5 0"), "line 12: '0,5' is not a number"},
        {replaced(kPly, "1 0 0", "1 nan 0"), "line 14: its vertex 1 is non-finite"},
        {replaced(kPly, "3 0 1 2", "3 0 1 3"), "line 14: refers to vertex 3, but the file has 3"},
        {replaced(kPly, "3 0 1 2", "3 0 1 -1"), "line 14: a vertex index is not a non-negative whole number"},
        {replaced(kPly, "3 0 1 2", "3 0 1 1.5"), "line 14: a vertex index is not a non-negative whole number"},
        {replaced(kPly, "3 0 1 2", "-3 0 1 2"), "line 14: the count of a list is not a whole number"},
        {replaced(kPly, "3 0 1 2", huge + " 0 1 2"), "line 14: the count of a list is not a whole number"},
        {replaced(kPly, "3 0 1 2", "4000000000 0 1 2"), "line 14: has fewer values"},
        {replaced(kPly, "element face 1", "element face 0"), "has no triangles: "},
    };
    for (const auto& [text, words] : cases) {
        CAPTURE(text);
        CHECK_THAT(refusal(folder, "my part.ply", text), Contains(words) && Contains("my part.ply: "));
    }
    CHECK_THAT(readText(folder, "part.ply", replaced(kPly, "comment made", "Created")).notes.at(0),
               Contains("line 3: this header line is ignored, since 'Created' is unknown"));
    CHECK_THAT(readText(folder, "part.ply", kPly + "more\n").notes.at(0),
               Contains("everything from here on is ignored"));
}

TEST_CASE("mesh file: a face of many corners is read, and one with too many self-crossings is refused", "[mesh]") {
    const TemporaryFolder folder;
    constexpr int kTeeth = 2000;
    // A gear; its corners in a scattered order would cross in more than a million points.
    const auto gear = [&](int step) {
        std::string text, face = "f";
        for (int i = 0; i < kTeeth; ++i) {
            const double angle = 2 * 3.14159265358979 * i / kTeeth, radius = i % 2 ? 10 : 9.9;
            text += "v " + std::to_string(radius * std::cos(angle)) + ' ' + std::to_string(radius * std::sin(angle)) +
                    " 0\n";
            face += ' ' + std::to_string(1 + i * step % kTeeth);
        }
        return text + face + "\n";
    };
    CHECK(readText(folder, "gear.obj", gear(1)).mesh.indices.size() == 3 * (kTeeth - 2));
    CHECK_THAT(refusal(folder, "star.obj", gear(777)), Contains("line 2001: the edges of this face cross"));
}

TEST_CASE("mesh file: folders and pipes are refused without blocking", "[mesh]") {
    const TemporaryFolder folder;
    for (const std::string_view each : meshExtensions()) {
        const std::string extension(each);
        std::filesystem::create_directory(folder / ("folder" + extension));
        REQUIRE(::mkfifo((folder / ("pipe" + extension)).c_str(), 0600) == 0);
        for (const std::string kind : {"folder", "pipe"})
            CHECK_THROWS_WITH(readMeshFile(folder / (kind + extension), 1),
                              Contains(kind + extension) && Contains("is a " + kind));
    }
}

TEST_CASE("mesh file: the locale does not change numbers", "[mesh]") {
    const char* locale = nullptr;
    for (const char* name : {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8"})
        if (!locale) locale = std::setlocale(LC_NUMERIC, name);
    const TemporaryFolder folder;
    const MeshFile read = readText(folder, "part.obj", "v 0.5 0 1e-320\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    std::setlocale(LC_NUMERIC, "C");
    CHECK(read.mesh.positions[0] == glm::vec3(0.5f, 0, 0));
}

}  // namespace touchstone::mesh_format_tests
