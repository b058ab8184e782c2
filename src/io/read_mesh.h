#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "geometry/triangle_mesh.h"

namespace embrun {

/// A triangle mesh from a PLY or OBJ file, told apart by content. Polygons become fans of triangles; materials,
/// groups and colours are ignored. The mesh has normals, or texture coordinates, when all of its corners have; a normal
/// of no length becomes the mean normal of its faces. PLY's coordinates are its u and v, or s and t; OBJ's v, which counts
/// from a picture's last row, is turned to count from the first. Throws Error, naming the file and the line or offset, for bad input
/// (an index out of range, a coordinate that is not finite or beyond 1e15, no triangles, ...).
TriangleMesh read_mesh(const std::string& path);
TriangleMesh read_mesh_from_memory(std::span<const std::byte> file, std::string_view name);

TriangleMesh read_ply_mesh(std::span<const std::byte> file, std::string_view name);
TriangleMesh read_obj_mesh(std::span<const std::byte> file, std::string_view name);

}  // namespace embrun
