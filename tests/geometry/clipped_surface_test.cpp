#include "geometry/clipped_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "geometry/implicit_surface_trace.h"

namespace embrun {
namespace {

struct Fluid {
  const ImplicitSurfaceView& surface;

  bool intersect(const Ray& ray, Side side, SurfaceHit& hit) const {
    return intersect_implicit_surface(surface, ray, side, hit);
  }
  bool contains(Vec3 p) const { return implicit_surface_contains(surface, p); }
};

/// A block of fluid from 0.5 to 2 in x and z and from 0.5 to 1.25 in y, whose surface is far out of the box but for its
/// top, which is in the box: the box cuts it off on five sides.
struct CutBlock {
  Box3 box{{0.75f, 0.75f, 0.75f}, {1.75f, 1.75f, 1.75f}};
  ImplicitSurface surface;

  /// So many metres away along x.
  explicit CutBlock(float away = 0.0f) {
    box.low.x += away;
    box.high.x += away;
    std::vector<Vec3> positions;
    for (int z = 0; z < 30; ++z)
      for (int y = 0; y < 15; ++y)
        for (int x = 0; x < 30; ++x)
          positions.push_back(Vec3{away + 0.525f, 0.525f, 0.525f} +
                              0.05f * Vec3{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    SurfaceSettings settings;
    settings.radius = 0.025f;
    settings.order = 2;
    surface = build_implicit_surface(positions, {}, settings);
  }
};

float moved_by_ulps(float v, int ulps) {
  for (int i = 0; i < std::abs(ulps); ++i) v = std::nextafter(v, ulps > 0 ? infinity : -infinity);
  return v;
}

/// A point of a face, an edge or a corner of the wet part of the box, a few last digits off it, in or out.
Vec3 point_at_faces(const Box3& box, std::mt19937& random) {
  std::uniform_real_distribution<float> within(0.0f, 1.0f);
  std::uniform_int_distribution<int> digits(-6, 6), faces(1, 7), coin(0, 1);
  const int on = faces(random);
  Vec3 p;
  for (int axis = 0; axis < 3; ++axis) {
    const float high = axis == 1 ? 1.1f : box.high[axis];
    p[axis] = box.low[axis] + (high - box.low[axis]) * within(random);
    if ((on >> axis & 1) == 0) continue;
    const bool upper = axis != 1 && coin(random) == 1;
    p[axis] = moved_by_ulps(upper ? box.high[axis] : box.low[axis], digits(random));
  }
  return p;
}

// What stands at the box outside, or lies in it, leaves the origins of rays on either side of a face by rounding. The
// side that the ray is said to be on holds: every crossing enters from outside and leaves from inside.
TEST(ClippedSurface, RaysFromItsFacesCrossItInTurn) {
  const CutBlock cut;
  const Fluid fluid{cut.surface.view()};
  std::mt19937 random(11);
  std::normal_distribution<float> normal;
  int wrong = 0, entered = 0;
  for (int i = 0; i < 200000; ++i) {
    Ray ray;
    ray.origin = point_at_faces(cut.box, random);
    ray.direction = normalize(Vec3{normal(random), normal(random), normal(random)});
    Side side = i % 2 == 0 ? Side::outside : Side::inside;
    // Straight on through one crossing after the other, to infinity.
    int crossings = 0;
    for (SurfaceHit hit; crossings < 20 && intersect_clipped(fluid, cut.box, ray, side, hit); ++crossings) {
      wrong += hit.entering != (side == Side::outside) || hit.t < ray.t_min;
      entered += hit.entering;
      side = hit.entering ? Side::inside : Side::outside;
      ray.t_min = hit.t;
    }
    wrong += side == Side::inside || crossings == 20;
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(entered, 10000);
}

// A ray that starts outside by its side, but a last digit inside, and goes on inwards has entered by the face that it is at.
TEST(ClippedSurface, ARayThatRoundingPutInsideEntersByTheFace) {
  const CutBlock cut;
  const Fluid fluid{cut.surface.view()};
  Ray ray;
  ray.origin = {moved_by_ulps(0.75f, 3), 1, 1};
  ray.direction = normalize(Vec3{0.2f, 0.3f, 0.1f});
  SurfaceHit hit;
  ASSERT_TRUE(intersect_clipped(fluid, cut.box, ray, Side::outside, hit));
  EXPECT_TRUE(hit.entering);
  EXPECT_EQ(hit.t, 0.0f);
  EXPECT_EQ(hit.position.x, 0.75f);
  EXPECT_EQ(hit.geometric_normal.x, -1.0f);
  // Outwards it is gone.
  ray.direction = normalize(Vec3{-0.2f, 0.3f, 0.1f});
  EXPECT_FALSE(intersect_clipped(fluid, cut.box, ray, Side::outside, hit));
  // Above the fluid it has entered nothing, and meets the surface from above.
  ray.origin.y = 1.7f;
  ray.direction = normalize(Vec3{0.5f, -0.8f, 0});
  ASSERT_TRUE(intersect_clipped(fluid, cut.box, ray, Side::outside, hit));
  EXPECT_TRUE(hit.entering);
  EXPECT_NEAR(hit.position.y, 1.25, 0.03);
}

// Where it left by the body's surface, in the last digits before a face, it has not come in by the face.
TEST(ClippedSurface, ARayThatLeftByTheSurfaceBesideAFaceIsOut) {
  const CutBlock cut;
  const Fluid fluid{cut.surface.view()};
  Ray ray;
  ray.origin = {1.75f - 2e-5f, 1.7f, 1.4f};
  ray.direction = {0, -1, 0};
  SurfaceHit hit;
  ASSERT_TRUE(intersect_clipped(fluid, cut.box, ray, Side::outside, hit));
  ray.origin = hit.position - Vec3{0, 1e-6f, 0};
  ASSERT_TRUE(fluid.contains(ray.origin));
  ray.direction = normalize(Vec3{-1e-4f, 0.93f, 0.37f});
  EXPECT_FALSE(intersect_clipped(fluid, cut.box, ray, Side::outside, hit));
}

// Far from the origin rounding is deeper than the field forgives: what is out a little further on meets nothing, though it
// starts in the body.
TEST(ClippedSurface, ARayThatLeftByTheSurfaceBesideAFarFaceIsOut) {
  const float away = 256.0f;
  const CutBlock cut(away);
  const Fluid fluid{cut.surface.view()};
  int outside = 0;
  for (const float depth : {1e-4f, 1e-3f, 3e-3f}) {
    Ray ray;
    ray.origin = {away + 1.75f - 2e-3f, 1.7f, 1.4f};
    ray.direction = {0, -1, 0};
    SurfaceHit hit;
    ASSERT_TRUE(intersect_clipped(fluid, cut.box, ray, Side::outside, hit));
    ray.origin = hit.position - Vec3{0, depth, 0};
    ASSERT_TRUE(fluid.contains(ray.origin));
    ray.direction = normalize(Vec3{-1e-2f, 0.93f, 0.37f});
    outside += !intersect_clipped(fluid, cut.box, ray, Side::outside, hit);
  }
  EXPECT_EQ(outside, 3);
}

}  // namespace
}  // namespace embrun
