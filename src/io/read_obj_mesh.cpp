#include <fmt/format.h>

#include <array>
#include <optional>
#include <unordered_map>

#include "io/mesh_checks.h"
#include "io/obj_lines.h"
#include "io/read_mesh.h"
#include "io/text.h"

namespace embrun {

namespace {

constexpr std::uint32_t not_given = UINT32_MAX;

/// A corner of a polygon, by index into the file's own lists.
struct Corner {
  std::uint32_t position = 0;
  std::uint32_t normal = not_given;
  std::uint32_t coordinates = not_given;

  bool operator==(const Corner&) const = default;
};

struct CornerHash {
  std::size_t operator()(const Corner& c) const {
    std::uint64_t h = std::uint64_t{c.position} << 32 | c.normal;
    h = (h ^ (h >> 32) ^ std::uint64_t{c.coordinates} << 20) * 0x9e3779b97f4a7c15u;
    return static_cast<std::size_t>(h ^ (h >> 32));
  }
};

class ObjReader {
 public:
  ObjReader(std::span<const std::byte> file, std::string_view name) : lines_(file, name) {}

  TriangleMesh read() {
    std::string_view keyword, line;
    while (lines_.next(keyword, line)) {
      if (keyword == "v") {
        read_position(line);
      } else if (keyword == "vn") {
        normals_.push_back(to_float(lines_.take_vector(line, "vn")));
      } else if (keyword == "vt") {
        read_coordinates(line);
      } else if (keyword == "f") {
        read_face(line);
      }
    }
    if (corners_.empty()) lines_.cursor().fail("", "the mesh has no triangles");
    return build();
  }

 private:
  ObjLines lines_;
  std::vector<Vec3> positions_;
  std::vector<Vec3> normals_;
  std::vector<Vec2> coordinates_;
  std::vector<std::array<Corner, 3>> corners_;
  std::vector<Corner> polygon_;

  // A weight or a colour may follow the coordinates; neither matters here.
  void read_position(std::string_view line) {
    const Vec3d p = lines_.take_vector(line, "v");
    if (!is_mesh_coordinate(p.x) || !is_mesh_coordinate(p.y) || !is_mesh_coordinate(p.z)) {
      lines_.cursor().fail("v", fmt::format("({}, {}, {}) is not finite or too far away", p.x, p.y, p.z));
    }
    if (positions_.size() == UINT32_MAX) lines_.cursor().fail("v", "there are more than 2^32 - 1 vertices");
    positions_.push_back(to_float(p));
  }

  // A missing v is 0; a third coordinate, of solid textures, does not matter.
  void read_coordinates(std::string_view line) {
    std::array<float, 2> uv{};
    for (std::size_t k = 0; k < 2; ++k) {
      const std::string_view token = take_token(line);
      if (k == 1 && (token.empty() || token.starts_with('#'))) break;
      const std::optional<double> number = parse_double(token);
      if (!number || !is_mesh_coordinate(*number))
        lines_.cursor().fail("vt", fmt::format("{} is not a number, or too large", quoted(token)));
      uv[k] = static_cast<float>(*number);
    }
    coordinates_.push_back({uv[0], 1 - uv[1]});
  }

  // Counts from 1, or backwards from the latest one with -1.
  std::uint32_t read_index(std::string_view text, std::size_t count, std::string_view of) {
    const std::optional<std::int64_t> index = parse_int64(text);
    if (!index) lines_.cursor().fail("f", fmt::format("{} is not an index", quoted(text)));
    const std::int64_t size = static_cast<std::int64_t>(count);
    if (*index == 0 || *index > size || *index < -size) {
      lines_.cursor().fail("f", fmt::format("{} {} is out of range: there are {} so far", of, *index, size));
    }
    return static_cast<std::uint32_t>(*index > 0 ? *index - 1 : size + *index);
  }

  // "7", "7/1", "7/1/4" or "7//4": position, texture coordinate, normal.
  Corner read_corner(std::string_view token) {
    Corner corner;
    const std::size_t first = token.find('/');
    corner.position = read_index(token.substr(0, first), positions_.size(), "vertex");
    if (first == std::string_view::npos) return corner;
    const std::size_t second = token.find('/', first + 1);
    const std::string_view coordinates =
        token.substr(first + 1, second == std::string_view::npos ? second : second - first - 1);
    if (!coordinates.empty()) corner.coordinates = read_index(coordinates, coordinates_.size(), "texture coordinate");
    if (second == std::string_view::npos) return corner;
    corner.normal = read_index(token.substr(second + 1), normals_.size(), "normal");
    return corner;
  }

  void read_face(std::string_view line) {
    polygon_.clear();
    for (std::string_view token = take_token(line); !token.empty(); token = take_token(line)) {
      if (token.starts_with('#')) break;
      polygon_.push_back(read_corner(token));
    }
    if (polygon_.size() < 3) lines_.cursor().fail("f", fmt::format("a face of {} corners", polygon_.size()));
    for (std::size_t i = 2; i < polygon_.size(); ++i) corners_.push_back({polygon_[0], polygon_[i - 1], polygon_[i]});
  }

  bool all_corners_have(std::uint32_t Corner::*index) const {
    for (const auto& triangle : corners_) {
      for (const Corner& corner : triangle) {
        if (corner.*index == not_given) return false;
      }
    }
    return true;
  }

  // OBJ counts normals and texture coordinates on their own: a position with two of them becomes two vertices.
  TriangleMesh build() {
    TriangleMesh mesh;
    mesh.triangles.reserve(corners_.size());
    const bool normals = all_corners_have(&Corner::normal), coordinates = all_corners_have(&Corner::coordinates);
    if (!normals && !coordinates) {
      mesh.positions = std::move(positions_);
      for (const auto& [a, b, c] : corners_) mesh.triangles.push_back({a.position, b.position, c.position});
      return mesh;
    }
    std::unordered_map<Corner, std::uint32_t, CornerHash> vertex_of;
    for (const auto& triangle : corners_) {
      std::array<std::uint32_t, 3> indices{};
      for (std::size_t k = 0; k < 3; ++k) {
        Corner corner = triangle[k];
        if (!normals) corner.normal = not_given;
        if (!coordinates) corner.coordinates = not_given;
        const auto [entry, is_new] = vertex_of.try_emplace(corner, static_cast<std::uint32_t>(mesh.positions.size()));
        if (is_new) {
          mesh.positions.push_back(positions_[corner.position]);
          if (normals) mesh.normals.push_back(normals_[corner.normal]);
          if (coordinates) mesh.coordinates.push_back(coordinates_[corner.coordinates]);
        }
        indices[k] = entry->second;
      }
      mesh.triangles.push_back(indices);
    }
    normalize_mesh_normals(mesh);
    return mesh;
  }
};

}  // namespace

TriangleMesh read_obj_mesh(std::span<const std::byte> file, std::string_view name) {
  return ObjReader(file, name).read();
}

}  // namespace embrun
