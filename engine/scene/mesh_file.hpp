#pragma once
// Reads parts from STL, OBJ and PLY files.
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/scene/mesh_data.hpp"

namespace touchstone::engine {

/// A mesh, and notes on content of the file that was ignored: one sentence each, naming file and line.
struct MeshFile {
    MeshData mesh;
    glm::dvec3 origin{0};  ///< of the mesh in the coordinates of the file, meters; not 0 if the part is far from theirs
    std::vector<std::string> notes;
};

/// The formats that are read, by the ends of file names: ".obj", ".ply", ".stl".
std::span<const std::string_view> meshExtensions();
/// The same in a sentence: ".obj, .ply or .stl", or with another conjunction.
std::string meshExtensionWords(std::string_view conjunction = "or");

/// Whether the name ends in one of them, in lower or upper case.
bool isMeshFile(const std::filesystem::path& file);

/// Reads all faces of an STL (ASCII or binary), OBJ or PLY (ASCII or binary) file as one mesh, in meters. Polygons are
/// triangulated, vertices at identical coordinates merged, faces without three distinct corners dropped with a note,
/// and smooth normals computed. Coordinates are read in double; those of a part that lies farther from the origin than
/// its size are given about a point near its middle before they are rounded. A note says if the file itself is too
/// coarse for the part there; colors, texture coordinates and normals of the file are ignored. Time and memory are
/// linear in the size of the file. Throws SceneError with one sentence, naming the line, when the file cannot be read,
/// is malformed, has a face with a missing or non-finite vertex, or holds no triangle.
MeshFile readMeshFile(const std::filesystem::path& file, double metersPerUnit);

}  // namespace touchstone::engine
