#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/cell_model.h"
#include "geometry/cell_words.h"
#include "geometry/implicit_surface.h"
#include "geometry/implicit_surface_storage.h"
#include "geometry/kernels.h"
#include "geometry/particle_blocks.h"
#include "geometry/surface_model.h"

namespace embrun {

namespace {

constexpr int tile_side = 4;
constexpr std::size_t tile_cells = 64;
/// A split cell's list is at least this long: shorter ones cost less to scan than to divide.
constexpr std::size_t longest_unsplit_list = 256;
constexpr int deepest_split = 12;
/// Tiles of one piece of work; its lists are put together in the order of the pieces.
constexpr std::size_t tiles_per_piece = 8;

/// The grid and the particles sorted into it. Lengths in list units: lattice steps when radii are equal (an integer
/// lattice, so that every cell sees the same positions to the bit), grid units otherwise.
struct GridPlan {
  double origin[3];
  double cell_size;  ///< metres
  int tiles[3];
  int cells[3];
  bool equal_radii;
  double units_per_grid;  ///< list units a grid unit
  double bias;            ///< lattice coordinate of a cell's low corner in its own list
  double target;          ///< cells larger than this many grid units are split where the surface is
  CellFrame frame;
};

/// Particles of equal radii on the lattice, sorted by cell.
struct SortedLattice {
  std::vector<std::int32_t> x, y, z;
  std::vector<std::uint32_t> starts;  ///< of each cell's particles; one more than cells
};

struct RecoveredSource {
  Vec3d position;        ///< grid units
  float inverse_radius;  ///< 1/b'
  float weight;          ///< w / T'
};

/// A recovered particle near some box: grid units, relative to the tile's corner.
struct RecoveredParticle {
  float x, y, z;
  float inverse_radius, weight;
};

/// Records and lists of one piece of tiles, with offsets from its own beginnings.
struct Piece {
  std::vector<SurfaceCell> cells;
  std::vector<std::uint16_t> packed, packed_recovered;
  std::vector<float> wide, wide_recovered;
  std::uint64_t list_entries = 0;
  std::uint64_t near_leaves = 0;
};

/// Growing arrays of particles with room for a few more, reused from box to box.
struct Scratch {
  std::vector<float> x, y, z, reach;

