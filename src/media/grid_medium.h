#pragma once

#include <cstdint>

#include "geometry/grid_walk.h"
#include "math/rgb.h"
#include "math/transform.h"
#include "media/phase_function.h"

// A medium given by numbers on a grid of cells: what per-ray code reads. Where the numbers are from (a file, particles)
// makes no difference. grid_medium_build.h makes it, grid_flight.h flies through it.

namespace embrun {

/// Numbers on the box [0,1]^3, which is divided into nx x ny x nz cells; they are those of the cells' centres. A view.
struct ValueGrid {
  const float* values = nullptr;  ///< [((z ny + y) nx + x) channels + channel]
  int nx = 0, ny = 0, nz = 0;
  int channels = 1;      ///< 1: the same in the three channels; or 3
  bool nearest = false;  ///< the number of the cell; else trilinear between the centres
};

EMBRUN_FN Rgb cell_value(const ValueGrid& grid, int x, int y, int z) {
  const std::int64_t cell = (static_cast<std::int64_t>(z) * grid.ny + y) * grid.nx + x;
  const float* v = grid.values + cell * grid.channels;
  return grid.channels == 1 ? grey(v[0]) : Rgb{v[0], v[1], v[2]};
}

/// Two cells next to each other along an axis, and the share of the second one. Beyond the outermost centres it is theirs.
struct CellPair {
  int first, second;
  float share;

  EMBRUN_FN CellPair(float position, int cells) {
    const float at = clamp(position * static_cast<float>(cells) - 0.5f, 0.0f, static_cast<float>(cells - 1));
    first = static_cast<int>(at);
    second = first + 1 < cells ? first + 1 : first;
    share = at - static_cast<float>(first);
  }
};

/// The value at a point of [0,1]^3; points outside are moved to the nearest one inside.
EMBRUN_LOCAL_FN Rgb value_at(const ValueGrid& grid, Vec3 p) {
  if (grid.nearest) {
    const auto index = [](float position, int cells) {
      return static_cast<int>(clamp(position * static_cast<float>(cells), 0.0f, static_cast<float>(cells - 1)));
    };
    return cell_value(grid, index(p.x, grid.nx), index(p.y, grid.ny), index(p.z, grid.nz));
  }
  const CellPair x(p.x, grid.nx), y(p.y, grid.ny), z(p.z, grid.nz);
  const auto along_x = [&](int iy, int iz) {
    return cell_value(grid, x.first, iy, iz) * (1.0f - x.share) + cell_value(grid, x.second, iy, iz) * x.share;
  };
  const auto plane = [&](int iz) { return along_x(y.first, iz) * (1.0f - y.share) + along_x(y.second, iz) * y.share; };
  return plane(z.first) * (1.0f - z.share) + plane(z.second) * z.share;
}

/// Scatters and absorbs in the box of its extinction; nothing is outside of that. A view of arrays that a GridMediumData
/// owns.
struct GridMedium {
  ValueGrid extinction;     ///< per metre
  Transform to_extinction;  ///< from the scene to its box [0,1]^3
  ValueGrid albedo;         ///< scattering / extinction; without values it is `constant_albedo`
  Transform to_albedo;
  Rgb constant_albedo;
  PhaseFunction phase;
  CellGrid blocks;                 ///< of [0,1]^3
  const Rgb* majorants = nullptr;  ///< by block: no point of it has a larger extinction
  bool grey = true;                ///< the extinction is the same in the three channels
  float mean_extinction = 0;       ///< per metre, over the box and the channels
};

EMBRUN_LOCAL_FN Rgb albedo_at(const GridMedium& medium, Vec3 point) {
  if (medium.albedo.values == nullptr) return medium.constant_albedo;
  return value_at(medium.albedo, medium.to_albedo.point(point));
}

/// Per metre; nothing outside the box of the extinction.
EMBRUN_LOCAL_FN Rgb scattering_at(const GridMedium& medium, Vec3 point) {
  const Vec3 p = medium.to_extinction.point(point);
  if (!(p.x >= 0.0f && p.y >= 0.0f && p.z >= 0.0f && p.x <= 1.0f && p.y <= 1.0f && p.z <= 1.0f)) return {};
  return value_at(medium.extinction, p) * albedo_at(medium, point);
}

}  // namespace embrun
