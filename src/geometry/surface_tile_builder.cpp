#include "geometry/surface_tile_builder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "base/error.h"
#include "geometry/kernels.h"
#include "geometry/particle_eights.h"

namespace embrun {

namespace {

/// A split cell's list is longer than this: shorter ones cost less to scan than to divide. Half as long again as the lists
/// of equal radii are, whose mean is about 7 n^2.
std::size_t longest_unsplit_list(float influence_factor) {
  return static_cast<std::size_t>(std::max(32.0f, 2.5f * influence_factor * influence_factor));
}

/// Eights of particles that a list may have: far more than any that is of use.
constexpr std::size_t most_eights = 65535;

constexpr std::uint32_t no_entry = 0xffffffffu;

/// The parts of a cell that a box, in grid units from the cell's centre, touches.
CellBox parts_of(const Box3& box) {
  int first[3], last[3];
  const auto number = [](float coordinate) { return std::clamp(static_cast<int>(coordinate), 0, CellBox::parts - 1); };
  for (int a = 0; a < 3; ++a) {
    first[a] = number((box.low[a] + 0.5f) * CellBox::parts);
    last[a] = number(std::ceil((box.high[a] + 0.5f) * CellBox::parts) - 1.0f);
  }
  return CellBox::of(first, last);
}

/// The nearest lattice step, of coordinates of packed lists: made positive, by 2^20 and a half, where truncating is rounding
/// down.
std::int32_t nearest_step(float coordinate) {
  return static_cast<std::int32_t>(coordinate + (packed_end + 1.5f)) - (packed_end + 1);
}
PackedPosition pack_nearest(Vec3 steps) {
  return pack_position(nearest_step(steps.x), nearest_step(steps.y), nearest_step(steps.z));
}

/// A cell of a tile by its brick and its number there.
int brick_cell(int brick, int in_brick) {
  const int x = 2 * (brick & 1) + (in_brick & 1), y = (brick & 2) + (in_brick >> 1 & 1),
            z = brick / 4 * 2 + in_brick / 4;
  return z * 16 + y * 4 + x;
}

/// How many eights a part of a list has, so that a cell's bits are enough for all parts.
int part_log2(std::size_t eights) {
  int log2 = 0;
  while ((std::size_t{32} << log2) < eights) ++log2;
  return log2;
}

}  // namespace

TileBuilder::TileBuilder(const GridPlan& plan, const SortedLattice& sorted, std::span<const Vec3> positions,
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

void TileBuilder::build(int tx, int ty, int tz, SurfacePiece& piece, SurfaceTile& tile) {
  tile = {};
  corner_[0] = tx * tile_side;
  corner_[1] = ty * tile_side;
  corner_[2] = tz * tile_side;
  const std::size_t count = plan_.equal_radii ? take_from_lattice() : take_from_blocks();
  take_recovered();
  tile.first_cell = static_cast<std::uint32_t>(piece.records.cells.size());
  if (count == 0 && tile_recovered_.empty()) return;

  const auto unit = static_cast<float>(plan_.units_per_grid);
  const std::size_t in_tile = loops_.gather(plan_.frame, all_.arrays(), count, Vec3{2 * unit, 2 * unit, 2 * unit},
                                            2 * unit, tile_.with_room(count));
  for (int brick = 0; brick < 8; ++brick) {
    const Vec3 brick_center = brick_middle(brick);
    const std::size_t in_brick =
        loops_.gather(plan_.frame, tile_.arrays(), in_tile, brick_center, unit, brick_.with_room(in_tile));
    take_box_recovered(tile_recovered_, brick_center / unit, 1.0f, brick_recovered_);
    marks_.assign(in_brick, 0);
    for (int i = 0; i < 8; ++i) examine_top_cell(brick_cell(brick, i), i, in_brick, piece, tile);
    write_brick_list(piece, brick, in_brick);
  }
  // Records in the order of the cells in the tile, so that a rank in near_mask finds them; then the splits' children.
  std::vector<Pending> splits;
  for (int cell = 0; cell < static_cast<int>(tile_cells); ++cell) {
    if (((tile.near_mask >> cell) & 1u) == 0) continue;
    const SurfaceCell& record = records_[static_cast<std::size_t>(cell)];
    if (record.kind == SurfaceCellKind::split)
      splits.push_back({piece.records.cells.size(), cell_center(cell), 0.5f * unit, 0});
    piece.records.cells.push_back(record);
  }
  while (!splits.empty()) {
    const Pending split = splits.back();
    splits.pop_back();
    divide(piece, split, in_tile, splits);
  }
}

Vec3 TileBuilder::cell_center(int cell) const {
  const auto unit = static_cast<float>(plan_.units_per_grid);
  return Vec3{static_cast<float>(cell & 3) + 0.5f, static_cast<float>((cell >> 2) & 3) + 0.5f,
              static_cast<float>(cell >> 4) + 0.5f} *
         unit;
}

Vec3 TileBuilder::brick_middle(int brick) const {
  const auto unit = static_cast<float>(plan_.units_per_grid);
  return Vec3{static_cast<float>(2 * (brick & 1) + 1), static_cast<float>((brick & 2) + 1),
              static_cast<float>((brick >> 2) * 2 + 1)} *
         unit;
}

std::size_t TileBuilder::take_from_lattice() {
  const int reach = static_cast<int>(std::ceil(plan_.frame.reach / plan_.frame.units_per_grid));
  int low[3], high[3];
  for (int a = 0; a < 3; ++a) {
    low[a] = std::max(corner_[a] - reach, 0);
    high[a] = std::min(corner_[a] + tile_side + reach, plan_.cells[a]);
  }
  const auto unit = static_cast<float>(plan_.units_per_grid);
  const auto cells_x = static_cast<std::size_t>(plan_.cells[0]), cells_y = static_cast<std::size_t>(plan_.cells[1]);
  std::size_t count = 0;
  for (int z = low[2]; z < high[2]; ++z) {
    const float from_z = static_cast<float>(z - corner_[2]) * unit;
    for (int y = low[1]; y < high[1]; ++y) {
      const float from_y = static_cast<float>(y - corner_[1]) * unit;
      const std::uint32_t* starts =
          sorted_.starts.data() + (static_cast<std::size_t>(z) * cells_y + static_cast<std::size_t>(y)) * cells_x;
      if (starts[low[0]] == starts[high[0]]) continue;
      const ParticleArrays out = all_.with_room(count + (starts[high[0]] - starts[low[0]]));
      for (int x = low[0]; x < high[0]; ++x) {
        const float from_x = static_cast<float>(x - corner_[0]) * unit;
        for (std::size_t i = starts[x]; i < starts[x + 1]; ++i, ++count) {
          out.x[count] = sorted_.x[i] + from_x;
          out.y[count] = sorted_.y[i] + from_y;
          out.z[count] = sorted_.z[i] + from_z;
        }
      }
    }
  }
  all_.with_room(count);
  return count;
}

void TileBuilder::scene_box(Vec3& low, Vec3& high) const {
  for (int a = 0; a < 3; ++a) {
    low[a] = static_cast<float>(plan_.origin[a] + plan_.cell_size * corner_[a]);
    high[a] = static_cast<float>(plan_.origin[a] + plan_.cell_size * (corner_[a] + tile_side));
  }
}

std::size_t TileBuilder::take_from_blocks() {
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
      out.reach[count] = plan_.frame.support * influence_factor_ * radii_[source] / static_cast<float>(plan_.cell_size);
      ++count;
    }
  }
  return count;
}

