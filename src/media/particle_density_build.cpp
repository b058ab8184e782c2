#include "media/particle_density_build.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "math/median.h"

namespace embrun {

/// A particle on its way into the lists.
struct DensityBall {
  Vec3 center;
  float reach = 0;   ///< radius of the ball, or the kernel's support
  float factor = 0;  ///< as in DensityBlock
  std::uint32_t colours = 0;
  std::uint8_t fluid = 0;
};

/// What the bricks are built from.
struct DensitySource {
  std::vector<DensityBall> balls;
  const std::vector<DensityFluid>& fluids;
  MediaOverlap overlap;
  float slack = 0;  ///< metres
};

namespace {

using Ball = DensityBall;
using Source = DensitySource;

/// Rounding of coordinates must not put a point that a ray computes into a cell that does not list its balls.
constexpr float coordinate_slack = 2e-6f;

constexpr std::size_t most_bricks = 1u << 20;
constexpr int most_cells_a_side = 64;

/// The kernel's reach in radii: the solvers' h = 4 r.
constexpr float smooth_reach = 4;

/// Squared distance from a point to a box.
float distance_squared(const Box3& box, Vec3 p) {
  float sum = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float d = std::max({box.low[axis] - p[axis], 0.0f, p[axis] - box.high[axis]});
    sum += d * d;
  }
  return sum;
}

Box3 cell_box(const CellGrid& grid, int x, int y, int z, float slack) {
  const auto corner = [&](int i, int j, int k) {
    return grid.low + Vec3{static_cast<float>(i) * grid.cell.x, static_cast<float>(j) * grid.cell.y,
                           static_cast<float>(k) * grid.cell.z};
  };
  const Vec3 margin{slack, slack, slack};
  return {corner(x, y, z) - margin, corner(x + 1, y + 1, z + 1) + margin};
}

CellGrid grid_over(const Box3& box, int nx, int ny, int nz) {
  CellGrid grid;
  grid.low = box.low;
  grid.nx = nx;
  grid.ny = ny;
  grid.nz = nz;
  const Vec3 size = box.high - box.low;
  grid.cell = {size.x / static_cast<float>(nx), size.y / static_cast<float>(ny), size.z / static_cast<float>(nz)};
  grid.cells_per_metre = {1 / grid.cell.x, 1 / grid.cell.y, 1 / grid.cell.z};
  return grid;
}

/// Calls visit(index) for the cells of a grid that a ball reaches into.
template <class Visit>
void for_cells_of(const CellGrid& grid, const Ball& ball, float slack, const Visit& visit) {
  const float reach = ball.reach + slack;
  const auto range = [&](int axis, int n, int& first, int& last) {
    const float inverse = grid.cells_per_metre[axis];
    const auto index = [&](float c) {
      return static_cast<int>(std::clamp(std::floor((c - grid.low[axis]) * inverse), -1.0f, static_cast<float>(n)));
    };
    first = std::max(index(ball.center[axis] - reach) - 1, 0);
    last = std::min(index(ball.center[axis] + reach) + 1, n - 1);
  };
  int x0, x1, y0, y1, z0, z1;
  range(0, grid.nx, x0, x1);
  range(1, grid.ny, y0, y1);
  range(2, grid.nz, z0, z1);
  for (int z = z0; z <= z1; ++z)
    for (int y = y0; y <= y1; ++y)
      for (int x = x0; x <= x1; ++x)
        if (distance_squared(cell_box(grid, x, y, z, slack), ball.center) <= ball.reach * ball.reach)
          visit(static_cast<std::size_t>(grid.index(x, y, z)));
}

/// Shape of the cubic spline at the distance d from its centre: an upper bound, for it falls monotonically.
float spline(float d, float reach) {
  const float u = d / reach;
  const float outer = std::max(1 - u, 0.0f), inner = std::max(0.5f - u, 0.0f);
  return 2 * outer * outer * outer - 8 * inner * inner * inner;
}

/// Greatest sum of a smooth fluid's kernels in a box, by the nearest point of the box for each: split into parts, since all
/// kernels are not at their greatest at one place.
float smooth_bound(const std::vector<Ball>& balls, const std::vector<std::uint32_t>& list, int fluid, const Box3& box) {
  constexpr int parts = 4;
  const CellGrid grid = grid_over(box, parts, parts, parts);
  float greatest = 0;
  for (int z = 0; z < parts; ++z)
    for (int y = 0; y < parts; ++y)
      for (int x = 0; x < parts; ++x) {
        const Box3 part = cell_box(grid, x, y, z, 1e-3f * grid.cell.x);
        float sum = 0;
        for (const std::uint32_t i : list) {
          if (balls[i].fluid != fluid) continue;
          const float d = std::sqrt(distance_squared(part, balls[i].center));
          if (d < balls[i].reach) sum += balls[i].factor * spline(d, balls[i].reach);
        }
        greatest = std::max(greatest, sum);
      }
  // Sums in another order round otherwise, and the ray's kernel has an approximate root.
  return greatest * 1.0001f;
}

/// What a place in a block holds that is not used: no point of a scene is in it.
constexpr Ball nowhere{{1e15f, 1e15f, 1e15f}, 1e-10f, 0, 0, 0};

/// One brick's part of the arrays, before they are put together.
struct BuiltBrick {
  DensityBrick brick;
  Rgb majorant;
  std::vector<DensityCell> cells;
  std::vector<DensityBlock> blocks;
  std::vector<std::uint8_t> block_fluid;
  std::vector<float> block_reach;
  std::vector<std::uint32_t> block_colours;
};

void append_block(const Source& source, const std::uint32_t* members, std::size_t count, BuiltBrick& built) {
  const int number = source.balls[members[0]].fluid;
  DensityBlock block;
  for (std::size_t lane = 0; lane < 16; ++lane) {
    const Ball ball = lane < count ? source.balls[members[lane]] : nowhere;
    block.x[lane] = ball.center.x;
    block.y[lane] = ball.center.y;
    block.z[lane] = ball.center.z;
    block.factor[lane] = ball.factor;
    built.block_reach.push_back(ball.reach * ball.reach);
    built.block_colours.push_back(ball.colours);
  }
  built.blocks.push_back(block);
  built.block_fluid.push_back(static_cast<std::uint8_t>(number));
}

/// Bound on the extinction in a cell: of a fluid of balls the mean is at most the largest; fluids by the overlap rule.
Rgb cell_bound(const Source& source, const std::vector<std::uint32_t>& list, const Box3& box) {
  Rgb bound;
  for (std::size_t begin = 0; begin < list.size();) {
    const int number = source.balls[list[begin]].fluid;
    const DensityFluid& fluid = source.fluids[static_cast<std::size_t>(number)];
    float factor = 0;
    std::size_t end = begin;
    for (; end < list.size() && source.balls[list[end]].fluid == number; ++end)
      factor = std::max(factor, source.balls[list[end]].factor);
    if (fluid.smooth) factor = smooth_bound(source.balls, list, number, box);
    const Rgb own = fluid.extinction * factor;
    // Whichever fluid counts, and whichever are masked out: the largest of each channel.
    bound = source.overlap == MediaOverlap::sum
                ? bound + own
                : Rgb{std::max(bound.r, own.r), std::max(bound.g, own.g), std::max(bound.b, own.b)};
    begin = end;
  }
  return bound;
}

/// The side of cells that suits a particle: a block's worth of balls reach into a cell of 2.7 radii. A smooth fluid's
/// bounds want cells that are small beside its kernel.
float cell_size(const Source& source, const Ball& ball) {
  return (source.fluids[ball.fluid].smooth ? 0.75f : 2.7f) * ball.reach;
}

/// Divides a brick among cells about as large as its balls, as far as its lists do not grow out of proportion.
std::vector<std::vector<std::uint32_t>> divide(const Source& source, const std::vector<std::uint32_t>& members,
                                               const Box3& box, CellGrid& grid) {
  std::vector<float> sizes;
  for (const std::uint32_t i : members) sizes.push_back(cell_size(source, source.balls[i]));
  float target = 1.004f * median_of(sizes);
  const float most = std::cbrt(16.0f * static_cast<float>(members.size())) + 2;
  for (;; target *= 2) {
    const auto count = [&](float size) {
      return static_cast<int>(
          std::clamp(std::ceil(size / target), 1.0f, std::min(most, static_cast<float>(most_cells_a_side))));
    };
    const Vec3 size = box.high - box.low;
    grid = grid_over(box, count(size.x), count(size.y), count(size.z));
    std::vector<std::vector<std::uint32_t>> lists(static_cast<std::size_t>(grid.nx * grid.ny * grid.nz));
    std::size_t entries = 0;
    const std::size_t limit = 64 * members.size() + 4096;
    for (const std::uint32_t i : members) {
      for_cells_of(grid, source.balls[i], source.slack, [&](std::size_t cell) {
        lists[cell].push_back(i);
        ++entries;
      });
      if (entries > limit) break;
    }
    if (entries <= limit || lists.size() == 1) return lists;
  }
}

/// `members`: the balls that reach into `brick_box`, ordered by fluid.
BuiltBrick build_brick(const Source& source, const std::vector<std::uint32_t>& members, const Box3& brick_box) {
  Box3 box;
  for (const std::uint32_t i : members) {
    const Ball& ball = source.balls[i];
    const float reach = ball.reach + source.slack;
    box.include(max_of(ball.center - Vec3{reach, reach, reach}, brick_box.low));
    box.include(min_of(ball.center + Vec3{reach, reach, reach}, brick_box.high));
  }
  BuiltBrick built;
  const std::vector<std::vector<std::uint32_t>> lists = divide(source, members, box, built.brick.grid);
  const CellGrid& grid = built.brick.grid;
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x) {
        const std::vector<std::uint32_t>& list = lists[static_cast<std::size_t>(grid.index(x, y, z))];
        DensityCell cell;
        cell.first_block = static_cast<std::uint32_t>(built.blocks.size());
        for (std::size_t begin = 0; begin < list.size();) {
          std::size_t end = begin;
          while (end < list.size() && end - begin < 16 &&
                 source.balls[list[end]].fluid == source.balls[list[begin]].fluid)
            ++end;
          append_block(source, list.data() + begin, end - begin, built);
          begin = end;
        }
        cell.block_count = (static_cast<std::uint32_t>(built.blocks.size()) - cell.first_block) & 0xffffffu;
        if (cell.block_count > 0) {
          const std::uint8_t first = built.block_fluid[cell.first_block], last = built.block_fluid.back();
          cell.fluid = first == last ? first : mixed_fluids;
        }
        built.cells.push_back(cell);
        const Rgb bound = cell_bound(source, list, cell_box(grid, x, y, z, source.slack));
        Rgb& majorant = built.majorant;
        majorant = {std::max(majorant.r, bound.r), std::max(majorant.g, bound.g), std::max(majorant.b, bound.b)};
      }
  return built;
}

