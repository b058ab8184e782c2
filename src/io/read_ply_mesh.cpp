#include <fmt/format.h>

#include <array>

#include "io/mesh_checks.h"
#include "io/ply.h"
#include "io/read_mesh.h"
#include "io/text.h"

namespace embrun {

namespace {

/// The columns of those names; null for what is missing.
template <std::size_t N>
std::array<const Column*, N> find_columns(const std::vector<Column>& columns, const std::array<const char*, N>& names) {
  std::array<const Column*, N> found{};
  for (const Column& column : columns) {
    for (std::size_t i = 0; i < N; ++i) {
      if (column.name == names[i]) found[i] = &column;
    }
  }
  return found;
}

/// The columns of those names as vectors; empty when one is missing.
std::vector<Vec3d> vectors(const std::vector<Column>& columns, const std::array<const char*, 3>& names) {
  const auto axes = find_columns(columns, names);
  if (!axes[0] || !axes[1] || !axes[2]) return {};
  std::vector<Vec3d> result(axes[0]->value_count());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = {axes[0]->value(i), axes[1]->value(i), axes[2]->value(i)};
  return result;
}

/// Texture coordinates; none when they are missing or one is no number.
std::vector<Vec2> texture_coordinates(const std::vector<Column>& columns) {
  auto axes = find_columns<2>(columns, {"u", "v"});
  if (!axes[0] || !axes[1]) axes = find_columns<2>(columns, {"s", "t"});
  if (!axes[0] || !axes[1]) return {};
  std::vector<Vec2> result;
  for (std::size_t i = 0; i < axes[0]->value_count(); ++i) {
    const double u = axes[0]->value(i), v = axes[1]->value(i);
    if (!is_mesh_coordinate(u) || !is_mesh_coordinate(v)) return {};
    result.push_back({static_cast<float>(u), static_cast<float>(v)});
  }
  return result;
}

void read_vertices(PlyFile& ply, std::string_view name, TriangleMesh& mesh) {
  const PlyRows rows = ply.read();
  const std::vector<Vec3d> positions = vectors(rows.columns, {"x", "y", "z"});
  if (positions.empty()) ply.cursor().fail("element 'vertex'", "there are no vertices with x, y and z");
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Vec3d p = positions[i];
    if (!is_mesh_coordinate(p.x) || !is_mesh_coordinate(p.y) || !is_mesh_coordinate(p.z)) {
      fail_in_file(name, rows.place(i), "position",
                   fmt::format("vertex {} is at ({}, {}, {}), not finite or too far away", i, p.x, p.y, p.z));
    }
    mesh.positions.push_back(to_float(p));
  }
  for (const Vec3d normal : vectors(rows.columns, {"nx", "ny", "nz"})) mesh.normals.push_back(to_float(normal));
  mesh.coordinates = texture_coordinates(rows.columns);
}

void read_faces(PlyFile& ply, const PlyElement& element, std::uint64_t vertices, TriangleMesh& mesh) {
  std::size_t list = 0;
  while (list < element.properties.size() && element.properties[list].name != "vertex_indices" &&
         element.properties[list].name != "vertex_index") {
    ++list;
  }
  if (list == element.properties.size() || !element.properties[list].is_list ||
      is_float(element.properties[list].type)) {
    ply.cursor().fail("element 'face'", "it has no list of integers \"vertex_indices\"");
  }
  std::uint64_t face = 0;
  ply.read(list, [&](std::span<const std::int64_t> corners) {
    if (corners.size() < 3) ply.cursor().fail(fmt::format("face {}", face), fmt::format("{} corners", corners.size()));
    for (const std::int64_t corner : corners) {
      if (corner >= 0 && static_cast<std::uint64_t>(corner) < vertices) continue;
      ply.cursor().fail(fmt::format("face {}", face), fmt::format("vertex {} of {} vertices", corner, vertices));
    }
    for (std::size_t i = 2; i < corners.size(); ++i) {
      mesh.triangles.push_back({static_cast<std::uint32_t>(corners[0]), static_cast<std::uint32_t>(corners[i - 1]),
                                static_cast<std::uint32_t>(corners[i])});
    }
    ++face;
  });
}

}  // namespace

TriangleMesh read_ply_mesh(std::span<const std::byte> file, std::string_view name) {
  PlyFile ply(file, name);
  const std::vector<PlyElement>& elements = ply.elements();
  const std::size_t vertex = ply.find("vertex"), face = ply.find("face");
  if (vertex == elements.size()) ply.cursor().fail("header", "there is no element \"vertex\"");
  if (face == elements.size()) ply.cursor().fail("header", "there is no element \"face\": a mesh is needed here");
  if (elements[vertex].count > UINT32_MAX)
    ply.cursor().fail("element 'vertex'", "there are more than 2^32 - 1 vertices");

  TriangleMesh mesh;
  for (std::size_t i = 0; i <= std::max(vertex, face); ++i) {
    if (i == vertex) {
      read_vertices(ply, name, mesh);
    } else if (i == face) {
      read_faces(ply, elements[face], elements[vertex].count, mesh);
    } else {
      ply.skip();
    }
  }
  if (mesh.triangles.empty()) ply.cursor().fail("element 'face'", "the mesh has no triangles");
  normalize_mesh_normals(mesh);
  return mesh;
}

}  // namespace embrun
