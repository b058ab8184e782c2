#include "geometry/lattice_surface_build.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "geometry/box.h"

namespace embrun {
namespace {

constexpr int brick_side = 4;
/// Bricks of which all is outside, 4 bytes each.
constexpr double most_bricks = 2e8;

/// Particles by brick, in cells from the brick's low corner.
struct BrickParticles {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> sources, starts;
};

BrickParticles sort_by_brick(std::span<const Vec3> positions, const CellGrid& bricks, std::size_t brick_count,
                             double cell) {
  const Vec3d low = to_double(bricks.low);
  std::vector<std::uint32_t> brick(positions.size());
  std::vector<Vec3> local(positions.size());
  parallel_for(positions.size(), 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3d p = (1 / cell) * (to_double(positions[i]) - low);
      const auto part = [&](double v, int count) { return std::clamp(static_cast<int>(v / brick_side), 0, count - 1); };
      const int x = part(p.x, bricks.nx), y = part(p.y, bricks.ny), z = part(p.z, bricks.nz);
      brick[i] = static_cast<std::uint32_t>(bricks.index(x, y, z));
      local[i] = to_float(p - static_cast<double>(brick_side) *
                                  Vec3d{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
    }
  });
  BrickParticles sorted;
  sorted.starts.assign(brick_count + 1, 0);
  for (const std::uint32_t b : brick) ++sorted.starts[b + 1];
  for (std::size_t b = 0; b < brick_count; ++b) sorted.starts[b + 1] += sorted.starts[b];
  sorted.positions.resize(positions.size());
  sorted.sources.resize(positions.size());
  std::vector<std::uint32_t> next(sorted.starts.begin(), sorted.starts.end() - 1);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const std::uint32_t to = next[brick[i]]++;
    sorted.positions[to] = local[i];
    sorted.sources[to] = static_cast<std::uint32_t>(i);
  }
  return sorted;
}

/// Adds a particle, `p` in cells from the brick's corner, to the brick's 6^3 values.
void spread(const Vec3& p, float values[216]) {
  int first[3];
  float w[3][3];
  for (int a = 0; a < 3; ++a) {
    const float cell = std::floor(p[a]);
    first[a] = static_cast<int>(cell);
    spline_weights(p[a] - cell, w[a]);
    if (first[a] < -2 || first[a] > 5) return;
  }
  for (int k = 0; k < 3; ++k) {
    const int z = first[2] + k;
    if (z < 0 || z > 5) continue;
    for (int j = 0; j < 3; ++j) {
      const int y = first[1] + j;
      if (y < 0 || y > 5) continue;
      const float row = w[2][k] * w[1][j];
      for (int i = 0; i < 3; ++i) {
        const int x = first[0] + i;
        if (x >= 0 && x <= 5) values[(z * 6 + y) * 6 + x] += row * w[0][i];
      }
    }
  }
}

/// Adds all particles that reach a brick, its own and those of the bricks round it, to its values; false: there are none.
bool gather(const BrickParticles& sorted, const CellGrid& bricks, int x, int y, int z, float values[216]) {
  bool any = false;
  for (int k = std::max(z - 1, 0); k <= std::min(z + 1, bricks.nz - 1); ++k) {
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, bricks.ny - 1); ++j) {
      for (int i = std::max(x - 1, 0); i <= std::min(x + 1, bricks.nx - 1); ++i) {
        const auto other = static_cast<std::size_t>(bricks.index(i, j, k));
        const Vec3 offset = static_cast<float>(brick_side) *
                            Vec3{static_cast<float>(i - x), static_cast<float>(j - y), static_cast<float>(k - z)};
        for (std::uint32_t p = sorted.starts[other]; p < sorted.starts[other + 1]; ++p) {
          spread(sorted.positions[p] + offset, values);
          any = true;
        }
      }
    }
  }
  return any;
}

