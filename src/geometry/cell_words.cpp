#include "geometry/cell_words.h"

#include <algorithm>
#include <cstddef>
#include <cstring>

#include "base/parallel.h"

namespace embrun {

namespace {

/// The largest edge that a word can name.
constexpr std::uint8_t longest = 24;

/// The code of the largest nameable edge that is not over `edge`, which must be 1 or more.
std::uint32_t code_of(std::uint8_t edge) {
  std::uint32_t code = 7;
  while (((cell_word::edges >> (8 * code)) & 0xffu) > edge) --code;
  return code;
}

struct Rows {
  std::size_t nx, ny, nz;
  const std::uint8_t* near;  ///< 1 for a near cell, x fastest
};

/// Edges of a row and beyond its ends, where nothing is near as far as a word can name.
class EdgeRow {
 public:
  explicit EdgeRow(std::size_t nx) : edges_(nx + 2 * border, longest) {}
  std::uint8_t* data() { return edges_.data() + border; }
  const std::uint8_t* data() const { return edges_.data() + border; }

 private:
  static constexpr std::size_t border = 32;
  std::vector<std::uint8_t> edges_;
};

/// Each no more than one larger than the next one along x, towards rising x where `up`: in steps of 1, 2, 4, 8 and 16, which
/// any distance that counts is a sum of. `scratch` is another row.
void hold_back(EdgeRow& row, EdgeRow& scratch, std::ptrdiff_t nx, bool up) {
  for (std::ptrdiff_t step = 1; step <= 16; step *= 2) {
    const std::uint8_t* from = row.data();
    const std::uint8_t* next = from + (up ? step : -step);
    std::uint8_t* to = scratch.data();
    for (std::ptrdiff_t x = 0; x < nx; ++x)
      to[x] = std::min(from[x], static_cast<std::uint8_t>(next[x] + static_cast<std::uint8_t>(step)));
    std::swap(row, scratch);
  }
}

/// One octant: the cube at a cell is one larger than the smallest of those at its seven forward neighbours
/// (dynamic programming over the cells, from the far corner back).
void sweep(const Rows& rows, int octant, std::uint8_t* out) {
  const auto nx = static_cast<std::ptrdiff_t>(rows.nx);
  const auto ny = static_cast<std::ptrdiff_t>(rows.ny);
  const auto nz = static_cast<std::ptrdiff_t>(rows.nz);
  const bool up = (octant & 1) != 0;
  const std::ptrdiff_t sx = up ? 1 : -1, sy = (octant & 2) != 0 ? 1 : -1, sz = (octant & 4) != 0 ? 1 : -1;
  const std::size_t row_tiles = rows.nx / 4, slab_tiles = row_tiles * (rows.ny / 4);
  // Two slabs of rows, with one more on either side.
  std::vector<EdgeRow> here(rows.ny + 2, EdgeRow(rows.nx)), ahead(here);
  EdgeRow scratch(rows.nx);
  for (std::ptrdiff_t zi = 0; zi < nz; ++zi) {
    const std::ptrdiff_t z = sz > 0 ? nz - 1 - zi : zi;
    for (std::ptrdiff_t yi = 0; yi < ny; ++yi) {
      const std::ptrdiff_t y = sy > 0 ? ny - 1 - yi : yi;
      const auto row_at = [](std::vector<EdgeRow>& slab, std::ptrdiff_t r) -> EdgeRow& {
        return slab[static_cast<std::size_t>(r + 1)];
      };
      const std::uint8_t* a = row_at(here, y + sy).data();
      const std::uint8_t* b = row_at(ahead, y).data();
      const std::uint8_t* c = row_at(ahead, y + sy).data();
      EdgeRow& row = row_at(here, y);
      std::uint8_t* edges = row.data();
      const std::uint8_t* near = rows.near + static_cast<std::size_t>((z * ny + y) * nx);
      for (std::ptrdiff_t x = 0; x < nx; ++x) {
        const std::uint8_t level = std::min(a[x], std::min(b[x], c[x]));
        const std::uint8_t forward = std::min(a[x + sx], std::min(b[x + sx], c[x + sx]));
        const auto edge = std::min(longest, static_cast<std::uint8_t>(std::min(level, forward) + std::uint8_t{1}));
        edges[x] = near[x] != 0 ? std::uint8_t{0} : edge;
      }
      hold_back(row, scratch, nx, up);
      edges = row.data();
      std::uint8_t* tile_row =
          out + (static_cast<std::size_t>(z / 4) * slab_tiles + static_cast<std::size_t>(y / 4) * row_tiles) * 64 +
          static_cast<std::size_t>((z & 3) * 16 + (y & 3) * 4);
      for (std::size_t t = 0; t < row_tiles; ++t) std::memcpy(tile_row + t * 64, edges + 4 * t, 4);
    }
    ahead.swap(here);
  }
}

}  // namespace

std::vector<std::uint32_t> make_cell_words(std::span<const SurfaceTile> tiles, const int tile_counts[3]) {
  const auto tx = static_cast<std::size_t>(tile_counts[0]), ty = static_cast<std::size_t>(tile_counts[1]);
  const std::size_t nx = 4 * tx, ny = 4 * ty, nz = 4 * static_cast<std::size_t>(tile_counts[2]);
  std::vector<std::uint8_t> near(nx * ny * nz);
  parallel_for(tiles.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const std::size_t x0 = t % tx * 4, y0 = t / tx % ty * 4, z0 = t / (tx * ty) * 4;
      for (std::size_t c = 0; c < 64; ++c) {
        near[((z0 + c / 16) * ny + y0 + c / 4 % 4) * nx + x0 + c % 4] = (tiles[t].near_mask >> c) & 1u;
      }
    }
  });
  std::vector<std::uint8_t> edges(8 * near.size());
  const Rows rows{nx, ny, nz, near.data()};
  parallel_for(8, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t octant = begin; octant < end; ++octant) {
      sweep(rows, static_cast<int>(octant), edges.data() + octant * near.size());
    }
  });
  std::uint32_t codes[longest + 1] = {};
  for (std::uint8_t edge = 1; edge <= longest; ++edge) codes[edge] = code_of(edge);
  std::vector<std::uint32_t> words(near.size());
  parallel_for(tiles.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const SurfaceTile& tile = tiles[t];
      std::uint32_t record = tile.first_cell;
      for (std::size_t c = 0; c < 64; ++c) {
        std::uint32_t& word = words[t * 64 + c];
        if ((tile.near_mask >> c) & 1u) {
          word = cell_word::near | record++;
          continue;
        }
        word = (tile.inside_mask >> c) & 1u ? cell_word::inside : 0u;
        for (std::size_t octant = 0; octant < 8; ++octant) {
          word |= codes[edges[octant * near.size() + t * 64 + c]] << (3 * octant);
        }
      }
    }
  });
  return words;
}

}  // namespace embrun
