#pragma once

#include <vector>

#include "media/grid_medium.h"

namespace embrun {

/// Numbers on a grid with their place: what a medium is built from.
struct GridValues {
  std::vector<float> values;  ///< as in ValueGrid
  int nx = 0, ny = 0, nz = 0;
  int channels = 1;
  bool nearest = false;
  Transform to_world;  ///< of [0,1]^3 in the scene; can be inverted

  ValueGrid view() const { return {values.data(), nx, ny, nz, channels, nearest}; }
};

/// The arrays of a GridMedium; immutable once built.
class GridMediumData {
 public:
  /// `extinction` per metre, 0 or more and finite. `albedo`: in [0, 1]; if it has no values, `constant_albedo` counts.
  /// `block`: cells along the sides of the blocks that share a majorant.
  GridMediumData(GridValues extinction, GridValues albedo, Rgb constant_albedo, PhaseFunction phase, int block = 8);

  /// Valid while this object lives (moving it keeps views valid).
  const GridMedium& view() const { return view_; }

 private:
  GridValues extinction_, albedo_;
  std::vector<Rgb> majorants_;
  GridMedium view_;
};

}  // namespace embrun
