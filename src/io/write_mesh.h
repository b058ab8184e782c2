#pragma once

#include <string>

#include "geometry/triangle_mesh.h"

namespace embrun {

/// How a mesh is written.
struct MeshWriteOptions {
  Vec3d origin = {};         ///< what the mesh's positions are relative to
  float resolution = 0;      ///< metres: positions are written in double precision where single would round by more
  std::string comment = {};  ///< a line at the head of the file
};

/// Writes a mesh, whole or not at all (see write_file_atomically). The extension names the format: .ply is binary,
/// little-endian, with normals and texture coordinates as the mesh has them; .obj is text. Throws Error, naming the file,
/// for another extension and where it cannot be written.
void write_mesh(const std::string& path, const TriangleMesh& mesh, const MeshWriteOptions& options = {});

/// Throws Error when write_mesh could not write there.
void check_mesh_path(const std::string& path);

}  // namespace embrun