  ParticleArrays arrays() { return {x.data(), y.data(), z.data(), reach.data()}; }
  ParticleArrays with_room(std::size_t count) {
    if (x.size() < count + 32) {
      const std::size_t size = 2 * count + 64;
      x.resize(size);
      y.resize(size);
      z.resize(size);
      reach.resize(size);
    }
    return arrays();
  }
};

/// Radius that half the particles' total volume lies under: what most of the surface is made of.
float median_volume_radius(std::span<const float> radii) {
  std::vector<float> sorted(radii.begin(), radii.end());
  std::sort(sorted.begin(), sorted.end());
  double total = 0;
  for (const float r : sorted) total += std::pow(static_cast<double>(r), 3);
  double sum = 0;
  for (const float r : sorted) {
    sum += std::pow(static_cast<double>(r), 3);
    if (sum >= 0.5 * total) return r;
  }
  return sorted.back();
}

GridPlan plan_grid(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceModel& model) {
  GridPlan plan;
  plan.equal_radii = radii.empty();
  Box3 bounds;
  for (const Vec3 p : positions) bounds.include(p);
  const float largest = radii.empty() ? model.radius : *std::max_element(radii.begin(), radii.end());
  const float typical = radii.empty() ? model.radius : median_volume_radius(radii);
  const double support = static_cast<double>(kernel_support(model.kernel));
  // Beyond the support of everything there is nothing; a little more keeps rounding inside.
  const double reach =
      support * std::max(static_cast<double>(model.influence_factor), 2.0) * static_cast<double>(largest) * 1.001;
  const double budget = std::max(12.0 * static_cast<double>(positions.size()), 262144.0);
  plan.cell_size = 2.0 * static_cast<double>(typical);
  plan.target = 1.0;
  double extent[3];
  for (int a = 0; a < 3; ++a) {
    extent[a] = static_cast<double>(bounds.high[a]) - static_cast<double>(bounds.low[a]) + 2.0 * reach;
  }
  const auto tiles_at = [&](int a, double size) { return std::ceil(extent[a] / (size * tile_side)); };
  while (tiles_at(0, plan.cell_size) * tiles_at(1, plan.cell_size) * tiles_at(2, plan.cell_size) * 64.0 > budget) {
    // A wide domain with few particles: coarser cells, split where the surface is.
    plan.cell_size *= 2.0;
    plan.target *= 0.5;
    if (plan.cell_size > 4.0 * std::max({extent[0], extent[1], extent[2]})) break;
  }
  for (int a = 0; a < 3; ++a) {
    plan.tiles[a] = std::max(1, static_cast<int>(tiles_at(a, plan.cell_size)));
    plan.cells[a] = plan.tiles[a] * tile_side;
    const double slack = plan.cells[a] * plan.cell_size - extent[a];
    plan.origin[a] = static_cast<double>(bounds.low[a]) - reach - 0.5 * slack;
  }

  plan.units_per_grid = 1.0;
  plan.bias = 0.0;
  const double reach_in_cells = support * static_cast<double>(model.influence_radius) / plan.cell_size;
  if (plan.equal_radii) {
    // 16 bits hold the support on both sides of a cell, and a value beyond it for empty lanes.
    plan.units_per_grid = std::floor(65400.0 / (2.0 * reach_in_cells + 1.0));
    plan.bias = std::ceil(reach_in_cells * plan.units_per_grid) + 8.0;
  }
  plan.frame = {model.kernel,
                plan.equal_radii,
                static_cast<float>(reach_in_cells * plan.units_per_grid),
                static_cast<float>(support),
                static_cast<float>(plan.units_per_grid),
                1.0f / model.threshold};
  return plan;
}

SortedLattice sort_particles(std::span<const Vec3> positions, const GridPlan& plan) {
  const std::size_t count = positions.size();
  const double scale = plan.units_per_grid / plan.cell_size;
  const auto per_cell = static_cast<std::int32_t>(plan.units_per_grid);
  std::vector<std::int32_t> x(count), y(count), z(count);
  std::vector<std::uint32_t> cell(count);
  parallel_for(count, 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      x[i] = static_cast<std::int32_t>((static_cast<double>(positions[i].x) - plan.origin[0]) * scale + 0.5);
      y[i] = static_cast<std::int32_t>((static_cast<double>(positions[i].y) - plan.origin[1]) * scale + 0.5);
      z[i] = static_cast<std::int32_t>((static_cast<double>(positions[i].z) - plan.origin[2]) * scale + 0.5);
      cell[i] = static_cast<std::uint32_t>(((z[i] / per_cell) * plan.cells[1] + y[i] / per_cell) * plan.cells[0] +
                                           x[i] / per_cell);
    }
  });
  SortedLattice sorted;
  sorted.starts.assign(static_cast<std::size_t>(plan.cells[0]) * static_cast<std::size_t>(plan.cells[1]) *
                               static_cast<std::size_t>(plan.cells[2]) +
                           1,
                       0);
  for (const std::uint32_t c : cell) ++sorted.starts[c + 1];
  for (std::size_t c = 1; c < sorted.starts.size(); ++c) sorted.starts[c] += sorted.starts[c - 1];
  sorted.x.resize(count);
  sorted.y.resize(count);
  sorted.z.resize(count);
  std::vector<std::uint32_t> next(sorted.starts.begin(), sorted.starts.end() - 1);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t to = next[cell[i]]++;
    sorted.x[to] = x[i];
    sorted.y[to] = y[i];
    sorted.z[to] = z[i];
  }
  return sorted;
}

/// Builds the cells of one tile after the other; one for each running task.
class TileBuilder {
 public:
  TileBuilder(const GridPlan& plan, const SortedLattice& sorted, std::span<const Vec3> positions,
              std::span<const float> radii, const ParticleBlocks& blocks, const SurfaceModel& model,
              const ParticleBlocks& recovered_blocks, std::span<const RecoveredSource> recovered)
      : plan_(plan),
        sorted_(sorted),
        positions_(positions),
        radii_(radii),
        blocks_(blocks),
        influence_factor_(model.influence_factor),
        recover_threshold_(model.recover_threshold),
        recovered_blocks_(recovered_blocks),
        recovered_(recovered),
        loops_(cell_model_loops()) {}