float TileBuilder::grid_coordinate(float v, int axis) const {
  return static_cast<float>((static_cast<double>(v) - plan_.origin[axis]) / plan_.cell_size - corner_[axis]);
}

void TileBuilder::take_recovered() {
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

float TileBuilder::take_box_recovered(const std::vector<RecoveredParticle>& from, Vec3 center, float half,
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

void TileBuilder::examine_top_cell(int index, int in_its_brick, std::size_t in_brick, SurfacePiece& piece,
                                   SurfaceTile& tile) {
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
      ++piece.near_leaves;
      if (is_main(record)) {
        piece.list_entries += listed;
        loops_.mark(plan_.frame, brick_.arrays(), in_brick, center, 0.5f * unit,
                    static_cast<std::uint8_t>(1 << in_its_brick), marks_.data());
      }
      write_recovered(piece, record, center);
    }
  } else if (record.kind == SurfaceCellKind::inside) {
    tile.inside_mask |= std::uint64_t{1} << index;
  }
}

void TileBuilder::examine(Vec3 center, float half, std::size_t listed, const std::vector<RecoveredParticle>& from,
                          SurfaceCell& record) {
  record = {};
  loops_.examine(plan_.frame, cell_.arrays(), listed, nearer_.with_room(listed), center, half, record);
  if (record.kind == SurfaceCellKind::near) record.list_bits = 1;  // until its list is written
  cell_recovered_.clear();
  if (record.kind == SurfaceCellKind::inside || from.empty()) return;
  // Quotients, since a cell's middle is a sum of halves of grid units, which they give to the bit.
  const auto unit = static_cast<float>(plan_.units_per_grid);
  const Vec3 middle = center / unit;
  const float size = half / unit;
  if (take_box_recovered(from, middle, size, cell_recovered_) < recovered_reach ||
      !loops_.bound_recovered(plan_.frame, cell_recovered_.data(), cell_recovered_.size(), middle, size,
                              recovered_slack(size), recovered_box_)) {
    cell_recovered_.clear();
    return;
  }
  if (record.kind == SurfaceCellKind::near) return;
  record = {};
  if (fit_recovered(middle, size, record)) {
    record.kind = SurfaceCellKind::near;
  } else {
    cell_recovered_.clear();
  }
}