/// Extinctions of a fluid's particles as factors of one colour, and tints where they have their own.
void add_fluid(const DensityParticles& particles, int number, DensityFluid& fluid, std::vector<Ball>& balls,
               std::vector<BallColours>& colours) {
  fluid.albedo = particles.albedo;
  fluid.phase = particles.phase;
  fluid.smooth = particles.model == DensityModel::smooth;
  fluid.extinction = particles.extinction;
  if (!particles.extinctions.empty()) {
    fluid.extinction = {};
    for (const Rgb& k : particles.extinctions)
      fluid.extinction = {std::max(fluid.extinction.r, k.r), std::max(fluid.extinction.g, k.g),
                          std::max(fluid.extinction.b, k.b)};
  }
  fluid.own_colours = !particles.extinctions.empty() || !particles.albedos.empty() || !particles.emission.empty();

  for (std::size_t i = 0; i < particles.positions.size(); ++i) {
    const float radius = particles.radii.empty() ? particles.radius : particles.radii[i];
    if (!(radius > 0)) continue;
    BallColours own{grey(1), particles.albedo, {}};
    Ball ball;
    ball.center = particles.positions[i];
    ball.fluid = static_cast<std::uint8_t>(number);
    ball.reach = fluid.smooth ? smooth_reach * radius : radius;
    ball.factor = particles.factors.empty() ? 1 : particles.factors[i];
    if (!particles.extinctions.empty()) {
      Rgb relative;
      for (int c = 0; c < 3; ++c)
        relative[c] = fluid.extinction[c] > 0 ? particles.extinctions[i][c] / fluid.extinction[c] : 0;
      ball.factor = max_component(relative);
      own.tint = ball.factor > 0 ? relative * (1 / ball.factor) : grey(1);
    }
    if (fluid.smooth) {
      const float share = radius / particles.radius;
      ball.factor *= particles.volume * share * share * share * 8 * inv_pi / (ball.reach * ball.reach * ball.reach);
    }
    if (fluid.own_colours) {
      if (!particles.albedos.empty()) own.albedo = particles.albedos[i];
      if (!particles.emission.empty()) own.emission = particles.emission[i];
      ball.colours = static_cast<std::uint32_t>(colours.size());
      colours.push_back(own);
    }
    balls.push_back(ball);
  }
}