/// Sets the bits of the cells by the least and greatest of their values.
void set_bits(LatticeBrick& brick) {
  for (int z = 0; z < brick_side; ++z) {
    for (int y = 0; y < brick_side; ++y) {
      for (int x = 0; x < brick_side; ++x) {
        float least = infinity, greatest = -infinity;
        for (int k = 0; k < 3; ++k) {
          for (int j = 0; j < 3; ++j) {
            for (int i = 0; i < 3; ++i) {
              const float v = brick.values[((z + k) * 6 + y + j) * 6 + x + i];
              least = std::min(least, v);
              greatest = std::max(greatest, v);
            }
          }
        }
        const std::uint64_t bit = std::uint64_t{1} << (x + 4 * y + 16 * z);
        if (least > 0) {
          brick.inside |= bit;
        } else if (greatest > 0) {
          brick.near |= bit;
        }
      }
    }
  }
}

}  // namespace

std::optional<LatticeSurface> build_lattice_surface(std::span<const Vec3> positions, double spacing, double cell,
                                                    double share, std::vector<float>& field) {
  Box3 bounds;
  for (const Vec3& p : positions) bounds.include(p);
  LatticeSurface surface;
  surface.cell = static_cast<float>(cell);
  const double side = brick_side * static_cast<double>(surface.cell);
  // A brick on each side that nothing reaches.
  int counts[3];
  Vec3 low;
  double total = 1;
  for (int a = 0; a < 3; ++a) {
    const double extent = static_cast<double>(bounds.high[a]) - static_cast<double>(bounds.low[a]);
    const double count = std::ceil(extent / side) + 3;
    total *= count;
    if (!(total <= most_bricks)) return std::nullopt;
    counts[a] = static_cast<int>(count);
    low[a] = static_cast<float>(static_cast<double>(bounds.low[a]) - 0.5 * (count * side - extent));
  }
  const CellGrid bricks = grid_of_cubes(low, static_cast<float>(side), counts[0], counts[1], counts[2]);
  surface.bricks = bricks;
  const auto brick_count = static_cast<std::size_t>(total);
  const BrickParticles sorted = sort_by_brick(positions, bricks, brick_count, static_cast<double>(surface.cell));

  // Of g = D/T - 1: what one particle adds.
  const auto weight = static_cast<float>(std::pow(spacing / static_cast<double>(surface.cell), 3) / share);
  surface.states.assign(brick_count, LatticeSurfaceView::outside);
  field.assign(positions.size(), 0.0f);
  const auto row = static_cast<std::size_t>(bricks.nx), slab = row * static_cast<std::size_t>(bricks.ny);
  constexpr std::size_t grain = 64;
  std::vector<std::vector<LatticeBrick>> pieces((brick_count + grain - 1) / grain);
  parallel_for(pieces.size(), 1, [&](std::size_t first_piece, std::size_t last_piece) {
    for (std::size_t piece = first_piece; piece < last_piece; ++piece) {
      for (std::size_t b = piece * grain; b < std::min(brick_count, (piece + 1) * grain); ++b) {
        const int x = static_cast<int>(b % row), y = static_cast<int>(b % slab / row), z = static_cast<int>(b / slab);
        LatticeBrick brick;
        std::fill(std::begin(brick.values), std::end(brick.values), 0.0f);
        if (!gather(sorted, bricks, x, y, z, brick.values)) continue;
        for (float& v : brick.values) v = weight * v - 1.0f;
        set_bits(brick);
        for (std::uint32_t p = sorted.starts[b]; p < sorted.starts[b + 1]; ++p)
          field[sorted.sources[p]] = LatticeField(brick, sorted.positions[p]).value(sorted.positions[p]) + 1.0f;
        if (brick.near != 0) {
          surface.states[b] = static_cast<std::int32_t>(pieces[piece].size());
          pieces[piece].push_back(brick);
        } else if (brick.inside != 0) {
          surface.states[b] = LatticeSurfaceView::inside;
        }
      }
    }
  });
  for (std::size_t piece = 0; piece < pieces.size(); ++piece) {
    const auto first = static_cast<std::int32_t>(surface.near.size());
    for (std::size_t b = piece * grain; b < std::min(brick_count, (piece + 1) * grain); ++b)
      if (surface.states[b] >= 0) surface.states[b] += first;
    surface.near.insert(surface.near.end(), pieces[piece].begin(), pieces[piece].end());
    pieces[piece] = {};
  }
  return surface;
}

}  // namespace embrun
