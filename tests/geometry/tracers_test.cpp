// The surface tracers before the oracle: few rays of every kind here, 10^5 of each class in tracers_slow_test.cpp.

#include "geometry/tracers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "measure/oracle_scene.h"

namespace embrun::test {
namespace {

struct Case {
  std::string scene;
  int order;
  Kernel kernel = Kernel::metaball;
  RecoverMode recover = RecoverMode::smooth;
};

std::string name_of_case(const testing::TestParamInfo<Case>& info) {
  std::string name = info.param.scene.substr(0, info.param.scene.find('.'));
  name = name.substr(name.rfind('/') + 1) + "_n" + std::to_string(info.param.order);
  if (info.param.kernel != Kernel::metaball) name += info.param.kernel == Kernel::blinn ? "_blinn" : "_zhu_bridson";
  if (info.param.recover != RecoverMode::smooth) name += info.param.recover == RecoverMode::off ? "_off" : "_thesis";
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

class Tracers : public testing::TestWithParam<Case> {};

TEST_P(Tracers, FindTheFirstCrossing) {
  OracleScene scene = make_scene(GetParam().scene, GetParam().order, 1);
  scene.settings.kernel = GetParam().kernel;
  scene.settings.recover = GetParam().recover;
  const oracle::Surface surface =
      oracle_surface(scene, resolve_surface_model(scene.positions, scene.radii, scene.settings));
  const std::vector<Tracer> tracers = make_fast_tracers(scene.positions, scene.radii, scene.settings);
  std::vector<Intersector> intersectors;
  for (const Tracer& tracer : tracers) intersectors.push_back(tracer.intersect);
  // At n = 5 the field of these sheets is level and near T over wide stretches, where single precision cannot tell
  // 1e-3 R0: up to 1 in 100 there, none elsewhere.
  const std::size_t allowed = GetParam().order > 3 ? 3 : 0;
  for (const RayClass ray_class : {RayClass::camera, RayClass::outside, RayClass::inside}) {
    const std::vector<TestRay> rays = make_rays(scene, surface, intersectors.back(), ray_class, 300, 1);
    EXPECT_GT(rays.size(), 100u);
    const std::vector<OracleReport> reports = judge_rays(scene, surface, intersectors, rays);
    for (std::size_t i = 0; i < reports.size(); ++i) {
      EXPECT_LE(reports[i].wrong_count(), allowed)
          << available_isas()[i] << " " << name_of(ray_class) << ": " << reports[i].summary();
    }
  }
}

TEST_P(Tracers, FindTheSameByTheBatch) {
  OracleScene scene = make_scene(GetParam().scene, GetParam().order, 1);
  scene.settings.kernel = GetParam().kernel;
  scene.settings.recover = GetParam().recover;
  const oracle::Surface judge =
      oracle_surface(scene, resolve_surface_model(scene.positions, scene.radii, scene.settings));
  const ImplicitSurface surface = build_implicit_surface(scene.positions, scene.radii, scene.settings);
  for (const std::string& isa : available_isas()) {
    const TraceFunction trace = trace_function(isa);
    const auto one = [&](const Ray& ray, Side side, SurfaceHit& hit) { return trace(surface.view(), ray, side, hit); };
    // Rays of all kinds in one batch, so that lanes in every state stand side by side.
    std::vector<TestRay> rays;
    for (const RayClass ray_class : {RayClass::camera, RayClass::outside, RayClass::inside}) {
      const std::vector<TestRay> some = make_rays(scene, judge, one, ray_class, 400, 2);
      rays.insert(rays.end(), some.begin(), some.end());
    }
    Dice dice(3);
    for (std::size_t i = rays.size(); i > 1; --i) {
      std::swap(rays[i - 1], rays[static_cast<std::size_t>(dice.next() * static_cast<double>(i))]);
    }
    const std::unique_ptr<bool[]> found(new bool[rays.size()]);
    std::vector<SurfaceHit> hits(rays.size());
    trace_batch_function(isa)(surface.view(), rays.data(), static_cast<int>(rays.size()), hits.data(), found.get());

    std::size_t met = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      SurfaceHit hit;
      ASSERT_EQ(found[i], one(rays[i].ray, rays[i].side, hit)) << isa << " ray " << i;
      if (!found[i]) continue;
      ++met;
      // Sums may be rounded otherwise, no more.
      const float cosine = fabsf(dot(hit.geometric_normal, rays[i].ray.direction));
      ASSERT_LT(fabsf(hit.t - hits[i].t) * cosine, 1e-4f * scene.settings.radius + 1e-6f * hit.t)
          << isa << " ray " << i;
      ASSERT_EQ(hit.entering, hits[i].entering) << isa << " ray " << i;
    }
    EXPECT_GT(met, rays.size() / 10);
    EXPECT_LT(met, rays.size());
  }
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const std::string& scene : synthetic_scene_names()) {
    for (const int order : {2, 3}) all.push_back({scene, order});
  }
  all.push_back({"droplets", 1});
  all.push_back({"sheets", 5});
  all.push_back({"droplets", 6});  // hundreds of particles in a list: parts of several eights
  for (const Kernel kernel : {Kernel::zhu_bridson, Kernel::blinn}) all.push_back({"droplets", 3, kernel});
  for (const RecoverMode recover : {RecoverMode::thesis, RecoverMode::off}) {
    all.push_back({"droplets", 3, Kernel::metaball, recover});
  }
  all.push_back({EMBRUN_DATA_DIR "/dam_break.bgeo", 3});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Scenes, Tracers, testing::ValuesIn(cases()), name_of_case);

// From inside, through the end of the main field into a recovered particle, out of which the ray comes where the main
// field has been under its threshold for long. Steps of the search from there led back to the end of the main field.
TEST(FastTracer, LeavesTheRecoveredFieldBehindTheMainOne) {
  OracleScene scene = make_scene("sheets", 3, 1);
  scene.settings.kernel = Kernel::zhu_bridson;
  const oracle::Surface surface =
      oracle_surface(scene, resolve_surface_model(scene.positions, scene.radii, scene.settings));
  TestRay test;
  test.side = Side::inside;
  test.ray.origin = {0x1.2cfb8ep-2f, 0x1.174b7ep-1f, -0x1.b7e9dp-7f};
  test.ray.direction = {0x1.3bd862p-1f, -0x1.4b48a2p-1f, 0x1.cadac4p-2f};
  test.ray.clearance = {0.00771301f, 0, 0};
  for (const Tracer& tracer : make_fast_tracers(scene.positions, scene.radii, scene.settings)) {
    SurfaceHit hit;
    ASSERT_TRUE(tracer.intersect(test.ray, test.side, hit));
    EXPECT_EQ(judge_rays(scene, surface, tracer.intersect, {test}).wrong_count(), 0u) << hit.t;
  }
}

/// Rays that the oracle found among 20,000 of a class, all of which hit; on every instruction set.
void expect_right(const OracleScene& scene, const std::vector<TestRay>& rays) {
  const oracle::Surface surface =
      oracle_surface(scene, resolve_surface_model(scene.positions, scene.radii, scene.settings));
  std::vector<Intersector> intersectors;
  const std::vector<Tracer> tracers = make_fast_tracers(scene.positions, scene.radii, scene.settings);
  for (const Tracer& tracer : tracers) intersectors.push_back(tracer.intersect);
  for (const OracleReport& report : judge_rays(scene, surface, intersectors, rays)) {
    EXPECT_EQ(report.wrong_count(), 0u) << report.summary();
    EXPECT_EQ(report.hits, rays.size());
  }
}

TestRay ray_from(Vec3 origin, Vec3 direction, Side side) {
  TestRay ray;
  ray.ray.origin = origin;
  ray.ray.direction = direction;
  ray.side = side;
  return ray;
}

TEST(Tracer, TellsTheOrderOfTwoFieldsThatCrossCloseTogether) {
  // Rays from within a lone particle into the fluid, which begins some hundredths of R0 before the particle ends, or
  // after: found by the oracle among 10^5.
  expect_right(make_scene(EMBRUN_DATA_DIR "/dam_break.bgeo", 3, 1),
               {ray_from({-0x1.2f1ac2p+0f, 0x1.25add4p+0f, -0x1.67296ep-1f},
                         {0x1.68f1ap-2f, -0x1.6aa428p-1f, -0x1.392756p-1f}, Side::inside),
                ray_from({-0x1.a63542p-2f, 0x1.54c3aep+0f, -0x1.ad13ap-1f},
                         {0x1.0bd73cp-2f, -0x1.c203e4p-2f, -0x1.b7fa74p-1f}, Side::inside),
                ray_from({-0x1.180e96p+1f, 0x1.9d9f78p-1f, -0x1.a1649cp-1f},
                         {0x1.0b5b72p-5f, -0x1.53567p-1f, -0x1.7f089ap-1f}, Side::inside)});
}

TEST(Tracer, PassesSmallParticlesOnItsWayToLargeOnes) {
  // In cells where radii differ by orders of magnitude the bounds of the small ones once made steps too short to arrive.
  expect_right(make_scene("log-uniform", 3, 1),
               {ray_from({-0x1.d5f1a2p+0f, 0x1.636262p+1f, 0x1.4c6b98p+2f},
                         {0x1.ff7912p-2f, -0x1.8581c6p-2f, -0x1.8e83c4p-1f}, Side::unknown),
                ray_from({0x1.1aa9fep-1f, 0x1.86c27cp+0f, 0x1.e3871cp+0f},
                         {-0x1.1fceaep-4f, -0x1.f78896p-1f, -0x1.55d904p-3f}, Side::unknown)});
}

TEST(Tracer, MeetsParticlesHundredsOfTheirRadiiAway) {
  // Small balls far along the ray, once lost to the rounding of a difference of squares (the third), or to bounds that
  // hold for a shorter part of the line than they were used on (the others).
  expect_right(make_scene("log-uniform", 3, 2),
               {ray_from({0x1.00086p+0f, 0x1.000c9cp+0f, 0x1.6ce35ap+2f},
                         {0x1.1dd43p-6f, 0x1.7288bap-4f, -0x1.fdd292p-1f}, Side::unknown),
                ray_from({0x1.be1996p+0f, 0x1.04987ep+1f, 0x1.19c11ep+1f},
                         {0x1.dbbe16p-3f, -0x1.2390acp-1f, -0x1.93b7c2p-1f}, Side::unknown),
                ray_from({0x1.85c102p-1f, 0x1.05f17cp-1f, 0x1.8a920cp-2f},
                         {-0x1.6e34dp-3f, 0x1.5b49p-1f, -0x1.6ce78cp-1f}, Side::unknown),
                ray_from({0x1.34c7c8p-2f, 0x1.95e28p+0f, 0x1.e83774p-1f},
                         {0x1.d9edf8p-3f, 0x1.613332p-1f, 0x1.5f3866p-1f}, Side::unknown),
                ray_from({0x1.c1bf66p-1f, 0x1.9ea7aep+0f, 0x1.55d38ep+0f},
                         {-0x1.013cc8p-1f, -0x1.3b61bap-3f, -0x1.b39c3ap-1f}, Side::outside)});
}

TEST(Tracer, TellsWhichOfTwoFieldsThatEndTogetherEndsLast) {
  // From inside, where the main field ends a few ten-thousandths of a cell from where the recovered one does.
  expect_right(make_scene("log-uniform", 2, 2),
               {ray_from({0x1.9cf32cp+0f, 0x1.1a3bd2p-2f, 0x1.5af692p+0f},
                         {0x1.2eaa72p-1f, -0x1.988a8ep-1f, -0x1.e2189p-4f}, Side::inside),
                ray_from({0x1.854424p-1f, 0x1.80ee8p-1f, 0x1.e94d1ap+0f}, {0.0f, 1.0f, 0.0f}, Side::inside),
                ray_from({0x1.c13f2ep-3f, 0x1.ae1194p+0f, 0x1.cf8348p-1f},
                         {0x1.cbf7bep-1f, -0x1.71412ap-3f, 0x1.9a2192p-2f}, Side::inside)});
}

TEST(Tracer, TakesOnlyTheSheetThatARayStartsOnForItsStart) {
  // From the surface of a lone particle into it, and out again after thousandths of a cell, before the fluid begins: so
  // close that the fluid's own surface could be where the ray starts, if it were not known to be the other.
  TestRay ray = ray_from({0x1.56ba88p+0f, 0x1.87a4f6p-4f, -0x1.ec0c22p-3f},
                         {-0x1.c1055ap-1f, 0x1.a31258p-3f, 0x1.bd2ffp-2f}, Side::inside);
  ray.ray.clearance = {2.42446e-06f, 1, 0};
  expect_right(make_scene(EMBRUN_DATA_DIR "/dam_break.bgeo", 3, 3), {ray});
}

TEST(Tracer, PlacesCreasesBetweenLoneParticles) {
  // Where the field hardly grows along the ray, so that the coordinates of the particles have to be fine.
  expect_right(make_scene("spray", 3, 2),
               {ray_from({0x1.edaa44p-3f, 0x1.ef491ap-1f, 0x1.3a286cp-1f}, {0.0f, 1.0f, 0.0f}, Side::unknown)});
}

TEST(FastTracer, PlacesHitsByTheListsAsItWouldByFloats) {
  // Radii that are said one by one, though equal, make lists of floats. Where the field hardly changes, t tells the
  // positions' errors many times over.
  const OracleScene scene = make_scene(EMBRUN_DATA_DIR "/dam_break.bgeo", 2, 1);
  const oracle::Surface surface =
      oracle_surface(scene, resolve_surface_model(scene.positions, scene.radii, scene.settings));
  const std::vector<float> radii(scene.positions.size(), scene.settings.radius);
  const std::vector<Tracer> packed = make_fast_tracers(scene.positions, {}, scene.settings);
  const std::vector<Tracer> wide = make_fast_tracers(scene.positions, radii, scene.settings);
  const double tolerance = 1e-3 * static_cast<double>(scene.settings.radius);  // the oracle's
  for (std::size_t i = 0; i < packed.size(); ++i) {
    int hits = 0, off = 0;
    double squares = 0;
    for (const RayClass ray_class : {RayClass::camera, RayClass::outside, RayClass::inside}) {
      for (const TestRay& r : make_rays(scene, surface, wide[i].intersect, ray_class, 4000, 5)) {
        SurfaceHit one, other;
        if (!packed[i].intersect(r.ray, r.side, one) || !wide[i].intersect(r.ray, r.side, other)) continue;
        const double d = std::abs(static_cast<double>(one.t) - static_cast<double>(other.t));
        ++hits;
        off += d > tolerance ? 1 : 0;
        squares += std::min(d, 1e-3) * std::min(d, 1e-3);
      }
    }
    EXPECT_GT(hits, 7000) << available_isas()[i];
    EXPECT_LT(off, hits / 500) << available_isas()[i];
    EXPECT_LT(std::sqrt(squares / hits), 0.1 * tolerance) << available_isas()[i];
  }
}

TEST(FastTracer, IsAsExactAtTheFarEndOfALongThread) {
  // More cells than 32 bits of lattice steps span; all numbers are exact in single precision.
  std::vector<Vec3> positions;
  for (int i = 0; i < 100000; ++i) positions.push_back({static_cast<float>(i) / 16.0f, 0.0f, 0.0f});
  SurfaceSettings settings;
  settings.radius = 1.0f / 32.0f;
  settings.order = 2;
  for (const Tracer& tracer : make_fast_tracers(positions, {}, settings)) {
    const auto depth_at = [&](float x) {
      Ray ray;
      ray.origin = {x, 1.0f, 0.0f};
      ray.direction = {0.0f, -1.0f, 0.0f};
      SurfaceHit hit;
      return tracer.intersect(ray, Side::outside, hit) ? hit.t : -1.0f;
    };
    const float near_depth = depth_at(100.0f / 16.0f);
    EXPECT_GT(near_depth, 0.9f);
    EXPECT_LT(near_depth, 1.0f);
    for (const float i : {5000.0f, 40000.0f, 77777.0f, 99900.0f})
      EXPECT_NEAR(depth_at(i / 16.0f), near_depth, 1e-6f) << i;
  }
}

TEST(FastTracer, NeedsLittleMemory) {
  // What is asked for of scenes of 110 thousand to 10 million particles.
  for (const int order : {2, 3}) {
    const OracleScene scene = make_scene(EMBRUN_DATA_DIR "/dam_break.bgeo", order, 1);
    const ImplicitSurface surface = build_implicit_surface(scene.positions, {}, scene.settings);
    EXPECT_LE(surface.stats().bytes, 150 * scene.positions.size());
  }
}

TEST(FastTracer, MissesNothingByTheBatch) {
  // The batch alone rules recovered particles out by their boxes. Spray: rays to it, and on from there.
  for (const int order : {1, 2, 3}) {
    const OracleScene scene = make_scene(EMBRUN_DATA_DIR "/dam_break.bgeo", order, 1);
    const ImplicitSurface surface = build_implicit_surface(scene.positions, {}, scene.settings);
    const std::string isa = available_isas().back();
    const TraceFunction trace = trace_function(isa);
    Dice dice(7);
    std::vector<TestRay> rays;
    std::vector<SurfaceHit> expected;
    std::vector<bool> met;
    const auto add = [&](const TestRay& ray) {
      rays.push_back(ray);
      met.push_back(trace(surface.view(), ray.ray, ray.side, expected.emplace_back()));
    };
    while (rays.size() < 100000) {
      TestRay ray;
      ray.ray.direction = dice.direction();
      ray.ray.origin =
          scene.positions[static_cast<std::size_t>(dice.next() * static_cast<double>(scene.positions.size()))] -
          2.0f * ray.ray.direction;
      ray.side = Side::unknown;
      add(ray);
      if (!met.back() || !expected.back().entering) continue;
      const Vec3 normal = expected.back().geometric_normal;
      ray.ray.origin = expected.back().position;
      ray.ray.direction = dice.direction();
      if (dot(ray.ray.direction, normal) < 0.0f) ray.ray.direction = -ray.ray.direction;
      ray.side = Side::outside;
      add(ray);
    }
    const std::unique_ptr<bool[]> found(new bool[rays.size()]);
    std::vector<SurfaceHit> hits(rays.size());
    trace_batch_function(isa)(surface.view(), rays.data(), static_cast<int>(rays.size()), hits.data(), found.get());
    std::size_t lone = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(found[i], met[i]) << "n = " << order << " ray " << i;
      if (!found[i]) continue;
      lone += expected[i].sheet == 1 ? 1 : 0;
      const float cosine = fabsf(dot(expected[i].geometric_normal, rays[i].ray.direction));
      ASSERT_LT(fabsf(expected[i].t - hits[i].t) * cosine, 1e-3f * scene.settings.radius)
          << "n = " << order << " ray " << i;
    }
    if (order > 1) {
      EXPECT_GT(lone, 3000u);
    }
  }
}