/// Side of the bricks: several balls, so that flights take few steps, but no more than about two mean free paths, so that void
/// beside the balls costs little.
float choose_brick(const Source& source) {
  double cell = 0, extinction = 0;
  for (const Ball& ball : source.balls) {
    const DensityFluid& fluid = source.fluids[ball.fluid];
    cell += static_cast<double>(cell_size(source, ball));
    extinction += static_cast<double>(max_component(fluid.extinction) * (fluid.smooth ? 1 : ball.factor));
  }
  const auto count = static_cast<double>(source.balls.size());
  const double free_cells = count * count / std::max(extinction * cell, 1e-30);
  return static_cast<float>(std::clamp(std::floor(2 * free_cells), 4.0, 12.0) * cell / count);
}

/// Of the particles, with the gaps that balls as large as a solver's particles leave between them.
float mean_extinction(const Source& source) {
  constexpr double filled = 0.63;
  double sum = 0;
  for (const Ball& ball : source.balls) {
    const DensityFluid& fluid = source.fluids[ball.fluid];
    sum += static_cast<double>(mean(fluid.extinction) * (fluid.smooth ? 1 : ball.factor));
  }
  return source.balls.empty() ? 0 : static_cast<float>(filled * sum / static_cast<double>(source.balls.size()));
}

