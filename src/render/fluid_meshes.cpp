#include "render/fluid_meshes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

#include "base/error.h"
#include "meshing/density_grid.h"
#include "meshing/isosurface.h"
#include "scene/compile_media.h"

namespace embrun {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool wants_grid(const FluidDescription& fluid) {
  return fluid.method == SurfaceMethod::mesh && fluid.medium && fluid.medium->emission.empty() &&
         fluid.medium->temperatures.empty() && fluid.material.grid_medium < 0;
}

/// A box of cells that holds all tiles of a grid.
struct CellBox {
  std::array<int, 3> low, size;
};

/// Beyond the box a grid's outermost cells go on: they must be empty.
CellBox box_of(const DensityGrid& grid) {
  CellBox box{{1 << 21, 1 << 21, 1 << 21}, {}};
  std::array<int, 3> high{};
  for (const auto& tile : grid.tiles) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], tile[axis] * DensityGrid::tile_side);
      high[axis] = std::max(high[axis], (tile[axis] + 1) * DensityGrid::tile_side);
    }
  }
  double cells = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.low[axis] -= 1;
    box.size[axis] = std::max(high[axis] + 1 - box.low[axis], 1);
    cells *= box.size[axis];
  }
  if (cells > 2e9)
    throw Error(fmt::format("a grid of {:.3g} cells of {} m for what is in the fluid is too large: give larger cells",
                            cells, grid.cell));
  return box;
}

/// One of a sparse grid's numbers on all of a box.
template <class Number>
ValueGridDescription fill(const DensityGrid& grid, const CellBox& box, Vec3d recentring, int channels,
                          const Number& number) {
  ValueGridDescription result;
  result.nx = box.size[0];
  result.ny = box.size[1];
  result.nz = box.size[2];
  result.channels = channels;
  const auto stride = static_cast<std::size_t>(channels);
  result.values.resize(static_cast<std::size_t>(result.nx) * static_cast<std::size_t>(result.ny) *
                       static_cast<std::size_t>(result.nz) * stride);
  constexpr int side = DensityGrid::tile_side;
  for (std::size_t tile = 0; tile < grid.tiles.size(); ++tile) {
    for (std::size_t cell = 0; cell < DensityGrid::tile_cells; ++cell) {
      const auto i = static_cast<int>(cell);
      const auto x = static_cast<std::size_t>(grid.tiles[tile][0] * side + i % side - box.low[0]),
                 y = static_cast<std::size_t>(grid.tiles[tile][1] * side + i / side % side - box.low[1]),
                 z = static_cast<std::size_t>(grid.tiles[tile][2] * side + i / side / side - box.low[2]);
      const std::size_t to = ((z * static_cast<std::size_t>(result.ny) + y) * static_cast<std::size_t>(result.nx) + x);
      for (std::size_t c = 0; c < stride; ++c)
        result.values[to * stride + c] = number(tile * DensityGrid::tile_cells + cell, c);
    }
  }
  const double cell = static_cast<double>(grid.cell);
  const auto corner = [&](std::size_t axis) { return cell * box.low[axis]; };
  result.placement.x_axis = {cell * result.nx, 0, 0};
  result.placement.y_axis = {0, cell * result.ny, 0};
  result.placement.z_axis = {0, 0, cell * result.nz};
  result.placement.origin = recentring + to_double(grid.origin) + Vec3d{corner(0), corner(1), corner(2)};
  return result;
}

/// What a fluid's particles do to light, on a grid.
GridMediumDescription grid_medium(const FluidDescription& fluid, const MeshProgress& progress) {
  const Vec3d recentring = place(fluid.placement, fluid.positions.front());
  const PlacedParticles placed = place_particles(fluid, recentring);
  const double own = fluid.density_cell > 0 ? fluid.density_cell : 0.5 * static_cast<double>(fluid.surface.radius);
  const DensityGrid grid =
      sample_density(placed.particles, static_cast<float>(own * largest_scale(fluid.placement)), progress);
  const CellBox box = box_of(grid);
  GridMediumDescription medium;
  const auto channels = static_cast<std::size_t>(grid.channels);
  medium.extinction_grid = fill(grid, box, recentring, grid.channels, [&](std::size_t cell, std::size_t channel) {
    return grid.extinction[cell * channels + channel];
  });
  medium.albedo = fluid.medium->albedo;
  if (!grid.albedo.empty()) {
    medium.albedo_grid = fill(grid, box, recentring, 3, [&](std::size_t cell, std::size_t channel) {
      return grid.albedo[cell][static_cast<int>(channel)];
    });
  }
  medium.phase = fluid.medium->phase;
  return medium;
}

}  // namespace

FluidMesher fluid_mesher(FluidMeshCounts* counts, MeshProgress progress) {
  return [counts, progress = std::move(progress)](std::span<const Vec3> positions, std::span<const float> radii,
                                                  const FluidDescription& fluid) {
    const auto start = std::chrono::steady_clock::now();
    const SurfaceModel model = resolve_surface_model(positions, radii, fluid.surface);
    IsosurfaceSettings settings;
    settings.cell = static_cast<float>(fluid.mesh_cell);
    settings.progress = progress;
    TriangleMesh mesh = extract_isosurface(positions, radii, model, settings);
    if (counts == nullptr) return mesh;
    if (counts->vertices == 0) {
      counts->threshold = model.threshold;
      counts->influence_radius = model.influence_radius;
      counts->recovered = model.recovered.size();
    }
    counts->vertices += mesh.positions.size();
    counts->triangles += mesh.triangles.size();
    counts->seconds += seconds_since(start);
    return mesh;
  };
}

SceneDescription with_grid_media(const SceneDescription& scene, FluidMeshCounts* counts, const MeshProgress& progress) {
  validate(scene);
  SceneDescription result = scene;
  for (FluidDescription& fluid : result.fluids) {
    if (!wants_grid(fluid)) continue;
    const auto start = std::chrono::steady_clock::now();
    fluid.material.grid_medium = static_cast<int>(result.grid_media.size());
    result.grid_media.push_back(grid_medium(fluid, progress));
    fluid.medium.reset();
    if (counts == nullptr) continue;
    const ValueGridDescription& grid = *result.grid_media.back().extinction_grid;
    counts->grid_cells += grid.values.size() / static_cast<std::size_t>(grid.channels);
    counts->grid_seconds += seconds_since(start);
  }
  return result;
}

FlatScene compile_meshing(const SceneDescription& scene, FluidMeshCounts* counts, const MeshProgress& progress) {
  const FluidMesher mesher = fluid_mesher(counts, progress);
  if (std::none_of(scene.fluids.begin(), scene.fluids.end(), wants_grid)) return compile(scene, mesher);
  return compile(with_grid_media(scene, counts, progress), mesher);
}

}  // namespace embrun