float TileBuilder::recovered_slack(float half) const {
  return 4e-4f * half + (plan_.equal_radii ? 1.0f / plan_.recovered_units_per_grid : 0.0f);
}

float TileBuilder::recovered_extent(Vec3 middle, float half) const {
  // Beyond u b' of all of them each is felt at most as it is there, and nowhere more than at the box's nearest point.
  const auto most_beyond = [&](float u) {
    float most = 0.0f;
    const float here = kernel_value(plan_.frame.kernel, u);
    for (const RecoveredParticle& r : cell_recovered_) {
      const Vec3 d{std::abs(r.x - middle.x) - half, std::abs(r.y - middle.y) - half, std::abs(r.z - middle.z) - half};
      const float nearest = kernel_value(plan_.frame.kernel, length(max_of(d, Vec3{})) * r.inverse_radius);
      most += r.weight * std::min(here, nearest);
    }
    return most;
  };
  float low = 0.0f, high = plan_.frame.support;
  for (int i = 0; i < 10; ++i) {
    const float u = 0.5f * (low + high);
    (most_beyond(u) < recovered_reach ? high : low) = u;
  }
  return high;
}

bool TileBuilder::fit_recovered(Vec3 middle, float half, SurfaceCell& record) const {
  const float extent = recovered_extent(middle, half), slack = recovered_slack(half);
  Box3 box;
  Vec3 mean;
  for (const RecoveredParticle& r : cell_recovered_) {
    const Vec3 p = Vec3{r.x, r.y, r.z} - middle;
    const float reach = extent / r.inverse_radius + slack;
    box.include(p - Vec3{reach, reach, reach});
    box.include(p + Vec3{reach, reach, reach});
    mean += p * (1.0f / static_cast<float>(cell_recovered_.size()));
  }
  float radius = 0.0f;
  for (const RecoveredParticle& r : cell_recovered_)
    radius = std::max(radius, length(Vec3{r.x, r.y, r.z} - middle - mean) + extent / r.inverse_radius + slack);
  Vec3 side;
  for (int a = 0; a < 3; ++a) {
    box.low[a] = std::max(box.low[a], recovered_box_.low[a] - slack);
    box.high[a] = std::min(box.high[a], recovered_box_.high[a] + slack);
    side[a] = 0.5f * (box.high[a] - box.low[a]);
    if (!(side[a] > 0.0f)) return false;
  }
  // The ball round all of them, or the ellipsoid round what of them can be in the cell: sum of ((y - c) / r)^2 = 1.
  Vec3 center = mean, axes{radius, radius, radius};
  if (side.x * side.y + side.y * side.z + side.z * side.x < radius * radius) {
    center = 0.5f * (box.low + box.high);
    axes = side * 1.7320509f;
  }
  float* c = record.quadratic;
  c[0] = 1.0f;
  for (int a = 0; a < 3; ++a) {
    const float scale = 1.0f / square(axes[a]);
    c[0] -= center[a] * center[a] * scale;
    c[1 + a] = 2.0f * center[a] * scale;
    c[4 + a] = -scale;
  }
  // Rounding: each of the sums is of terms of up to (1 + |c|/r)^2.
  const float rounding =
      4e-6f * (1.0f + (half * half + length_squared(center)) / square(std::min({axes.x, axes.y, axes.z})));
  record.slack = {rounding, 0.0f};
  return true;
}