/// Lists of the balls in each brick.
using BrickLists = std::vector<std::vector<std::uint32_t>>;

/// Divides the space of all balls into bricks of at least `side`: they grow until there are not too many, nor too many balls
/// in several of them.
BrickLists list_bricks(const Source& source, const Box3& bounds, float side, CellGrid& grid) {
  const Vec3 size = bounds.high - bounds.low;
  for (;; side *= 2) {
    const auto count = [&](float extent) {
      return std::max(std::ceil(static_cast<double>(extent) / static_cast<double>(side)), 1.0);
    };
    const double bricks = count(size.x) * count(size.y) * count(size.z);
    if (bricks > static_cast<double>(most_bricks)) continue;
    grid = grid_over(bounds, static_cast<int>(count(size.x)), static_cast<int>(count(size.y)),
                     static_cast<int>(count(size.z)));
    BrickLists lists(static_cast<std::size_t>(bricks));
    std::size_t entries = 0;
    const std::size_t limit = 16 * source.balls.size() + 65536;
    for (std::size_t i = 0; i < source.balls.size() && entries <= limit; ++i)
      for_cells_of(grid, source.balls[i], source.slack, [&](std::size_t cell) {
        lists[cell].push_back(static_cast<std::uint32_t>(i));
        ++entries;
      });
    if (entries <= limit || bricks == 1) return lists;
  }
}

/// The box of all balls, with room for the rounding of points near its faces, which is noted in `source`.
Box3 bounds_of(Source& source) {
  Box3 bounds;
  for (const Ball& ball : source.balls) {
    bounds.include(ball.center - Vec3{ball.reach, ball.reach, ball.reach});
    bounds.include(ball.center + Vec3{ball.reach, ball.reach, ball.reach});
  }
  const Vec3 size = bounds.high - bounds.low, farthest = max_of(-bounds.low, bounds.high);
  source.slack = coordinate_slack * std::max({farthest.x, farthest.y, farthest.z, size.x, size.y, size.z});
  const Vec3 margin{source.slack, source.slack, source.slack};
  return {bounds.low - margin, bounds.high + margin};
}

}  // namespace

ParticleDensity::ParticleDensity(std::span<const DensityParticles> fluids, MediaOverlap overlap, float brick) {
  EMBRUN_CHECK(fluids.size() <= static_cast<std::size_t>(max_density_fluids));
  fluids_.resize(fluids.size());
  Source source{{}, fluids_, overlap};
  for (std::size_t i = 0; i < fluids.size(); ++i) {
    std::vector<Ball> own;
    add_fluid(fluids[i], static_cast<int>(i), fluids_[i], own, colours_);
    // A fluid without any extinction is not there.
    const bool present = !is_black(fluids_[i].extinction) &&
                         std::any_of(own.begin(), own.end(), [](const Ball& ball) { return ball.factor > 0; });
    if (!present) continue;
    const DensityFluid& fluid = fluids_[i];
    view_.present |= 1u << i;
    view_.grey = view_.grey && !fluid.own_colours && fluid.extinction == grey(fluid.extinction.r);
    view_.piecewise = view_.piecewise && !fluid.smooth;
    const float reach = own.front().reach;
    const bool same = std::all_of(own.begin(), own.end(), [&](const Ball& ball) { return ball.reach == reach; });
    fluids_[i].reach_squared = same ? reach * reach : 0;
    source.balls.insert(source.balls.end(), own.begin(), own.end());
  }
  view_.mean_extinction = mean_extinction(source);
  view_.overlap = overlap;
  view_.fluid_count = static_cast<int>(fluids_.size());
  view_.fluids = fluids_.data();
  balls_ = source.balls.size();
  if (balls_ > 0) fill(source, brick);
}

