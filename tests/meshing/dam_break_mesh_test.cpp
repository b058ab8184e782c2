#include <gtest/gtest.h>

#include <vector>

#include "io/read_particles.h"
#include "meshing/isosurface.h"

namespace embrun {
namespace {

// The mesh of another program (double precision) that the reference picture of the dam break was made from, as its notes
// state it. Thousands of drops make the count of pieces depend on where the grid lies.
TEST(DamBreakMesh, AgreesWithTheIndependentOne) {
  std::vector<Vec3> positions;
  for (const Vec3d& p : read_particles(EMBRUN_DATA_DIR "/dam_break.bgeo").positions) positions.push_back(to_float(p));
  ASSERT_EQ(positions.size(), 110592u);
  SurfaceSettings settings;
  settings.radius = 0.025f;
  settings.order = 3;
  settings.threshold_mode = ThresholdMode::number;
  settings.threshold = 10.415897f;
  settings.recover = RecoverMode::thesis;
  const SurfaceModel model = resolve_surface_model(positions, {}, settings);
  EXPECT_EQ(model.recovered.size(), 6807u);
  const TriangleMesh mesh = extract_isosurface(positions, {}, model, {.cell = 0.025f / 3});
  EXPECT_NEAR(enclosed_volume(mesh) / 11.092870, 1.0, 5e-5);
  EXPECT_NEAR(surface_area(mesh) / 80.40078, 1.0, 2e-4);
  EXPECT_NEAR(static_cast<double>(mesh.triangles.size()) / 3226088, 1.0, 5e-3);
  EXPECT_NEAR(static_cast<double>(component_count(mesh)) / 2501, 1.0, 5e-3);
}

}  // namespace
}  // namespace embrun