std::size_t TileBuilder::regather(Vec3 center, float half, std::size_t in_tile) {
  return loops_.gather(plan_.frame, tile_.arrays(), in_tile, center, half, cell_.with_room(in_tile));
}

bool TileBuilder::is_main(const SurfaceCell& record) const { return record.list_bits != 0; }

bool TileBuilder::wants_split(const SurfaceCell& record, double size, std::size_t listed) {
  if (size > 1.01 * plan_.target) return true;
  if (plan_.equal_radii) return false;
  const auto unit = static_cast<float>(plan_.units_per_grid);
  const std::size_t entries = is_main(record) ? listed : 0;
  if (entries + cell_recovered_.size() <= longest_unsplit_list(influence_factor_)) return false;
  // Worth it if many are small against the cell: the others stay in every child's list. Cells end at 1.25 to 2.5 radii
  // of most of their particles; where radii are equal they have 2.
  std::size_t small = 0;
  const float limit = 0.4f * influence_factor_ * plan_.frame.support * static_cast<float>(size) * unit;
  for (std::size_t i = 0; i < entries; ++i) small += cell_.reach[i] < limit ? 1 : 0;
  for (const RecoveredParticle& r : cell_recovered_) {
    small += 1.0f / r.inverse_radius < static_cast<float>(size) ? 1 : 0;
  }
  return 2 * small > entries + cell_recovered_.size();
}

void TileBuilder::divide(SurfacePiece& piece, const Pending& split, std::size_t in_tile, std::vector<Pending>& splits) {
  const std::size_t first = piece.records.cells.size();
  piece.records.cells.resize(first + 8);
  piece.records.cells[split.record] = {};
  piece.records.cells[split.record].kind = SurfaceCellKind::split;
  piece.records.cells[split.record].list = static_cast<std::uint32_t>(first);
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
        ++piece.near_leaves;
        if (is_main(record)) write_own_list(piece, record, center, listed);
        write_recovered(piece, record, center);
      }
    }
    piece.records.cells[first + i] = record;
  }
}

