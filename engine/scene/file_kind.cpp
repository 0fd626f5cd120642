#include "engine/scene/file_kind.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace touchstone::engine {
namespace {

constexpr std::string_view kExport = "export the scene as glTF 2.0 (.glb or .gltf)";
constexpr std::string_view kMesh = "create a scene from it with touchstone new";

constexpr std::string_view kCad =
    "it holds exact surfaces, not triangles: open it in FreeCAD (or gmsh, which reads it by Open Cascade), export each "
    "part as STL or OBJ, and make a scene of them with touchstone new; or export it as glTF 2.0";

struct Magic {
    std::string_view start, is, remedy;
};

constexpr std::array kMagic = {
    Magic{"\x89PNG", "a PNG picture", kExport},
    Magic{"\xff\xd8\xff", "a JPEG picture", kExport},
    Magic{"GIF8", "a GIF picture", kExport},
    Magic{"PK\x03\x04", "a ZIP archive", "unpack it and open the .gltf or .glb inside"},
    Magic{"\x1f\x8b", "a gzip file", "unpack it and open the .gltf or .glb inside"},
    Magic{"7z\xbc\xaf", "a 7z archive", "unpack it and open the .gltf or .glb inside"},
    Magic{"%PDF", "a PDF document", kExport},
    Magic{"ISO-10303-21", "a STEP file",
          "create a scene of its parts with touchstone new, to which STEP files are named .step or .stp"},
    Magic{"DBRep_DrawableShape", "a BREP file of Open Cascade", kCad},
    Magic{"CASCADE Topology", "a BREP file of Open Cascade", kCad},
    Magic{"**ABCDEFGHIJKLMNOPQRSTUVWXYZ", "a Parasolid file", kCad},
    Magic{"3D Geometry File Format", "a Rhino file", "export each part from Rhino as STL or OBJ"},
    Magic{"\xd0\xcf\x11\xe0", "a file of a CAD or office program",
          "export each part from that program as STL or OBJ, and make a scene of them with touchstone new"},
    Magic{"BLENDER", "a Blender file", "open it in Blender and export it as glTF 2.0"},
    Magic{"Kaydara FBX", "an FBX file", "convert it to glTF 2.0, in Blender for example"},
    Magic{"ply\n", "a PLY mesh", kMesh},
    Magic{"ply\r", "a PLY mesh", kMesh},
    Magic{"solid ", "an STL mesh", kMesh},
    Magic{"SQLite format", "a database", kExport},
    Magic{"\x7f"
          "ELF",
          "a program", kExport},
    Magic{"version https://git-lfs", "the pointer that Git LFS keeps in place of the file",
          "fetch the file with git lfs pull"},
    Magic{"<!DOCTYPE html", "a web page", "download the file itself"},
    Magic{"<!doctype html", "a web page", "download the file itself"},
    Magic{"<html", "a web page", "download the file itself"},
    Magic{"<?xml", "XML", "convert the scene to glTF 2.0, in Blender for example"},
    Magic{"\xff\xfe", "text in UTF-16", "save it as UTF-8"},
    Magic{"\xfe\xff", "text in UTF-16", "save it as UTF-8"},
};

std::uint32_t littleEndian(std::span<const std::uint8_t> bytes) {
    return bytes[0] | bytes[1] << 8 | bytes[2] << 16 | static_cast<std::uint32_t>(bytes[3]) << 24;
}

/// Whether the first statement of the text is one of OBJ.
bool isObj(std::string_view text) {
    while (!text.empty()) {
        const std::string_view line = text.substr(0, text.find('\n'));
        for (const std::string_view word : {"v ", "vn ", "vt ", "f ", "mtllib ", "o ", "g "})
            if (line.starts_with(word)) return true;
        if (!line.empty() && line[0] != '#' && line != "\r") return false;
        text.remove_prefix(std::min(line.size() + 1, text.size()));
    }
    return false;
}

/// Whether the text consists of the cards of IGES: 80 columns, of which column 73 names the section.
bool isIges(std::string_view text) {
    constexpr std::size_t kSection = 72, kColumns = 80;
    return text.size() >= kColumns && text[kSection] == 'S' &&
           text.substr(kSection + 1, kColumns - kSection - 1).find_first_not_of(" 0123456789") == text.npos &&
           text.substr(0, kColumns).find_first_of("\r\n") == text.npos;
}

/// The kind of a ZIP archive, by the names of its first entries.
std::string zipProblem(std::string_view text) {
    const auto has = [&](std::string_view name) { return text.find(name) != text.npos; };
    if (has("3D/3dmodel.model") || has("[Content_Types].xml"))
        return "is a 3MF or office file, not glTF; convert a 3MF part to STL or OBJ, in FreeCAD for example";
    if (has("Document.xml"))
        return "is a FreeCAD document, not glTF; export each part from FreeCAD as STL or OBJ, and make a scene of them "
               "with touchstone new";
    return "";
}

}  // namespace

std::string foreignFileProblem(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t kEnough = 4096, kStlHeader = 84, kStlTriangle = 50;
    const auto sentence = [](std::string_view is, std::string_view remedy) {
        return "is " + std::string(is) + ", not glTF; " + std::string(remedy);
    };
    std::string_view text(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), kEnough));
    if (text.starts_with("PK"))
        if (std::string problem = zipProblem(text); !problem.empty()) return problem;
    for (const Magic& magic : kMagic)
        if (text.starts_with(magic.start)) return sentence(magic.is, magic.remedy);
    // A binary STL can only be recognized by its length.
    if (bytes.size() > kStlHeader &&
        bytes.size() == kStlHeader + std::uint64_t{kStlTriangle} * littleEndian(bytes.subspan(80)))
        return sentence("an STL mesh", kMesh);
    if (isIges(text)) return sentence("an IGES file", kCad);
    if (isObj(text)) return sentence("an OBJ mesh", kMesh);
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (first != text.npos && (text[first] == '{' || text[first] == '[')) return "";
    const bool isText = std::none_of(text.begin(), text.end(), [](unsigned char c) {
        return c < 0x20 && c != '\t' && c != '\n' && c != '\r' && c != '\f';
    });
    if (isText) return sentence("a text file of another kind", kExport);
    return sentence("a file of another kind", kExport);
}

}  // namespace touchstone::engine
