#include "meshing/isosurface.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "meshing/cube_cases.h"
#include "meshing/meter.h"
#include "meshing/sign_grid.h"

namespace embrun {

namespace {

constexpr int padded = SignGrid::padded;
constexpr std::size_t group_tiles = 16;
constexpr int bricks_per_tile = SignGrid::tile_bricks * SignGrid::tile_bricks * SignGrid::tile_bricks;

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// The edges from a brick's samples that the surface crosses, a word for each axis, and the number of their first vertex.
/// Vertices are numbered by axis and then by sample.
struct CrossedBrick {
  std::uint64_t edges[3] = {};
  std::uint32_t first_vertex = 0;

  std::uint32_t count() const {
    return static_cast<std::uint32_t>(std::popcount(edges[0]) + std::popcount(edges[1]) + std::popcount(edges[2]));
  }
  std::uint32_t vertex(int axis, int sample) const {
    const std::uint64_t lower = edges[axis] & ((std::uint64_t{1} << sample) - 1);
    std::uint32_t rank = first_vertex + static_cast<std::uint32_t>(std::popcount(lower));
    for (int a = 0; a < axis; ++a) rank += static_cast<std::uint32_t>(std::popcount(edges[a]));
    return rank;
  }
};

// A brick's word moved by a sample along an axis, the brick next to it on that side filling up.
std::uint64_t next_along_x(std::uint64_t word, std::uint64_t next) {
  return (word >> 1 & 0x7777777777777777u) | (next & 0x1111111111111111u) << 3;
}
std::uint64_t next_along_y(std::uint64_t word, std::uint64_t next) {
  return (word >> 4 & 0x0fff0fff0fff0fffu) | (next & 0x000f000f000f000fu) << 12;
}
std::uint64_t next_along_z(std::uint64_t word, std::uint64_t next) { return word >> 16 | next << 48; }

/// For the cells whose first corner is a sample of a brick: word c has the signs of corner c.
using CornerWords = std::array<std::uint64_t, 8>;

CornerWords corners_of(const SignGrid::PaddedWords& words, int x, int y, int z) {
  const auto at = [&](int i, int j, int k) {
    return words[static_cast<std::size_t>(((z + k) * padded + y + j) * padded + x + i)];
  };
  CornerWords c;
  std::uint64_t rows[2][2][2];  // by step along x (within the word), y, z (whole bricks)
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      rows[0][j][k] = at(0, j, k);
      rows[1][j][k] = next_along_x(at(0, j, k), at(1, j, k));
    }
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const std::uint64_t moved_low = next_along_y(rows[i][0][0], rows[i][1][0]);
    const std::uint64_t moved_high = next_along_y(rows[i][0][1], rows[i][1][1]);
    c[i] = rows[i][0][0];
    c[i + 2] = moved_low;
    c[i + 4] = next_along_z(rows[i][0][0], rows[i][0][1]);
    c[i + 6] = next_along_z(moved_low, moved_high);
  }
  return c;
}

/// The cells with corners on both sides.
std::uint64_t mixed_cells(const CornerWords& c) {
  const std::uint64_t any = c[0] | c[1] | c[2] | c[3] | c[4] | c[5] | c[6] | c[7];
  const std::uint64_t all = c[0] & c[1] & c[2] & c[3] & c[4] & c[5] & c[6] & c[7];
  return any & ~all;
}

unsigned case_of(const CornerWords& c, int cell) {
  unsigned bits = 0;
  for (unsigned corner = 0; corner < 8; ++corner) bits |= static_cast<unsigned>(c[corner] >> cell & 1u) << corner;
  return bits;
}

class Extractor {
 public:
  Extractor(const SurfaceField& field, const SignGrid& grid, bool exact) : field_(field), grid_(grid), exact_(exact) {}
  TriangleMesh run(const std::function<void(double)>& progress, double begin);

 private:
  struct TileEdges {
    std::uint64_t crossed = 0;  ///< bricks with crossed edges
    std::uint32_t first = 0;    ///< of those, in the group's
    std::uint32_t triangles = 0;
  };
  struct Group {
    std::vector<CrossedBrick> bricks;
    std::uint64_t vertices = 0, triangles = 0;
    std::uint64_t first_triangle = 0;
  };
  /// A tile and what is next to it on the high sides.
  struct TileView {
    std::size_t tile = 0;
    SignGrid::Neighbours neighbours;
    SignGrid::PaddedWords words;
    std::array<const CrossedBrick*, padded * padded * padded> crossed;
    SurfaceField::Near near, near_brick;
  };
  struct Crossing {
    int i, j, k, axis;  ///< sample of the tile, and where the edge runs from it
  };