  void build(int tx, int ty, int tz, Piece& piece, SurfaceTile& tile) {
    tile = {};
    corner_[0] = tx * tile_side;
    corner_[1] = ty * tile_side;
    corner_[2] = tz * tile_side;
    const std::size_t count = plan_.equal_radii ? take_from_lattice() : take_from_blocks();
    take_recovered();
    tile.first_cell = static_cast<std::uint32_t>(piece.cells.size());
    if (count == 0 && tile_recovered_.empty()) return;

    const auto unit = static_cast<float>(plan_.units_per_grid);
    const std::size_t in_tile = loops_.gather(plan_.frame, all_.arrays(), count, Vec3{2 * unit, 2 * unit, 2 * unit},
                                              2 * unit, tile_.with_room(count));
    for (int brick = 0; brick < 8; ++brick) {
      const int bx = 2 * (brick & 1), by = brick & 2, bz = (brick & 4) / 2;
      const Vec3 brick_center =
          Vec3{static_cast<float>(bx + 1), static_cast<float>(by + 1), static_cast<float>(bz + 1)} * unit;
      const std::size_t in_brick =
          loops_.gather(plan_.frame, tile_.arrays(), in_tile, brick_center, unit, brick_.with_room(in_tile));
      take_box_recovered(tile_recovered_, brick_center * (1.0f / unit), 1.0f, brick_recovered_);
      for (int i = 0; i < 8; ++i) {
        examine_top_cell((bz + (i >> 2)) * 16 + (by + ((i >> 1) & 1)) * 4 + bx + (i & 1), in_brick, piece, tile);
      }
    }
    // Records in the order of the cells in the tile, so that a rank in near_mask finds them; then the splits' children.
    std::vector<Pending> splits;
    for (int cell = 0; cell < static_cast<int>(tile_cells); ++cell) {
      if (((tile.near_mask >> cell) & 1u) == 0) continue;
      const SurfaceCell& record = records_[static_cast<std::size_t>(cell)];
      if (record.kind == SurfaceCellKind::split)
        splits.push_back({piece.cells.size(), cell_center(cell), 0.5f * unit, 0});
      piece.cells.push_back(record);
    }
    while (!splits.empty()) {
      const Pending split = splits.back();
      splits.pop_back();
      divide(piece, split, in_tile, splits);
    }
  }

 private:
  struct Pending {
    std::size_t record;
    Vec3 center;
    float half;
    int depth;
  };

  Vec3 cell_center(int cell) const {
    const auto unit = static_cast<float>(plan_.units_per_grid);
    return Vec3{static_cast<float>(cell & 3) + 0.5f, static_cast<float>((cell >> 2) & 3) + 0.5f,
                static_cast<float>(cell >> 4) + 0.5f} *
           unit;
  }

  /// The particles of the tile and of the cells within reach of it, relative to the tile's corner.
  std::size_t take_from_lattice() {
    const int reach = static_cast<int>(std::ceil(plan_.frame.reach / plan_.frame.units_per_grid));
    int low[3], high[3];
    for (int a = 0; a < 3; ++a) {
      low[a] = std::max(corner_[a] - reach, 0);
      high[a] = std::min(corner_[a] + tile_side + reach, plan_.cells[a]);
    }
    const auto per_cell = static_cast<std::int32_t>(plan_.units_per_grid);
    const std::int32_t ox = corner_[0] * per_cell, oy = corner_[1] * per_cell, oz = corner_[2] * per_cell;
    std::size_t count = 0;
    for (int z = low[2]; z < high[2]; ++z) {
      for (int y = low[1]; y < high[1]; ++y) {
        const std::size_t row =
            (static_cast<std::size_t>(z) * static_cast<std::size_t>(plan_.cells[1]) + static_cast<std::size_t>(y)) *
            static_cast<std::size_t>(plan_.cells[0]);
        const std::size_t begin = sorted_.starts[row + static_cast<std::size_t>(low[0])];
        const std::size_t end = sorted_.starts[row + static_cast<std::size_t>(high[0])];
        if (begin == end) continue;
        const ParticleArrays out = all_.with_room(count + (end - begin));
        for (std::size_t i = begin; i < end; ++i, ++count) {
          out.x[count] = static_cast<float>(sorted_.x[i] - ox);
          out.y[count] = static_cast<float>(sorted_.y[i] - oy);
          out.z[count] = static_cast<float>(sorted_.z[i] - oz);
        }
      }
    }
    all_.with_room(count);
    return count;
  }

