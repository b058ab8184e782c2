#include "geometry/cell_words.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace embrun {
namespace {

struct Grid {
  int tiles[3];
  std::vector<SurfaceTile> of;

  int edge(int axis) const { return 4 * tiles[axis]; }
  /// Beyond the grid nothing is near.
  bool is_near(int x, int y, int z) const {
    if (x < 0 || y < 0 || z < 0 || x >= edge(0) || y >= edge(1) || z >= edge(2)) return false;
    const SurfaceTile& tile = of[static_cast<std::size_t>(((z / 4) * tiles[1] + y / 4) * tiles[0] + x / 4)];
    return (tile.near_mask >> ((z % 4) * 16 + (y % 4) * 4 + x % 4) & 1u) != 0;
  }
  /// Edge of the largest cube at a cell, towards an octant, that holds no near cell; 24 at most.
  int free_edge(int x, int y, int z, int octant) const {
    const int sx = (octant & 1) != 0 ? 1 : -1, sy = (octant & 2) != 0 ? 1 : -1, sz = (octant & 4) != 0 ? 1 : -1;
    for (int size = 0; size < 24; ++size) {
      for (int i = 0; i <= size; ++i) {
        for (int j = 0; j <= size; ++j) {
          // The layers that the next larger cube has more.
          if (is_near(x + sx * size, y + sy * i, z + sz * j) || is_near(x + sx * i, y + sy * size, z + sz * j) ||
              is_near(x + sx * i, y + sy * j, z + sz * size)) {
            return size;
          }
        }
      }
    }
    return 24;
  }
};

TEST(CellWords, NameTheLargestCubesThatMayBeSkipped) {
  std::mt19937 random(6);
  constexpr int named[] = {1, 2, 3, 4, 6, 8, 12, 24};
  // The last of these is wider than any skip.
  for (const Grid& shape : {Grid{{1, 1, 1}, {}}, Grid{{3, 2, 4}, {}}, Grid{{9, 2, 8}, {}}}) {
    for (const unsigned one_in : {3u, 60u, 2000u}) {
      Grid grid = shape;
      grid.of.resize(static_cast<std::size_t>(grid.tiles[0] * grid.tiles[1] * grid.tiles[2]));
      std::uint32_t records = 0;
      for (SurfaceTile& tile : grid.of) {
        tile.first_cell = records;
        for (int c = 0; c < 64; ++c) {
          if (random() % one_in == 0) {
            tile.near_mask |= std::uint64_t{1} << c;
            ++records;
          } else if (random() % 2 == 0) {
            tile.inside_mask |= std::uint64_t{1} << c;
          }
        }
      }
      const std::vector<std::uint32_t> words = make_cell_words(grid.of, grid.tiles);
      ASSERT_EQ(words.size(), 64 * grid.of.size());
      std::uint32_t record = 0;
      for (std::size_t i = 0; i < words.size(); ++i) {
        const int tile = static_cast<int>(i / 64), in = static_cast<int>(i % 64);
        const int x = 4 * (tile % grid.tiles[0]) + in % 4, y = 4 * (tile / grid.tiles[0] % grid.tiles[1]) + in / 4 % 4,
                  z = 4 * (tile / (grid.tiles[0] * grid.tiles[1])) + in / 16;
        if (grid.is_near(x, y, z)) {
          ASSERT_EQ(words[i], cell_word::near | record++);
          continue;
        }
        ASSERT_EQ(words[i] & cell_word::near, 0u);
        ASSERT_EQ((words[i] & cell_word::inside) != 0, (grid.of[i / 64].inside_mask >> in & 1u) != 0);
        for (int octant = 0; octant < 8; ++octant) {
          const int free = grid.free_edge(x, y, z, octant);
          int expected = 0;
          for (const int edge : named) expected = edge <= free ? edge : expected;
          ASSERT_EQ(cell_word::skip(words[i], octant), expected) << x << ' ' << y << ' ' << z << ' ' << octant;
        }
      }
    }
  }
}

}  // namespace
}  // namespace embrun