  void find_edges(std::size_t tile, Group& group, SignGrid::PaddedWords& words);
  void number_all();
  void emit(std::size_t tile, TileView& view, TriangleMesh& mesh, std::uint64_t& next_triangle) const;
  void find_crossed(TileView& view) const;
  void place_vertices(TileView& view, int brick, const CrossedBrick& crossed, TriangleMesh& mesh) const;
  void place_vertex(const TileView& view, const Crossing& crossing, Vec3& position, Vec3& normal) const;
  float value_at(const TileView& view, int i, int j, int k) const;
  void emit_triangles(const TileView& view, int brick, TriangleMesh& mesh, std::uint64_t& next_triangle) const;
  const CrossedBrick* crossed_brick(std::uint32_t tile, int brick) const;

  const SurfaceField& field_;
  const SignGrid& grid_;
  bool exact_;
  std::vector<TileEdges> tiles_;
  std::vector<Group> groups_;
};

TriangleMesh Extractor::run(const std::function<void(double)>& progress, double begin) {
  tiles_.resize(grid_.tile_count());
  groups_.resize((tiles_.size() + group_tiles - 1) / group_tiles);
  const auto for_tiles = [&](const auto& body) {
    parallel_for(groups_.size(), 1, [&](std::size_t first, std::size_t last) { body(first, last); });
  };
  for_tiles([&](std::size_t first, std::size_t last) {
    SignGrid::PaddedWords words;
    for (std::size_t group = first; group < last; ++group) {
      for (std::size_t t = group * group_tiles; t < std::min((group + 1) * group_tiles, tiles_.size()); ++t)
        find_edges(t, groups_[group], words);
    }
  });
  number_all();

  TriangleMesh mesh;
  const Group& end = groups_.back();
  mesh.positions.resize(end.vertices);
  mesh.normals.resize(end.vertices);
  mesh.triangles.resize(end.first_triangle + end.triangles);
  Meter meter(progress, begin, 1, tiles_.size());
  for_tiles([&](std::size_t first, std::size_t last) {
    TileView view;
    for (std::size_t group = first; group < last; ++group) {
      const std::size_t end_tile = std::min((group + 1) * group_tiles, tiles_.size());
      std::uint64_t next_triangle = groups_[group].first_triangle;
      for (std::size_t t = group * group_tiles; t < end_tile; ++t) emit(t, view, mesh, next_triangle);
      meter.add(end_tile - group * group_tiles);
    }
  });
  return mesh;
}

/// Which edges of a tile's bricks are crossed, and how many triangles its cells have.
void Extractor::find_edges(std::size_t t, Group& group, SignGrid::PaddedWords& words) {
  TileEdges& tile = tiles_[t];
  tile.first = static_cast<std::uint32_t>(group.bricks.size());
  if (!grid_.words_of(grid_.neighbours(t), words)) return;
  const CubeCases& cases = cube_cases();
  for (int brick = 0; brick < bricks_per_tile; ++brick) {
    const auto [x, y, z] = SignGrid::place_in_tile(brick);
    const CornerWords c = corners_of(words, x, y, z);
    std::uint64_t cells = mixed_cells(c);
    if (cells == 0) continue;
    for (; cells != 0; cells &= cells - 1)
      tile.triangles += static_cast<std::uint32_t>(cases.of(case_of(c, std::countr_zero(cells))).size());
    CrossedBrick crossed;
    for (std::size_t axis = 0; axis < 3; ++axis) crossed.edges[axis] = c[0] ^ c[std::size_t{1} << axis];
    if (crossed.count() == 0) continue;
    tile.crossed |= std::uint64_t{1} << brick;
    group.vertices += crossed.count();
    group.bricks.push_back(crossed);
  }
  group.triangles += tile.triangles;
}

/// Numbers vertices and triangles, group by group; a group's count of vertices becomes that up to its end.
void Extractor::number_all() {
  std::uint64_t vertex = 0, triangle = 0;
  for (Group& group : groups_) {
    group.first_triangle = triangle;
    triangle += group.triangles;
    for (CrossedBrick& brick : group.bricks) {
      brick.first_vertex = static_cast<std::uint32_t>(vertex);
      vertex += brick.count();
    }
    group.vertices = vertex;
  }
  if (vertex >= 0xffffffffu)
    throw Error(fmt::format("a mesh with cells of {} m has {} vertices, more than can be numbered; take larger cells",
                            grid_.cell(), vertex));
}