  /// Scene box of the tile.
  void scene_box(Vec3& low, Vec3& high) const {
    for (int a = 0; a < 3; ++a) {
      low[a] = static_cast<float>(plan_.origin[a] + plan_.cell_size * corner_[a]);
      high[a] = static_cast<float>(plan_.origin[a] + plan_.cell_size * (corner_[a] + tile_side));
    }
  }

  std::size_t take_from_blocks() {
    Vec3 low, high;
    scene_box(low, high);
    near_.clear();
    blocks_.find_near(low, high, near_);
    const ParticleArrays out = all_.with_room(near_.size() * 16);
    std::size_t count = 0;
    for (const std::uint32_t n : near_) {
      for (std::size_t i = 0; i < 16; ++i) {
        const std::uint32_t source = blocks_.sources()[16 * n + i];
        if (source == ParticleBlocks::no_particle) continue;
        out.x[count] = grid_coordinate(positions_[source].x, 0);
        out.y[count] = grid_coordinate(positions_[source].y, 1);
        out.z[count] = grid_coordinate(positions_[source].z, 2);
        out.reach[count] =
            plan_.frame.support * influence_factor_ * radii_[source] / static_cast<float>(plan_.cell_size);
        ++count;
      }
    }
    return count;
  }

  float grid_coordinate(float v, int axis) const {
    return static_cast<float>((static_cast<double>(v) - plan_.origin[axis]) / plan_.cell_size - corner_[axis]);
  }

  /// Recovered particles felt in the tile: grid units, relative to the tile's corner.
  void take_recovered() {
    tile_recovered_.clear();
    if (recovered_.empty()) return;
    Vec3 low, high;
    scene_box(low, high);
    near_.clear();
    recovered_blocks_.find_near(low, high, near_);
    for (const std::uint32_t n : near_) {
      for (std::size_t i = 0; i < 16; ++i) {
        const std::uint32_t source = recovered_blocks_.sources()[16 * n + i];
        if (source == ParticleBlocks::no_particle) continue;
        const RecoveredSource& r = recovered_[source];
        tile_recovered_.push_back({static_cast<float>(r.position.x - corner_[0]),
                                   static_cast<float>(r.position.y - corner_[1]),
                                   static_cast<float>(r.position.z - corner_[2]), r.inverse_radius, r.weight});
      }
    }
  }

  /// Those of `from` that are felt in the box center +- half (grid units); returns the most they can sum to there.
  float take_box_recovered(const std::vector<RecoveredParticle>& from, Vec3 center, float half,
                           std::vector<RecoveredParticle>& to) const {
    to.clear();
    const float support = plan_.frame.support;
    float most = 0.0f;
    for (const RecoveredParticle& r : from) {
      const Vec3 d{std::abs(r.x - center.x) - half, std::abs(r.y - center.y) - half, std::abs(r.z - center.z) - half};
      const float square = length_squared(max_of(d, Vec3{})) * r.inverse_radius * r.inverse_radius;
      if (square >= support * support) continue;
      most += r.weight * kernel_value(plan_.frame.kernel, std::sqrt(square));
      to.push_back(r);
    }
    return most;
  }

  void examine_top_cell(int index, std::size_t in_brick, Piece& piece, SurfaceTile& tile) {
    const auto unit = static_cast<float>(plan_.units_per_grid);
    const Vec3 center = cell_center(index);
    SurfaceCell& record = records_[static_cast<std::size_t>(index)];
    const std::size_t listed =
        loops_.gather(plan_.frame, brick_.arrays(), in_brick, center, 0.5f * unit, cell_.with_room(in_brick));
    examine(center, 0.5f * unit, listed, brick_recovered_, record);
    if (record.kind == SurfaceCellKind::near) {
      tile.near_mask |= std::uint64_t{1} << index;
      if (wants_split(record, 1.0, listed)) {
        record.kind = SurfaceCellKind::split;
      } else {
        finish_leaf(piece, record, center, listed);
      }
    } else if (record.kind == SurfaceCellKind::inside) {
      tile.inside_mask |= std::uint64_t{1} << index;
    }
  }

