#include "geometry/surface_grid.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace embrun {
namespace {

TEST(SurfaceGrid, HasSplitCellsOfWholeSteps) {
  // A stray particle makes the top cells coarse; the finest cells' centres are at halves of those that are split down to.
  for (const float away : {1.0f, 30.0f, 100.0f, 300.0f}) {
    for (const int order : {1, 2, 3}) {
      const std::vector<Vec3> positions{{0, 0, 0}, {0.05f, 0, 0}, {away, away, away}};
      SurfaceSettings settings;
      settings.radius = 0.025f;
      settings.order = order;
      const SurfaceModel model = resolve_surface_model(positions, {}, settings);
      const GridPlan plan = plan_grid(positions, {}, model, positions.size());
      const double step = plan.units_per_grid * 0.5 * plan.target;
      EXPECT_GE(step, 1.0) << away << ' ' << order;
      EXPECT_EQ(step, std::floor(step)) << away << ' ' << order;
    }
  }
}

}  // namespace
}  // namespace embrun
