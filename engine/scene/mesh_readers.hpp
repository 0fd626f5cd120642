#pragma once
// One reader per mesh file format. They add vertices and faces in the units of the file, note ignored content, and
// throw SceneError on malformed content.
#include <string_view>

#include "engine/scene/polygon_mesh.hpp"

namespace touchstone::engine {

/// Wavefront OBJ: polygons, with absolute or relative indices.
void readObj(std::string_view bytes, PolygonMesh& mesh);

/// PLY 1.0: the faces of the element `face`, or the triangles of `tristrips`.
void readPly(std::string_view bytes, PolygonMesh& mesh);

/// STL: all solids of an ASCII file, or the triangles of a binary one.
void readStl(std::string_view bytes, PolygonMesh& mesh);

}  // namespace touchstone::engine