  /// Decides about the cell whose particles are in cell_, the recovered ones of `from` taken into account: they are
  /// left in cell_recovered_; none when they cannot reach their threshold in the cell. A
  /// cell that only those reach gets a quadratic of -1 without slack.
  void examine(Vec3 center, float half, std::size_t listed, const std::vector<RecoveredParticle>& from,
               SurfaceCell& record) {
    record = {};
    loops_.examine(plan_.frame, cell_.arrays(), listed, nearer_.with_room(listed), center, half, record);
    cell_recovered_.clear();
    if (record.kind == SurfaceCellKind::inside || from.empty()) return;
    const float to_grid = 1.0f / static_cast<float>(plan_.units_per_grid);
    const Vec3 middle = center * to_grid;
    if (take_box_recovered(from, middle, half * to_grid, cell_recovered_) < 0.9999f) {
      cell_recovered_.clear();
      return;
    }
    if (record.kind != SurfaceCellKind::near) {
      record = {};
      record.quadratic[0] = -1.0f;
      record.kind = SurfaceCellKind::near;
    }
  }

  /// The particles felt in a box into cell_, from the tile's.
  std::size_t regather(Vec3 center, float half, std::size_t in_tile) {
    return loops_.gather(plan_.frame, tile_.arrays(), in_tile, center, half, cell_.with_room(in_tile));
  }

  bool is_main(const SurfaceCell& record) const { return record.quadratic[0] != -1.0f || record.upper != 0.0f; }

  bool wants_split(const SurfaceCell& record, double size, std::size_t listed) {
    if (size > 1.01 * plan_.target) return true;
    if (plan_.equal_radii) return false;
    const auto unit = static_cast<float>(plan_.units_per_grid);
    const std::size_t entries = is_main(record) ? listed : 0;
    if (entries + cell_recovered_.size() <= longest_unsplit_list) return false;
    // Worth it if many are small against the cell: the others stay in every child's list.
    std::size_t small = 0;
    const auto limit = static_cast<float>(size) * unit;
    for (std::size_t i = 0; i < entries; ++i) small += cell_.reach[i] < limit ? 1 : 0;
    for (const RecoveredParticle& r : cell_recovered_) {
      small += 1.0f / r.inverse_radius < static_cast<float>(size) ? 1 : 0;
    }
    return 2 * small > entries + cell_recovered_.size();
  }

  void divide(Piece& piece, const Pending& split, std::size_t in_tile, std::vector<Pending>& splits) {
    const std::size_t first = piece.cells.size();
    piece.cells.resize(first + 8);
    piece.cells[split.record] = {};
    piece.cells[split.record].kind = SurfaceCellKind::split;
    piece.cells[split.record].list = static_cast<std::uint32_t>(first);
    const float half = 0.5f * split.half;
    const double size = 2.0 * static_cast<double>(half) / plan_.units_per_grid;
    for (std::size_t i = 0; i < 8; ++i) {
      const Vec3 center =
          split.center + Vec3{(i & 1) != 0 ? half : -half, (i & 2) != 0 ? half : -half, (i & 4) != 0 ? half : -half};
      SurfaceCell record;
      const std::size_t listed = regather(center, half, in_tile);
      examine(center, half, listed, tile_recovered_, record);
      if (record.kind == SurfaceCellKind::near) {
        if (split.depth + 1 < deepest_split && wants_split(record, size, listed)) {
          splits.push_back({first + i, center, half, split.depth + 1});
        } else {
          finish_leaf(piece, record, center, listed);
        }
      }
      piece.cells[first + i] = record;
    }
  }

  /// Writes the lists of a near leaf whose particles are in cell_ and cell_recovered_.
  void finish_leaf(Piece& piece, SurfaceCell& record, Vec3 center, std::size_t listed) {
    ++piece.near_leaves;
    if (is_main(record)) {
      const std::size_t blocks = (listed + 15) / 16;
      if (blocks > std::numeric_limits<std::uint16_t>::max()) {
        throw Error("too many particles overlap one place: the neighbourhood order or the radii are too large");
      }
      record.list_blocks = static_cast<std::uint16_t>(blocks);
      piece.list_entries += listed;
      if (plan_.equal_radii) {
        record.list = static_cast<std::uint32_t>(piece.packed.size() / packed_stride);
        write_packed(piece, center, listed, blocks);
      } else {
        record.list = static_cast<std::uint32_t>(piece.wide.size() / wide_stride);
        write_wide(piece, center, listed, blocks);
      }
    }
    if (!cell_recovered_.empty()) {
      const std::size_t blocks = (cell_recovered_.size() + 15) / 16;
      if (blocks > std::numeric_limits<std::uint16_t>::max()) {
        throw Error("too many lone particles overlap one place: the radii are too large");
      }
      record.recovered_blocks = static_cast<std::uint16_t>(blocks);
      if (plan_.equal_radii) {
        record.recovered = static_cast<std::uint32_t>(piece.packed_recovered.size() / packed_recovered_stride);
        write_packed_recovered(piece, center, blocks);
      } else {
        record.recovered = static_cast<std::uint32_t>(piece.wide_recovered.size() / wide_recovered_stride);
        write_wide_recovered(piece, center, blocks);
      }
    }
  }