void TileBuilder::order_brick(std::size_t in_brick) {
  order_.clear();
  eight_marks_.clear();
  std::uint32_t left[256] = {}, next[256];
  for (std::size_t i = 0; i < in_brick; ++i) ++left[marks_[i]];
  std::uint32_t begin = 0;
  std::vector<std::uint8_t>& marks = distinct_marks_;
  marks.clear();
  for (int mark = 0; mark < 256; ++mark) {
    next[mark] = begin;
    begin += left[mark];
    if (mark > 0 && left[mark] > 0) marks.push_back(static_cast<std::uint8_t>(mark));
  }
  by_mark_.resize(in_brick);
  for (std::size_t i = 0; i < in_brick; ++i) by_mark_[next[marks_[i]]++] = static_cast<std::uint32_t>(i);
  const auto take = [&](std::uint8_t mark, std::uint32_t count) {
    // Behind `next` are those that are left.
    for (std::uint32_t i = 0; i < count; ++i) order_.push_back(by_mark_[next[mark] - left[mark] + i]);
    left[mark] -= count;
  };
  for (const std::uint8_t mark : marks) {
    const std::uint32_t whole = left[mark] / 8;
    take(mark, 8 * whole);
    eight_marks_.insert(eight_marks_.end(), whole, mark);
  }
  // The rest: an eight begins with what most cells feel, and goes on with what adds fewest cells to it and, of that, wants
  // most of those it has.
  std::stable_sort(marks.begin(), marks.end(),
                   [](std::uint8_t a, std::uint8_t b) { return std::popcount(a) > std::popcount(b); });
  for (;;) {
    std::erase_if(marks, [&](std::uint8_t mark) { return left[mark] == 0; });
    if (marks.empty()) break;
    std::uint8_t together = marks.front();
    std::uint32_t room = 8 - left[together];
    take(together, left[together]);
    while (room > 0) {
      int least = 100;
      std::uint8_t best = 0;
      for (const std::uint8_t mark : marks) {
        if (left[mark] == 0) continue;
        const int cost = 9 * std::popcount(static_cast<unsigned>(mark & ~together)) +
                         std::popcount(static_cast<unsigned>(together & ~mark));
        if (cost < least) {
          least = cost;
          best = mark;
        }
      }
      if (best == 0) break;
      const std::uint32_t count = std::min(room, left[best]);
      take(best, count);
      room -= count;
      together = static_cast<std::uint8_t>(together | best);
    }
    order_.insert(order_.end(), room, no_entry);
    eight_marks_.push_back(together);
  }
}

void TileBuilder::write_brick_list(SurfacePiece& piece, int brick, std::size_t in_brick) {
  order_brick(in_brick);
  if (order_.empty()) return;
  const int log2 = part_log2(eight_marks_.size());
  const std::uint32_t list = write_list(piece, brick_, brick_middle(brick), log2);
  for (int i = 0; i < 8; ++i) {
    SurfaceCell& record = records_[brick_cell(brick, i)];
    if (record.kind != SurfaceCellKind::near || !is_main(record)) continue;
    record.list = list;
    record.place.code = static_cast<std::uint8_t>(i | log2 << 4);
    record.list_bits = 0;
    for (std::size_t eight = 0; eight < eight_marks_.size(); ++eight) {
      const std::uint32_t felt = eight_marks_[eight] >> i & 1u;
      record.list_bits |= felt << (eight >> log2);
    }
  }
}

void TileBuilder::write_own_list(SurfacePiece& piece, SurfaceCell& record, Vec3 center, std::size_t listed) {
  piece.list_entries += listed;
  order_.resize(listed);
  std::iota(order_.begin(), order_.end(), 0u);
  const int log2 = part_log2((listed + 7) / 8);
  record.list = write_list(piece, cell_, center, log2);
  record.place.code = static_cast<std::uint8_t>(ListPlace::own | log2 << 4);
  // Of all parts, to which order_ is filled up now.
  record.list_bits = 0xffffffffu >> (32 - (order_.size() / 8 >> log2));
}

