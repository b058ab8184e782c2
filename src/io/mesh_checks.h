#pragma once

#include <string>
#include <string_view>

#include "geometry/triangle_mesh.h"

namespace embrun {

/// Makes the normals unit vectors; those of no length, or not finite, become the mean of their faces'.
/// Normals that do not match the positions in number are dropped.
void normalize_mesh_normals(TriangleMesh& mesh);

/// Whether a mesh may have such a coordinate: finite, at most 1e15.
bool is_mesh_coordinate(double coordinate);

}  // namespace embrun
