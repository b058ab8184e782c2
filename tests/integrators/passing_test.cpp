// Boundaries that a path crosses straight on.

#include <gtest/gtest.h>

#include "integrators/path_stages.h"

namespace embrun {
namespace {

/// A body of index 1 whose two sheets meet at t = 1 of the ray along z: rounding lets the ray meet them there in turn, as long
/// as it has not got clear of them.
struct MeetingSheets {
  bool intersect(const Ray& ray, const MediaState& media, SceneHit& hit) const {
    if (ray.t_min > 1.000005f) return false;
    hit.media_class = 1;
    hit.solid = 0;
    hit.offset = 1e-6f;
    hit.surface.t = ray.t_min > 1.0f ? ray.t_min : 1.0f;
    hit.surface.geometric_normal = hit.surface.shading_normal = {0, 0, -1};
    hit.surface.entering = !media.inside_solid(0);
    return true;
  }
  MediaState media_at(Vec3, float) const { return {}; }
};

PathScene scene_of(const Material& material) {
  PathScene scene;
  scene.materials = &material;
  scene.media[1].ior = 1;
  return scene;
}

TEST(Passing, APathGetsClearOfSheetsThatMeet) {
  Material material;
  material.kind = BsdfKind::dielectric;
  const PathScene scene = scene_of(material);
  PathState path;
  path.alive = true;
  path.throughput = grey(1);
  PathCounters counters;
  const MeetingSheets sheets;
  while (path.alive) {
    SceneHit hit;
    MediaState behind;
    const bool found = sheets.intersect(path.ray, path.media, hit);
    advance_path(scene, sheets, path, found, hit, behind, counters);
  }
  EXPECT_FALSE(path.failed);
  EXPECT_EQ(counters.stuck, 0u);
  EXPECT_LT(path.passed, 200);
}

TEST(Passing, SoDoesAShadowRay) {
  Material material;
  material.kind = BsdfKind::dielectric;
  const PathScene scene = scene_of(material);
  ShadowRay shadow;
  shadow.ray.t_max = 5;
  shadow.contribution = grey(1);
  PathCounters counters;
  EXPECT_EQ(trace_shadow_ray(scene, MeetingSheets{}, shadow, counters), grey(1));
  EXPECT_EQ(counters.stuck, 0u);
}

}  // namespace
}  // namespace embrun