TEST(FastTracer, LeavesByTheSheetThatRoundingPutTheRayAcross) {
  // What else is in the fluid (a bubble) reflects rays that are inside of it as close to its surface as rounding tells: they
  // may start a little outside. A lone particle's ball is then left where the ray starts, not the smooth surface near by.
  const OracleScene scene = make_scene(EMBRUN_DATA_DIR "/dam_break.bgeo", 3, 1);
  const oracle::Surface surface =
      oracle_surface(scene, resolve_surface_model(scene.positions, scene.radii, scene.settings));
  const std::vector<Tracer> tracers = make_fast_tracers(scene.positions, scene.radii, scene.settings);
  const auto sample_at = [&](Vec3 p) { return surface.sample(to_oracle(p)); };
  Dice dice(5);
  int starts = 0;
  while (starts < 500) {
    const Vec3 target =
        scene.positions[static_cast<std::size_t>(dice.next() * static_cast<double>(scene.positions.size()))];
    Ray ray;
    ray.direction = dice.direction();
    ray.origin = target - 2.0f * ray.direction;
    SurfaceHit there;
    if (!tracers.back().intersect(ray, Side::unknown, there)) continue;
    ray.origin = there.position + 1e-6f * there.geometric_normal;
    ray.direction = dice.direction();
    const oracle::Sample sample = sample_at(ray.origin);
    const Vec3 outwards = normalize(Vec3{static_cast<float>(-sample.gradient.x), static_cast<float>(-sample.gradient.y),
                                         static_cast<float>(-sample.gradient.z)});
    if (there.sheet != 1 || !(sample.g < 0 && sample.g > -1e-3 && sample.other < sample.g - 0.01) ||
        dot(outwards, ray.direction) < 0.1f)
      continue;
    ++starts;
    for (const Tracer& tracer : tracers) {
      SurfaceHit hit;
      ASSERT_TRUE(tracer.intersect(ray, Side::inside, hit));
      EXPECT_LT(hit.t, 2e-5f);
      EXPECT_FALSE(hit.entering);
      EXPECT_GT(dot(hit.geometric_normal, outwards), 0.99f) << "the smaller field is at " << sample.other;
    }
  }
}

TEST(ThesisTracer, FindsTheFirstCrossingsThatItsStepsAllow) {
  // It samples at most R0/2 apart, so it may pass shallow penetrations: 2 in 100 here, none of them a camera ray's that
  // goes deep. The fast tracer is held to nothing.
  const OracleScene scene = make_scene("sheets", 3, 1);
  const oracle::Surface surface =
      oracle_surface(scene, resolve_surface_model(scene.positions, scene.radii, scene.settings));
  const Tracer tracer = make_tracer("thesis", "", scene.positions, scene.radii, scene.settings);
  for (const RayClass ray_class : {RayClass::camera, RayClass::outside, RayClass::inside}) {
    const OracleReport report =
        judge_rays(scene, surface, tracer.intersect, make_rays(scene, surface, tracer.intersect, ray_class, 300, 1));
    EXPECT_LE(report.wrong_count(), report.rays / 50) << name_of(ray_class) << ": " << report.summary();
    EXPECT_GT(report.hits, 50u);
  }
}

}  // namespace
}  // namespace embrun::test