const CrossedBrick* Extractor::crossed_brick(std::uint32_t index, int brick) const {
  const TileEdges& tile = tiles_[index];
  const std::uint64_t bit = std::uint64_t{1} << brick;
  if ((tile.crossed & bit) == 0) return nullptr;
  return &groups_[index / group_tiles]
              .bricks[tile.first + static_cast<std::size_t>(std::popcount(tile.crossed & (bit - 1)))];
}

void Extractor::find_crossed(TileView& view) const {
  std::size_t at = 0;
  for (int z = 0; z < padded; ++z) {
    for (int y = 0; y < padded; ++y) {
      for (int x = 0; x < padded; ++x, ++at) {
        constexpr int n = SignGrid::tile_bricks;
        const std::uint32_t tile = view.neighbours[static_cast<std::size_t>(x / n + 2 * (y / n) + 4 * (z / n))];
        view.crossed[at] =
            tile == SignGrid::no_tile ? nullptr : crossed_brick(tile, SignGrid::brick_at(x % n, y % n, z % n));
      }
    }
  }
}

void Extractor::emit(std::size_t t, TileView& view, TriangleMesh& mesh, std::uint64_t& next_triangle) const {
  const TileEdges& tile = tiles_[t];
  if (tile.crossed == 0 && tile.triangles == 0) return;
  view.tile = t;
  view.neighbours = grid_.neighbours(t);
  grid_.words_of(view.neighbours, view.words);
  find_crossed(view);
  constexpr int side = SignGrid::tile_side;
  if (tile.crossed != 0) field_.find(grid_.position(t, 0, 0, 0), grid_.position(t, side, side, side), view.near);
  for (int brick = 0; brick < bricks_per_tile; ++brick) {
    if ((tile.crossed >> brick & 1u) != 0)
      place_vertices(view, brick, *crossed_brick(static_cast<std::uint32_t>(t), brick), mesh);
    emit_triangles(view, brick, mesh, next_triangle);
  }
}

void Extractor::place_vertices(TileView& view, int brick, const CrossedBrick& crossed, TriangleMesh& mesh) const {
  constexpr int side = SignGrid::brick_side;
  const auto [x, y, z] = SignGrid::place_in_tile(brick);
  const Vec3 low = grid_.position(view.tile, x * side, y * side, z * side);
  field_.find(view.near, low, grid_.position(view.tile, (x + 1) * side, (y + 1) * side, (z + 1) * side),
              view.near_brick);
  std::size_t vertex = crossed.first_vertex;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::uint64_t left = crossed.edges[axis]; left != 0; left &= left - 1, ++vertex) {
      const int sample = std::countr_zero(left);
      place_vertex(view,
                   {x * side + sample % side, y * side + sample / side % side, z * side + sample / side / side, axis},
                   mesh.positions[vertex], mesh.normals[vertex]);
    }
  }
}

/// g at a sample of a tile or of the next tiles on the high sides.
float Extractor::value_at(const TileView& view, int i, int j, int k) const {
  constexpr int side = SignGrid::tile_side, small = SignGrid::brick_side;
  const std::uint32_t tile = view.neighbours[static_cast<std::size_t>(i / side + 2 * (j / side) + 4 * (k / side))];
  if (tile != SignGrid::no_tile) {
    const int x = i % side, y = j % side, z = k % side;
    const float value = grid_.value(tile, SignGrid::brick_at(x / small, y / small, z / small),
                                    (z % small * small + y % small) * small + x % small);
    if (!std::isnan(value)) return value;
  }
  return field_.slope(view.near_brick, grid_.position(view.tile, i, j, k), 0).value;
}

/// The zero of the cubic through g at 0, s and 1 and its slope at s, near s.
float zero_of_cubic(float at_0, float at_1, float s, float value, float slope) {
  const float rest = 1.0f - s;
  const float a = (at_0 - value + slope * s) / (s * s), b = (at_1 - value - slope * rest) / (rest * rest);
  const float square = a + (b - a) * s, cube = b - a;
  float d = -value / slope;
  for (int i = 0; i < 3; ++i) d = -(value + d * d * (square + cube * d)) / slope;
  return s + d;
}