  void write_packed_recovered(Piece& piece, Vec3 center, std::size_t blocks) {
    const auto unit = static_cast<float>(plan_.units_per_grid);
    const float shift = static_cast<float>(plan_.bias) + 0.5f * unit + 0.5f;  // to the nearest
    const std::size_t first = piece.packed_recovered.size();
    piece.packed_recovered.resize(first + blocks * packed_recovered_stride, 65535);
    for (std::size_t i = 0; i < blocks * 16; ++i) {
      std::uint16_t* out = piece.packed_recovered.data() + first + i / 16 * packed_recovered_stride + i % 16;
      out[48] = 0;
      if (i >= cell_recovered_.size()) continue;
      const RecoveredParticle& r = cell_recovered_[i];
      out[0] = static_cast<std::uint16_t>(r.x * unit - center.x + shift);
      out[16] = static_cast<std::uint16_t>(r.y * unit - center.y + shift);
      out[32] = static_cast<std::uint16_t>(r.z * unit - center.z + shift);
      out[48] = static_cast<std::uint16_t>(r.weight * recover_threshold_ * 65535.0f + 0.5f);
    }
  }

  void write_wide_recovered(Piece& piece, Vec3 center, std::size_t blocks) {
    const std::size_t first = piece.wide_recovered.size();
    piece.wide_recovered.resize(first + blocks * wide_recovered_stride, 1e9f);
    for (std::size_t i = 0; i < blocks * 16; ++i) {
      float* out = piece.wide_recovered.data() + first + i / 16 * wide_recovered_stride + i % 16;
      out[48] = 1.0f;
      out[64] = 0.0f;
      if (i >= cell_recovered_.size()) continue;
      const RecoveredParticle& r = cell_recovered_[i];
      out[0] = r.x - center.x;
      out[16] = r.y - center.y;
      out[32] = r.z - center.z;
      out[48] = r.inverse_radius;
      out[64] = r.weight * recover_threshold_;
    }
  }

  void write_packed(Piece& piece, Vec3 center, std::size_t listed, std::size_t blocks) {
    // The lists of all levels have the origin that the field's code expects: half a top cell below the leaf's centre.
    const auto unit = static_cast<float>(plan_.units_per_grid);
    const float shift = static_cast<float>(plan_.bias) + 0.5f * unit;
    const std::size_t first = piece.packed.size();
    piece.packed.resize(first + blocks * packed_stride);
    const float* coordinates[3] = {cell_.x.data(), cell_.y.data(), cell_.z.data()};
    for (int a = 0; a < 3; ++a) {
      const float offset = shift - center[a];
      for (std::size_t block = 0; block < blocks; ++block) {
        std::uint16_t* out = piece.packed.data() + first + block * packed_stride + static_cast<std::size_t>(a) * 16;
        const float* in = coordinates[a] + block * 16;
        // Lanes past the last particle are far away; they must not be converted.
        const std::size_t used = std::min<std::size_t>(16, listed - block * 16);
        for (std::size_t i = 0; i < used; ++i) out[i] = static_cast<std::uint16_t>(static_cast<int>(in[i] + offset));
        for (std::size_t i = used; i < 16; ++i) out[i] = 65535;
      }
    }
  }

  void write_wide(Piece& piece, Vec3 center, std::size_t listed, std::size_t blocks) {
    const std::size_t first = piece.wide.size();
    piece.wide.resize(first + blocks * wide_stride, 1e9f);
    float* out = piece.wide.data() + first;
    for (std::size_t i = 0; i < blocks * 16; ++i) {
      float* block = out + i / 16 * wide_stride + i % 16;
      if (i < listed) {
        block[0] = cell_.x[i] - center.x;
        block[16] = cell_.y[i] - center.y;
        block[32] = cell_.z[i] - center.z;
      }
      block[48] = i < listed ? plan_.frame.support / cell_.reach[i] : 1.0f;
    }
  }

