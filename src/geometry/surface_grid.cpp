#include "geometry/surface_grid.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "geometry/kernels.h"
#include "geometry/particle_eights.h"

namespace embrun {

namespace {

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

/// Steps a cell of the finest lattice whose coordinates hold the support on all sides of a box of `side` cells, and a value
/// beyond it for lanes without a particle. A multiple of `parts`.
double steps_per_cell(double reach_in_cells, double side, double parts) {
  return parts * std::floor((packed_end - 8) / (parts * (reach_in_cells + 0.5 * side)));
}

}  // namespace

GridPlan plan_grid(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceModel& model,
                   std::size_t most) {
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
  // Cells are numbered with 31 bits.
  const double budget = std::min(std::max(12.0 * static_cast<double>(most), 262144.0), 2147483648.0);
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
  plan.recovered_units_per_grid = 1.0f;
  const double reach_in_cells = support * static_cast<double>(model.influence_radius) / plan.cell_size;
  if (plan.equal_radii) {
    // The centres of split cells are whole steps too, as deep as splits go.
    const double parts = std::clamp(2.0 / plan.target, 64.0, std::ldexp(1.0, deepest_split + 1));
    plan.units_per_grid = steps_per_cell(reach_in_cells, brick_side, parts);
    plan.recovered_units_per_grid = static_cast<float>(
        steps_per_cell(support * static_cast<double>(model.recover_radius) / plan.cell_size, 1.0, parts));
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
  std::vector<float> x(count), y(count), z(count);
  std::vector<std::uint32_t> cell(count);
  // A coordinate's cell, and what is left of it.
  const auto divide = [&](float coordinate, int axis, float& rest) {
    const double steps = std::floor((static_cast<double>(coordinate) - plan.origin[axis]) * scale + 0.5);
    const double whole = std::floor(steps / plan.units_per_grid);
    rest = static_cast<float>(steps - whole * plan.units_per_grid);
    return static_cast<int>(whole);
  };
  parallel_for(count, 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const int cx = divide(positions[i].x, 0, x[i]), cy = divide(positions[i].y, 1, y[i]),
                cz = divide(positions[i].z, 2, z[i]);
      cell[i] = static_cast<std::uint32_t>((cz * plan.cells[1] + cy) * plan.cells[0] + cx);
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

}  // namespace embrun
