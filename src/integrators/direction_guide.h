#pragma once

#include "math/vec.h"
#include "sampling/distribution.h"

namespace embrun {

/// Where light comes from at diffuse surfaces, all of them together: one table of directions for surfaces in air, one for
/// those inside a body. The sun's light reaches the bottom of water through a refraction, which shadow rays cannot follow;
/// but from wherever it comes, it comes from much the same directions, and these can be drawn more often. A rough form of
/// path guiding [Jensen1995]; mixed with the surface's own choice it changes the noise, never the mean.
/// A view of tables that a backend learns before it renders.
struct DirectionGuide {
  Distribution2D cells[2];  ///< [0] in air, [1] in a body
  float share = 0;          ///< of directions that are drawn from the tables; 0: there are none
};

// The directions as a table: columns are longitudes about +y from +z, rows heights; all cells have the same solid angle.

inline constexpr int guide_columns = 128, guide_rows = 64;

struct GuideCell {
  int x = 0, y = 0;
};

EMBRUN_FN GuideCell guide_cell(Vec3 direction) {
  const float turn = 0.5f + atan2f(direction.x, direction.z) * (0.5f * inv_pi);
  const float height = 0.5f + 0.5f * direction.y;
  return {min_of(static_cast<int>(turn * guide_columns), guide_columns - 1),
          min_of(static_cast<int>(height * guide_rows), guide_rows - 1)};
}

/// Density with which sample_guide draws `direction`, per steradian.
EMBRUN_LOCAL_FN float guide_pdf(const Distribution2D& cells, Vec3 direction) {
  const GuideCell cell = guide_cell(direction);
  return cell_probability(cells, cell.x, cell.y) * (guide_columns * guide_rows * 0.25f * inv_pi);
}

/// Draws a cell, then a direction uniformly within it.
EMBRUN_LOCAL_FN Vec3 sample_guide(const Distribution2D& cells, Sample2 u) {
  const CellSample cell = sample_cell(cells, u);
  const float turn = (static_cast<float>(cell.x) + cell.remainder.x) * (1.0f / guide_columns);
  const float height = (static_cast<float>(cell.y) + cell.remainder.y) * (1.0f / guide_rows);
  const float y = 2.0f * height - 1.0f;
  const float ring = sqrtf(max_of(0.0f, 1.0f - y * y));
  const float longitude = 2.0f * pi * (turn - 0.5f);
  return {ring * sinf(longitude), y, ring * cosf(longitude)};
}

}  // namespace embrun
