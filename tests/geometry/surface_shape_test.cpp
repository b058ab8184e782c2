// What the surface model promises about shapes, measured on the surface itself.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "geometry/tracers.h"
#include "measure/oracle_scene.h"
#include "meshing/isosurface.h"
#include "support/cubic_lattice.h"

namespace embrun::test {
namespace {

using testing_support::cubic_lattice;

TEST(SurfaceShape, AnIsolatedDropletIsABallOfRadiusR0) {
  // Its own field D = 1 is far below T for n = 2, 3 (and T = f(R0) for n = 1): recovered, T' = f(R0). To 1e-3 R0, from
  // all sides and from inside, by both tracers and every kernel.
  const std::vector<Vec3> one{{0.3f, -0.2f, 0.1f}};
  for (const char* method : {"fast", "thesis"}) {
    for (const Kernel kernel : {Kernel::metaball, Kernel::zhu_bridson, Kernel::blinn}) {
      for (const int order : {1, 2, 3}) {
        SurfaceSettings settings;
        settings.radius = 0.05f;
        settings.order = order;
        settings.kernel = kernel;
        const Tracer tracer = make_tracer(method, "", one, {}, settings);
        Dice dice(static_cast<std::uint64_t>(order));
        for (int i = 0; i < 100; ++i) {
          Ray out;
          out.origin = one[0];
          out.direction = dice.direction();
          SurfaceHit hit;
          ASSERT_TRUE(tracer.intersect(out, Side::inside, hit)) << method << " n = " << order;
          EXPECT_NEAR(hit.t, settings.radius, 1e-3f * settings.radius);
          EXPECT_FALSE(hit.entering);
          EXPECT_NEAR(dot(hit.geometric_normal, out.direction), 1.0f, 1e-4f);
          EXPECT_NEAR(dot(hit.shading_normal, out.direction), 1.0f, 1e-4f);
          Ray in = out;
          in.origin = one[0] + out.direction;
          in.direction = -out.direction;
          ASSERT_TRUE(tracer.intersect(in, Side::outside, hit)) << method << " n = " << order;
          EXPECT_NEAR(hit.t, 1.0f - settings.radius, 1e-3f * settings.radius);
          EXPECT_TRUE(hit.entering);
        }
      }
    }
  }
}

TEST(SurfaceShape, AFlatSlabHasItsSurfaceHalfASpacingOutsideItsOuterLayer) {
  // Twelve layers, wide enough that the middle does not feel the rim (b = 6 R0 = 3.2 s at most).
  const float radius = 0.05f;
  for (const double relative_spacing : {1.0, 0.93}) {
    const auto s = static_cast<float>(relative_spacing * 2 * static_cast<double>(radius));
    const std::vector<Vec3> positions = cubic_lattice(14, 12, 14, s);
    for (const int order : {2, 3}) {
      SurfaceSettings settings;
      settings.radius = radius;
      settings.order = order;
      settings.spacing = static_cast<double>(s);
      const Tracer tracer = make_tracer("fast", "", positions, {}, settings);
      // Straight down over one period of the lattice, 16 x 16 rays.
      double mean = 0, worst = 0;
      for (int i = 0; i < 256; ++i) {
        Ray ray;
        ray.origin =
            s * Vec3{6.0f + static_cast<float>(i % 16) / 16.0f, 20.0f, 6.0f + static_cast<float>(i / 16) / 16.0f};
        ray.direction = {0, -1, 0};
        SurfaceHit hit;
        ASSERT_TRUE(tracer.intersect(ray, Side::outside, hit));
        const double height = (static_cast<double>(hit.position.y) / static_cast<double>(s) - 11.0) / 0.5;
        mean += height / 256;
        worst = std::max(worst, std::abs(height - 1));
      }
      EXPECT_NEAR(mean, 1.0, 0.05) << "n = " << order << ", s = " << s;
      EXPECT_LE(worst, 0.05) << "n = " << order << ", s = " << s;
    }
  }
}

TEST(SurfaceShape, ACubeEnclosesTheVolumeOfItsParticles) {
  const float radius = 0.05f, s = 0.1f;
  const std::vector<Vec3> positions = cubic_lattice(32, 32, 32, s);
  for (const int order : {2, 3}) {
    SurfaceSettings settings;
    settings.radius = radius;
    settings.order = order;
    const SurfaceModel model = resolve_surface_model(positions, {}, settings);
    const TriangleMesh mesh = extract_isosurface(positions, {}, model, {.cell = radius});
    EXPECT_NEAR(enclosed_volume(mesh) / (32.0 * 32.0 * 32.0 * 1e-3), 1.0, 0.03) << "n = " << order;
  }
}

}  // namespace
}  // namespace embrun::test
