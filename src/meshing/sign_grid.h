#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "meshing/surface_field.h"

namespace embrun {

/// The signs of a surface's field on a sparse grid of samples: tiles of 4 x 4 x 4 bricks of 4 x 4 x 4 samples, where
/// particles are felt. A brick's signs are one word, bit (4 k + j) 4 + i for sample (i, j, k): set in the body. A brick
/// proven to lie on one side is not sampled, so the work goes with the area of the surface. Tiles that are not there
/// are outside. Bricks of a tile are numbered in Morton order, their samples x fastest.
class SignGrid {
 public:
  static constexpr int brick_side = lattice_side;
  static constexpr int tile_bricks = 4;  ///< along each axis
  static constexpr int tile_side = brick_side * tile_bricks;
  static constexpr std::uint32_t no_tile = 0xffffffffu;
  /// A tile's words with the first layer of the next tiles' (see words_of).
  static constexpr int padded = tile_bricks + 1;
  static constexpr int brick_at(int x, int y, int z) {
    return (x & 1) | (y & 1) << 1 | (z & 1) << 2 | (x >> 1) << 3 | (y >> 1) << 4 | (z >> 1) << 5;
  }
  /// Where a brick is in its tile.
  static constexpr std::array<int, 3> place_in_tile(int brick) {
    return {(brick & 1) | (brick >> 3 & 1) << 1, (brick >> 1 & 1) | (brick >> 4 & 1) << 1,
            (brick >> 2 & 1) | (brick >> 5 & 1) << 1};
  }
  using PaddedWords = std::array<std::uint64_t, padded * padded * padded>;
  /// Of a tile's neighbours: bit a of the index is a step along axis a; [0] is the tile itself.
  using Neighbours = std::array<std::uint32_t, 8>;

  /// Samples the field in cells of side `cell`, on the threads of the enclosing arena; `progress` is told how much is
  /// done, up to `share`. Throws Error when the cells are too fine for the particles' extent.
  SignGrid(const SurfaceField& field, float cell, const std::function<void(double)>& progress, double share);

  float cell() const { return cell_; }
  std::size_t tile_count() const { return keys_.size(); }
  std::uint64_t sample_count() const;
  /// The place of sample (i, j, k) of a tile, each 0 to tile_side.
  Vec3 position(std::size_t tile, int i, int j, int k) const;
  Neighbours neighbours(std::size_t tile) const;
  /// The words of a tile's bricks and of those next to them on the high sides, x fastest. False: all are the same.
  bool words_of(const Neighbours& tiles, PaddedWords& words) const;
  std::uint64_t word(std::size_t tile, int brick) const;
  /// g at sample `bit` of a brick, or NaN where that is only known to have the sign of its word.
  float value(std::size_t tile, int brick, int bit) const;

 private:
  struct Tile {
    std::uint64_t inside = 0;  ///< bricks that are in the body as a whole
    std::uint64_t mixed = 0;   ///< bricks with samples of both signs
    std::uint32_t first = 0;   ///< of those, in the group's arrays
  };
  /// Tiles are sampled a group at a time, each into arrays of its own.
  struct Group {
    std::vector<std::uint64_t> words;
    std::vector<float> values;
    std::uint64_t samples = 0;
  };
  static constexpr std::size_t group_tiles = 16;
  struct Scratch {
    SurfaceField::Near tile, part, brick;
    alignas(64) float values[lattice_size];
  };

  void lay_out(const SurfaceField& field);
  void sample_tile(const SurfaceField& field, std::size_t index, Scratch& scratch);
  void sample_brick(const SurfaceField& field, const SurfaceField::Near& near, std::size_t index, int brick,
                    Scratch& scratch);

  float cell_;
  Vec3 origin_;
  std::vector<std::uint64_t> keys_;  ///< places of the tiles, rising
  std::vector<Tile> tiles_;
  std::vector<Group> groups_;
};

}  // namespace embrun