  const GridPlan& plan_;
  const SortedLattice& sorted_;
  std::span<const Vec3> positions_;
  std::span<const float> radii_;
  const ParticleBlocks& blocks_;
  float influence_factor_, recover_threshold_;
  const ParticleBlocks& recovered_blocks_;
  std::span<const RecoveredSource> recovered_;
  const CellModelLoops& loops_;
  int corner_[3] = {0, 0, 0};
  Scratch all_, tile_, brick_, cell_, nearer_;
  std::vector<std::uint32_t> near_;
  std::vector<RecoveredParticle> tile_recovered_, brick_recovered_, cell_recovered_;
  SurfaceCell records_[tile_cells];
};

/// Puts the pieces' records and lists together, in order.
void join_pieces(std::vector<Piece>& pieces, std::vector<SurfaceTile>& tiles, ImplicitSurface::Storage& storage) {
  struct Offsets {
    std::size_t cells = 0, packed = 0, wide = 0, packed_recovered = 0, wide_recovered = 0;
  };
  std::vector<Offsets> offsets(pieces.size());
  Offsets total;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    offsets[i] = total;
    total.cells += pieces[i].cells.size();
    total.packed += pieces[i].packed.size();
    total.wide += pieces[i].wide.size();
    total.packed_recovered += pieces[i].packed_recovered.size();
    total.wide_recovered += pieces[i].wide_recovered.size();
    storage.stats.near_cells += pieces[i].near_leaves;
    storage.stats.mean_list_length += static_cast<double>(pieces[i].list_entries);
  }
  constexpr std::size_t most = std::numeric_limits<std::uint32_t>::max();
  if (total.cells >= cell_word::inside || total.packed / packed_stride > most || total.wide / wide_stride > most) {
    throw Error("the surface has more cells than its indices can name");
  }
  storage.cells.resize(total.cells);
  storage.packed_lists.resize(total.packed);
  storage.wide_lists.resize(total.wide);
  storage.packed_recovered.resize(total.packed_recovered);
  storage.wide_recovered.resize(total.wide_recovered);
  parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Piece& piece = pieces[i];
      const Offsets& o = offsets[i];
      for (SurfaceCell& cell : piece.cells) {
        if (cell.kind == SurfaceCellKind::split) {
          cell.list += static_cast<std::uint32_t>(o.cells);
        } else {
          cell.list += static_cast<std::uint32_t>(o.packed / packed_stride + o.wide / wide_stride);
          cell.recovered += static_cast<std::uint32_t>(o.packed_recovered / packed_recovered_stride +
                                                       o.wide_recovered / wide_recovered_stride);
        }
      }
      const auto append = [](const auto& from, auto& to, std::size_t at) {
        std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(at));
      };
      append(piece.cells, storage.cells, o.cells);
      append(piece.packed, storage.packed_lists, o.packed);
      append(piece.wide, storage.wide_lists, o.wide);
      append(piece.packed_recovered, storage.packed_recovered, o.packed_recovered);
      append(piece.wide_recovered, storage.wide_recovered, o.wide_recovered);
      piece = {};
      const std::size_t last = std::min(tiles.size(), (i + 1) * tiles_per_piece);
      for (std::size_t t = i * tiles_per_piece; t < last; ++t) {
        tiles[t].first_cell += static_cast<std::uint32_t>(o.cells);
      }
    }
  });
}

}  // namespace

