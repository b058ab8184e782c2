#pragma once

#include <vector>

#include "geometry/implicit_surface.h"

namespace embrun {

/// The arrays of a built surface.
struct ImplicitSurface::Storage {
  std::vector<std::uint32_t> words;
  std::vector<SurfaceCell> cells;
  std::vector<std::uint16_t> packed_lists, packed_recovered;
  std::vector<float> wide_lists, wide_recovered;
  ImplicitSurfaceView view{};
  ImplicitSurfaceStats stats;
};

}  // namespace embrun
