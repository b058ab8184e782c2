#include "meshing/sign_grid.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "base/parallel.h"
#include "meshing/felt_tiles.h"
#include "meshing/meter.h"

namespace embrun {

namespace {

constexpr std::uint64_t all_inside = ~std::uint64_t{0};

}  // namespace

SignGrid::SignGrid(const SurfaceField& field, float cell, const std::function<void(double)>& progress, double share)
    : cell_(cell) {
  lay_out(field);
  Meter meter(progress, 0, share, keys_.size());
  tiles_.resize(keys_.size());
  groups_.resize((keys_.size() + group_tiles - 1) / group_tiles);
  parallel_for(groups_.size(), 1, [&](std::size_t begin, std::size_t end) {
    Scratch scratch;
    for (std::size_t group = begin; group < end; ++group) {
      const std::size_t first = group * group_tiles, last = std::min(first + group_tiles, keys_.size());
      for (std::size_t tile = first; tile < last; ++tile) sample_tile(field, tile, scratch);
      groups_[group].words.shrink_to_fit();
      groups_[group].values.shrink_to_fit();
      meter.add(last - first);
    }
  });
}

/// Finds the tiles in which anything is felt, or in the samples next to them on the high sides, to which their cells reach.
void SignGrid::lay_out(const SurfaceField& field) {
  origin_ = felt_box(field.reach()).low - Vec3{cell_, cell_, cell_} * 2.5f;
  keys_ = felt_tiles(field.reach(), origin_, cell_ * tile_side, 0.01f * cell_, 1.01f * cell_, cell_);
}

Vec3 SignGrid::position(std::size_t tile, int i, int j, int k) const {
  const std::array<int, 3> place = tile_place(keys_[tile]);
  return origin_ + cell_ * Vec3{static_cast<float>(place[0] * tile_side + i),
                                static_cast<float>(place[1] * tile_side + j),
                                static_cast<float>(place[2] * tile_side + k)};
}

/// In two steps, eighths of the tile and then their bricks, each with the particles that are felt there.
void SignGrid::sample_tile(const SurfaceField& field, std::size_t index, Scratch& scratch) {
  Tile& tile = tiles_[index];
  tile.first = static_cast<std::uint32_t>(groups_[index / group_tiles].words.size());
  constexpr int last = tile_side - 1, part_side = tile_side / 2;
  const Vec3 low = position(index, 0, 0, 0), high = position(index, last, last, last);
  field.find(low, high, scratch.tile);
  field.drop_weak(low, high, scratch.tile);
  if (scratch.tile.empty()) return;
  for (int part = 0; part < 8; ++part) {
    const int i = (part & 1) * part_side, j = (part >> 1 & 1) * part_side, k = (part >> 2) * part_side;
    const Vec3 part_low = position(index, i, j, k),
               part_high = position(index, i + part_side - 1, j + part_side - 1, k + part_side - 1);
    field.find(scratch.tile, part_low, part_high, scratch.part);
    field.drop_weak(part_low, part_high, scratch.part);
    if (scratch.part.empty()) continue;
    for (int child = 0; child < 8; ++child) sample_brick(field, scratch.part, index, 8 * part + child, scratch);
  }
}

void SignGrid::sample_brick(const SurfaceField& field, const SurfaceField::Near& near, std::size_t index, int brick,
                            Scratch& scratch) {
  constexpr int last = brick_side - 1;
  const auto [x, y, z] = place_in_tile(brick);
  const int i = x * brick_side, j = y * brick_side, k = z * brick_side;
  const Vec3 low = position(index, i, j, k), high = position(index, i + last, j + last, k + last);
  Tile& tile = tiles_[index];
  const std::uint64_t bit = std::uint64_t{1} << brick;
  SurfaceField::Region region = field.classify(low, high, near);
  if (region == SurfaceField::Region::open) {
    groups_[index / group_tiles].samples += lattice_size;
    region = field.sample(near, low, cell_, scratch.brick, scratch.values);
  }
  if (region == SurfaceField::Region::inside) tile.inside |= bit;
  if (region != SurfaceField::Region::open) return;
  std::uint64_t word = 0;
  for (int s = 0; s < lattice_size; ++s) word |= static_cast<std::uint64_t>(scratch.values[s] > 0.0f) << s;
  Group& group = groups_[index / group_tiles];
  if (word == all_inside) tile.inside |= bit;
  if (word == 0 || word == all_inside) return;
  tile.mixed |= bit;
  group.words.push_back(word);
  group.values.insert(group.values.end(), scratch.values, scratch.values + lattice_size);
}

std::uint64_t SignGrid::sample_count() const {
  std::uint64_t count = 0;
  for (const Group& group : groups_) count += group.samples;
  return count;
}

SignGrid::Neighbours SignGrid::neighbours(std::size_t tile) const {
  const std::array<int, 3> place = tile_place(keys_[tile]);
  Neighbours result;
  for (int n = 0; n < 8; ++n) {
    const std::uint64_t key = tile_key(place[0] + (n & 1), place[1] + (n >> 1 & 1), place[2] + (n >> 2));
    // Neighbours along x are mostly the next ones.
    std::size_t found = tile + (n & 1);
    if (n > 1) found = static_cast<std::size_t>(std::lower_bound(keys_.begin(), keys_.end(), key) - keys_.begin());
    result[static_cast<std::size_t>(n)] =
        found < keys_.size() && keys_[found] == key ? static_cast<std::uint32_t>(found) : no_tile;
  }
  return result;
}

std::uint64_t SignGrid::word(std::size_t index, int brick) const {
  const Tile& tile = tiles_[index];
  const std::uint64_t bit = std::uint64_t{1} << brick;
  if ((tile.mixed & bit) != 0) {
    const std::size_t rank = tile.first + static_cast<std::size_t>(std::popcount(tile.mixed & (bit - 1)));
    return groups_[index / group_tiles].words[rank];
  }
  return (tile.inside & bit) != 0 ? all_inside : 0;
}

bool SignGrid::words_of(const Neighbours& tiles, PaddedWords& words) const {
  // Mostly a tile and those next to it are all outside or all inside.
  std::uint64_t some = 0, all = all_inside, mixed = 0;
  for (const std::uint32_t tile : tiles) {
    const std::uint64_t inside = tile == no_tile ? 0 : tiles_[tile].inside;
    mixed |= tile == no_tile ? 0 : tiles_[tile].mixed;
    some |= inside;
    all &= inside;
  }
  if (mixed == 0 && (some == 0 || all == all_inside)) return false;
  std::uint64_t any = 0, every = all_inside;
  std::size_t at = 0;
  for (int z = 0; z < padded; ++z) {
    for (int y = 0; y < padded; ++y) {
      for (int x = 0; x < padded; ++x, ++at) {
        const int n = x / tile_bricks + 2 * (y / tile_bricks) + 4 * (z / tile_bricks);
        const std::uint32_t tile = tiles[static_cast<std::size_t>(n)];
        words[at] = tile == no_tile ? 0 : word(tile, brick_at(x % tile_bricks, y % tile_bricks, z % tile_bricks));
        any |= words[at];
        every &= words[at];
      }
    }
  }
  return any != 0 && every != all_inside;
}

float SignGrid::value(std::size_t index, int brick, int bit) const {
  const Tile& tile = tiles_[index];
  const std::uint64_t mask = std::uint64_t{1} << brick;
  if ((tile.mixed & mask) == 0) return std::numeric_limits<float>::quiet_NaN();
  const std::size_t rank = tile.first + static_cast<std::size_t>(std::popcount(tile.mixed & (mask - 1)));
  return groups_[index / group_tiles].values[rank * lattice_size + static_cast<std::size_t>(bit)];
}

}  // namespace embrun