/// The zero of g along an edge: from the linear one and the cubic's by Newton's method, kept within the bracket.
void Extractor::place_vertex(const TileView& view, const Crossing& crossing, Vec3& position, Vec3& normal) const {
  const Vec3 base = grid_.position(view.tile, crossing.i, crossing.j, crossing.k);
  Vec3 along;
  along[crossing.axis] = grid_.cell();
  const float at_0 = value_at(view, crossing.i, crossing.j, crossing.k);
  const float at_1 = value_at(view, crossing.i + (crossing.axis == 0), crossing.j + (crossing.axis == 1),
                              crossing.k + (crossing.axis == 2));
  // Signs are those of the grid; where a value computed anew has another by rounding, the zero is at that end.
  float s = clamp(at_0 / (at_0 - at_1), 0.0f, 1.0f);
  if (!(s == s)) s = 0.5f;
  SurfaceField::Normal point;
  if (!exact_) point = field_.normal(view.near_brick, base + along * s);
  float low = 0, high = 1;
  constexpr float small_step = 1e-3f;  // one more leaves far less
  for (int iteration = 0; exact_ && iteration < 20; ++iteration) {
    const SurfaceField::Slope here = field_.slope(view.near_brick, base + along * s, crossing.axis);
    const float slope = here.slope * grid_.cell();
    ((here.value > 0) == (at_0 > 0) ? low : high) = s;
    float next = s - here.value / slope;
    if (iteration == 0 && s > small_step && s < 1.0f - small_step)
      next = zero_of_cubic(at_0, at_1, s, here.value, slope);
    // Rounding may put a zero just outside the bracket.
    const bool settled = fabsf(next - s) < small_step;
    if (!settled && !(next > low && next < high)) next = 0.5f * (low + high);
    s = clamp(next, low, high);
    point = field_.normal(view.near_brick, base + along * s);
    // The slope there is much the same, unless the surface has gone over to the other branch.
    const float step = -point.value / slope;
    if (point.recovered != here.recovered || !(fabsf(step) < small_step)) continue;
    s = clamp(s + step, 0.0f, 1.0f);
    break;
  }
  position = base + along * s;
  normal = point.normal;
}

void Extractor::emit_triangles(const TileView& view, int brick, TriangleMesh& mesh,
                               std::uint64_t& next_triangle) const {
  constexpr int side = SignGrid::brick_side;
  const auto [x, y, z] = SignGrid::place_in_tile(brick);
  const CornerWords c = corners_of(view.words, x, y, z);
  const CubeCases& cases = cube_cases();
  for (std::uint64_t cells = mixed_cells(c); cells != 0; cells &= cells - 1) {
    const int cell = std::countr_zero(cells);
    const auto vertex_of = [&, x = x, y = y, z = z](unsigned edge) {
      const unsigned corner = edge_base_corner(edge);
      const int i = cell % side + static_cast<int>(corner & 1u),
                j = cell / side % side + static_cast<int>(corner >> 1 & 1u),
                k = cell / side / side + static_cast<int>(corner >> 2);
      const int owner = ((z + k / side) * padded + y + j / side) * padded + x + i / side;
      const int sample = (k % side * side + j % side) * side + i % side;
      return view.crossed[static_cast<std::size_t>(owner)]->vertex(static_cast<int>(edge >> 2), sample);
    };
    for (const CubeCases::Triangle& t : cases.of(case_of(c, cell)))
      mesh.triangles[next_triangle++] = {vertex_of(t[0]), vertex_of(t[1]), vertex_of(t[2])};
  }
}

}  // namespace

TriangleMesh extract_isosurface(std::span<const Vec3> positions, std::span<const float> radii,
                                const SurfaceModel& model, const IsosurfaceSettings& settings, IsosurfaceStats* stats) {
  constexpr double sampling_share = 0.6;  // of the time
  const double start = now();
  const float cell = settings.cell > 0 ? settings.cell : 0.5f * model.radius;
  const SurfaceField field(positions, radii, model);
  const SignGrid grid(field, cell, settings.progress, sampling_share);
  const double sampled = now();
  TriangleMesh mesh = Extractor(field, grid, settings.exact_vertices).run(settings.progress, sampling_share);
  if (stats) *stats = {grid.tile_count(), grid.sample_count(), sampled - start, now() - sampled};
  return mesh;
}

std::size_t component_count(const TriangleMesh& mesh) {
  // Each vertex leads to another of its piece, with a lower number but for the lowest.
  std::vector<std::uint32_t> lower(mesh.positions.size());
  std::iota(lower.begin(), lower.end(), 0u);
  const auto lowest = [&lower](std::uint32_t v) {
    while (lower[v] != v) v = lower[v] = lower[lower[v]];
    return v;
  };
  std::size_t count = lower.size();
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t corner : {t[1], t[2]}) {
      const std::uint32_t a = lowest(t[0]), b = lowest(corner);
      if (a == b) continue;
      lower[std::max(a, b)] = std::min(a, b);
      --count;
    }
  }
  return count;
}

double enclosed_volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
                c = to_double(mesh.positions[t[2]]);
    sum += dot(a, cross(b, c));
  }
  return sum / 6;
}

double surface_area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
                c = to_double(mesh.positions[t[2]]);
    sum += length(cross(b - a, c - a));
  }
  return sum / 2;
}

}  // namespace embrun