void ParticleDensity::fill(DensitySource& source, float brick) {
  const Box3 bounds = bounds_of(source);
  const BrickLists lists = list_bricks(source, bounds, brick > 0 ? brick : choose_brick(source), view_.grid);
  std::vector<std::uint32_t> filled;
  brick_index_.assign(lists.size(), no_brick);
  for (std::size_t i = 0; i < lists.size(); ++i) {
    if (lists[i].empty()) continue;
    brick_index_[i] = static_cast<std::uint32_t>(filled.size());
    filled.push_back(static_cast<std::uint32_t>(i));
  }

  // Each brick on its own, then all put together in their order.
  std::vector<BuiltBrick> built(filled.size());
  parallel_for(filled.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const int index = static_cast<int>(filled[i]), nx = view_.grid.nx, ny = view_.grid.ny;
      const Box3 box = cell_box(view_.grid, index % nx, index / nx % ny, index / nx / ny, source.slack);
      built[i] = build_brick(source, lists[filled[i]], box);
    }
  });
  const std::size_t channels = view_.grey ? 1 : 3;
  majorants_.assign(channels * lists.size(), 0.0f);
  for (std::size_t i = 0; i < built.size(); ++i)
    for (std::size_t c = 0; c < channels; ++c)
      majorants_[c * lists.size() + filled[i]] = built[i].majorant[static_cast<int>(c)];
  const bool own_reach = std::any_of(source.balls.begin(), source.balls.end(),
                                     [&](const Ball& ball) { return fluids_[ball.fluid].reach_squared == 0; });
  for (BuiltBrick& part : built) {
    const auto first_block = static_cast<std::uint32_t>(blocks_.size());
    part.brick.first_cell = static_cast<std::uint32_t>(cells_.size());
    bricks_.push_back(part.brick);
    for (DensityCell cell : part.cells) {
      cell.first_block += first_block;
      cells_.push_back(cell);
    }
    blocks_.insert(blocks_.end(), part.blocks.begin(), part.blocks.end());
    if (own_reach) block_reach_.insert(block_reach_.end(), part.block_reach.begin(), part.block_reach.end());
    block_fluid_.insert(block_fluid_.end(), part.block_fluid.begin(), part.block_fluid.end());
    if (!colours_.empty())
      block_colours_.insert(block_colours_.end(), part.block_colours.begin(), part.block_colours.end());
    part = {};
  }

  for (std::size_t c = 0; c < 3; ++c) view_.majorants[c] = majorants_.data() + (c < channels ? c * lists.size() : 0);
  view_.brick_index = brick_index_.data();
  view_.bricks = bricks_.data();
  view_.cells = cells_.data();
  view_.blocks = blocks_.data();
  view_.block_fluid = block_fluid_.data();
  view_.block_reach = block_reach_.empty() ? nullptr : block_reach_.data();
  view_.block_colours = block_colours_.empty() ? nullptr : block_colours_.data();
  view_.colours = colours_.data();
}

ParticleDensityStats ParticleDensity::stats() const {
  ParticleDensityStats s;
  s.balls = balls_;
  s.bricks = bricks_.size();
  s.cells = cells_.size();
  s.blocks = blocks_.size();
  s.bytes = brick_index_.size() * sizeof brick_index_[0] + majorants_.size() * sizeof majorants_[0] +
            bricks_.size() * sizeof bricks_[0] + cells_.size() * sizeof cells_[0] +
            blocks_.size() * (sizeof blocks_[0] + 1) + block_reach_.size() * sizeof block_reach_[0] +
            block_colours_.size() * sizeof block_colours_[0] + colours_.size() * sizeof colours_[0];
  s.brick = view_.grid.cell.x;
  return s;
}

}  // namespace embrun