std::uint32_t TileBuilder::write_list(SurfacePiece& piece, const ParticleScratch& from, Vec3 middle, int log2) {
  const std::size_t part = std::size_t{8} << log2;
  order_.resize((order_.size() + part - 1) / part * part, no_entry);
  if (order_.size() / 8 > most_eights) {
    throw Error("too many particles overlap one place: the neighbourhood order or the radii are too large");
  }
  const std::size_t list = piece.records.eights();
  if (plan_.equal_radii) {
    write_packed(piece, from, middle);
  } else {
    write_wide(piece, from, middle);
  }
  return static_cast<std::uint32_t>(list);
}

void TileBuilder::write_packed(SurfacePiece& piece, const ParticleScratch& from, Vec3 middle) const {
  std::vector<PackedEight>& lists = piece.records.packed;
  const std::size_t first = lists.size();
  lists.resize(first + order_.size() / 8);
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const std::uint32_t entry = order_[i];
    put_position(lists[first + i / 8], i % 8,
                 entry == no_entry ? packed_nowhere : pack_nearest(from.position(entry) - middle));
  }
}

void TileBuilder::write_wide(SurfacePiece& piece, const ParticleScratch& from, Vec3 middle) const {
  std::vector<WideEight>& lists = piece.records.wide;
  const std::size_t first = lists.size();
  lists.resize(first + order_.size() / 8);
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const std::uint32_t entry = order_[i];
    if (entry == no_entry) {
      put_position(lists[first + i / 8], i % 8, {far_away, far_away, far_away}, 1.0f);
    } else {
      put_position(lists[first + i / 8], i % 8, from.position(entry) - middle, plan_.frame.support / from.reach[entry]);
    }
  }
}

void TileBuilder::write_recovered(SurfacePiece& piece, SurfaceCell& record, Vec3 center) {
  if (cell_recovered_.empty()) return;
  const std::size_t eights = (cell_recovered_.size() + 7) / 8;
  if (eights > most_eights) throw Error("too many lone particles overlap one place: the radii are too large");
  record.recovered_eights = static_cast<std::uint16_t>(eights);
  record.recovered = static_cast<std::uint32_t>(piece.records.recovered_eights());
  record.recovered_box = parts_of(recovered_box_);
  if (plan_.equal_radii) {
    write_packed_recovered(piece, center, eights);
  } else {
    write_wide_recovered(piece, center, eights);
  }
}

void TileBuilder::write_packed_recovered(SurfacePiece& piece, Vec3 center, std::size_t eights) {
  const float unit = plan_.recovered_units_per_grid;
  const Vec3 middle = center / static_cast<float>(plan_.units_per_grid);
  std::vector<PackedRecoveredEight>& lists = piece.records.packed_recovered;
  const std::size_t first = lists.size();
  lists.resize(first + eights);
  for (std::size_t i = 0; i < eights * 8; ++i) {
    PackedPosition position = packed_nowhere;
    float weight = 0.0f;
    if (i < cell_recovered_.size()) {
      const RecoveredParticle& r = cell_recovered_[i];
      position = pack_nearest((Vec3{r.x, r.y, r.z} - middle) * unit);
      weight = r.weight * recover_threshold_;
    }
    put_position(lists[first + i / 8], i % 8, position);
    lists[first + i / 8].weight[i % 8] = weight;
  }
}

void TileBuilder::write_wide_recovered(SurfacePiece& piece, Vec3 center, std::size_t eights) {
  std::vector<WideRecoveredEight>& lists = piece.records.wide_recovered;
  const std::size_t first = lists.size();
  lists.resize(first + eights);
  for (std::size_t i = 0; i < eights * 8; ++i) {
    RecoveredParticle r{far_away, far_away, far_away, 1.0f, 0.0f};
    if (i < cell_recovered_.size()) {
      r = cell_recovered_[i];
      r = {r.x - center.x, r.y - center.y, r.z - center.z, r.inverse_radius, r.weight * recover_threshold_};
    }
    put_position(lists[first + i / 8], i % 8, {r.x, r.y, r.z}, r.inverse_radius);
    lists[first + i / 8].weight[i % 8] = r.weight;
  }
}

}  // namespace embrun
