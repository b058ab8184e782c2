#include "io/read_mesh.h"

#include <cmath>
#include <new>

#include "io/column.h"
#include "io/cursor.h"
#include "io/file_bytes.h"
#include "io/mesh_checks.h"

namespace embrun {

bool is_mesh_coordinate(double coordinate) { return std::abs(coordinate) <= max_coordinate; }

void normalize_mesh_normals(TriangleMesh& mesh) {
  if (mesh.normals.size() != mesh.positions.size()) {
    mesh.normals.clear();
    return;
  }
  std::vector<Vec3d> from_faces;
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    const Vec3d given = to_double(mesh.normals[i]);
    const double size = length(given);
    if (size > 0 && std::isfinite(size)) {
      mesh.normals[i] = to_float(given * (1 / size));
      continue;
    }
    if (from_faces.empty()) {
      from_faces.resize(mesh.positions.size());
      for (const auto& triangle : mesh.triangles) {
        const Vec3d a = to_double(mesh.positions[triangle[0]]);
        const Vec3d twice_area =
            cross(to_double(mesh.positions[triangle[1]]) - a, to_double(mesh.positions[triangle[2]]) - a);
        for (const std::uint32_t corner : triangle) from_faces[corner] = from_faces[corner] + twice_area;
      }
    }
    const double face_size = length(from_faces[i]);
    mesh.normals[i] = face_size > 0 ? to_float(from_faces[i] * (1 / face_size)) : Vec3{0, 0, 1};
  }
}

TriangleMesh read_mesh_from_memory(std::span<const std::byte> file, std::string_view name) {
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  if (file.empty()) fail_in_file(name, "offset 0", "", "the file is empty");
  if (text.starts_with("ply\n") || text.starts_with("ply\r")) return read_ply_mesh(file, name);
  return read_obj_mesh(file, name);
}

TriangleMesh read_mesh(const std::string& path) {
  try {
    return read_mesh_from_memory(read_file_bytes(path), path);
  } catch (const std::bad_alloc&) {
    fail_in_file(path, "", "", "there is not enough memory for it");
  }
}

}  // namespace embrun