ImplicitSurface build_implicit_surface(std::span<const Vec3> positions, std::span<const float> radii,
                                       const SurfaceSettings& settings) {
  const SurfaceModel model = resolve_surface_model(positions, radii, settings);
  const GridPlan plan = plan_grid(positions, radii, model);

  SortedLattice sorted;
  ParticleBlocks blocks;
  if (plan.equal_radii) {
    sorted = sort_particles(positions, plan);
  } else {
    std::vector<float> influence(radii.begin(), radii.end());
    for (float& b : influence) b *= model.influence_factor;
    blocks = ParticleBlocks(positions, influence, {}, kernel_support(model.kernel));
  }
  std::vector<RecoveredSource> recovered(model.recovered.size());
  std::vector<Vec3> recovered_positions(recovered.size());
  std::vector<float> recovered_radii(recovered.size());
  for (std::size_t i = 0; i < recovered.size(); ++i) {
    const std::uint32_t source = model.recovered[i];
    const Vec3 p = positions[source];
    const float radius = model.recover_factor * (radii.empty() ? model.radius : radii[source]);
    recovered_positions[i] = p;
    recovered_radii[i] = radius;
    recovered[i].position = {(static_cast<double>(p.x) - plan.origin[0]) / plan.cell_size,
                             (static_cast<double>(p.y) - plan.origin[1]) / plan.cell_size,
                             (static_cast<double>(p.z) - plan.origin[2]) / plan.cell_size};
    recovered[i].inverse_radius = static_cast<float>(plan.cell_size / static_cast<double>(radius));
    recovered[i].weight = model.recovered_weights[i] / model.recover_threshold;
  }
  ParticleBlocks recovered_blocks;
  if (!recovered.empty()) {
    recovered_blocks = ParticleBlocks(recovered_positions, recovered_radii, {}, kernel_support(model.kernel));
  }

  auto storage = std::make_unique<ImplicitSurface::Storage>();
  const std::size_t tile_count = static_cast<std::size_t>(plan.tiles[0]) * static_cast<std::size_t>(plan.tiles[1]) *
                                 static_cast<std::size_t>(plan.tiles[2]);
  std::vector<SurfaceTile> tiles(tile_count);
  std::vector<Piece> pieces((tile_count + tiles_per_piece - 1) / tiles_per_piece);
  parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    TileBuilder builder(plan, sorted, positions, radii, blocks, model, recovered_blocks, recovered);
    for (std::size_t i = begin; i < end; ++i) {
      const std::size_t last = std::min(tile_count, (i + 1) * tiles_per_piece);
      for (std::size_t t = i * tiles_per_piece; t < last; ++t) {
        const auto row = static_cast<std::size_t>(plan.tiles[0]);
        const auto slab = row * static_cast<std::size_t>(plan.tiles[1]);
        builder.build(static_cast<int>(t % row), static_cast<int>(t % slab / row), static_cast<int>(t / slab),
                      pieces[i], tiles[t]);
      }
    }
  });
  join_pieces(pieces, tiles, *storage);
  storage->words = make_cell_words(tiles, plan.tiles);

  ImplicitSurfaceView& view = storage->view;
  for (int a = 0; a < 3; ++a) {
    view.origin[a] = plan.origin[a];
    view.cells[a] = plan.cells[a];
    view.tiles[a] = plan.tiles[a];
  }
  view.cell_size = static_cast<float>(plan.cell_size);
  view.cells_per_metre = 1.0 / plan.cell_size;
  view.words = storage->words.data();
  view.cell = storage->cells.data();
  view.packed_lists = storage->packed_lists.data();
  view.wide_lists = storage->wide_lists.data();
  view.packed_recovered = storage->packed_recovered.data();
  view.wide_recovered = storage->wide_recovered.data();
  view.inverse_threshold = 1.0f / model.threshold;
  view.recovered_inverse_threshold = 1.0f / model.recover_threshold;
  view.recovered_inverse_influence = static_cast<float>(plan.cell_size / static_cast<double>(model.recover_radius));
  view.inverse_influence = static_cast<float>(plan.cell_size / static_cast<double>(model.influence_radius));
  view.lattice_per_cell = static_cast<float>(plan.units_per_grid);
  view.lattice_bias = static_cast<float>(plan.bias);
  view.kernel = model.kernel;
  view.normal = model.normal;
  view.equal_radii = plan.equal_radii;

  ImplicitSurfaceStats& stats = storage->stats;
  stats.particles = positions.size();
  stats.recovered_particles = recovered.size();
  stats.cells = tile_count * tile_cells;
  stats.mean_list_length /= std::max<double>(1.0, static_cast<double>(stats.near_cells));
  stats.bytes = storage->words.size() * sizeof(std::uint32_t) + storage->cells.size() * sizeof(SurfaceCell) +
                storage->packed_lists.size() * sizeof(std::uint16_t) +
                storage->packed_recovered.size() * sizeof(std::uint16_t) +
                (storage->wide_lists.size() + storage->wide_recovered.size()) * sizeof(float);
  stats.influence_radius = model.influence_radius;
  stats.threshold = model.threshold;
  return ImplicitSurface(std::move(storage));
}

}  // namespace embrun
