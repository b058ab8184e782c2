// Sets of balls against spans merged in double precision.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "backend/cpu/cpu_backend.h"
#include "geometry/ball_set.h"
#include "render/transport.h"
#include "scene/compile.h"

namespace embrun {
namespace {

using namespace testing_support;

struct Interval {
  double enter, exit;
};

/// What a line does with balls, in double precision.
class LineOracle {
 public:
  LineOracle(const std::vector<BallDescription>& balls, Vec3d origin, Vec3d direction) {
    for (const BallDescription& ball : balls) {
      const Vec3d to_center = ball.center - origin;
      const double middle = dot(to_center, direction);
      const Vec3d across = to_center - middle * direction;
      const double squared = ball.radius * ball.radius - dot(across, across);
      if (squared <= 0) continue;
      spans_.push_back({middle - std::sqrt(squared), middle + std::sqrt(squared)});
    }
    std::sort(spans_.begin(), spans_.end(), [](Interval a, Interval b) { return a.enter < b.enter; });
    for (const Interval& span : spans_) {
      if (!merged_.empty() && span.enter <= merged_.back().exit)
        merged_.back().exit = std::max(merged_.back().exit, span.exit);
      else
        merged_.push_back(span);
    }
  }

  /// The first end of a merged span after t = 0, or of any ball's (shells); infinite: none.
  double first_crossing(bool shells) const {
    double first = HUGE_VAL;
    for (const Interval& span : shells ? spans_ : merged_)
      for (const double t : {span.enter, span.exit})
        if (t > 0) first = std::min(first, t);
    return first;
  }
  bool inside() const {
    return std::any_of(merged_.begin(), merged_.end(), [](Interval s) { return s.enter < 0 && s.exit > 0; });
  }
  /// Something so thin along the line that single precision need not see it as double does: a chord, an overlap, or a gap.
  bool thin(double eps) const {
    for (std::size_t i = 0; i < spans_.size(); ++i) {
      if (spans_[i].exit - spans_[i].enter < 30 * eps || std::abs(spans_[i].enter) < eps ||
          std::abs(spans_[i].exit) < eps)
        return true;
    }
    for (std::size_t i = 1; i < merged_.size(); ++i)
      if (merged_[i].enter - merged_[i - 1].exit < eps) return true;
    double end = -HUGE_VAL;
    for (const Interval& span : spans_) {  // overlaps that barely join
      if (span.enter <= end && end - span.enter < eps && span.exit > end) return true;
      end = std::max(end, span.exit);
    }
    return false;
  }

 private:
  std::vector<Interval> spans_, merged_;
};

struct BallCase {
  const char* name;
  int count;
  double radius;  ///< of the largest; the smallest is a tenth if `mixed`
  bool mixed;
  Vec3d middle;
};

void PrintTo(const BallCase& c, std::ostream* out) { *out << c.name; }

class BallSets : public testing::TestWithParam<BallCase> {
 protected:
  std::mt19937 random{3};

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
  Vec3d in_cube(double half) { return {uniform(-half, half), uniform(-half, half), uniform(-half, half)}; }
  Vec3d direction() {
    for (;;) {
      const Vec3d v = in_cube(1);
      if (length(v) > 0.1 && length(v) < 1) return normalize(v);
    }
  }

  BallsDescription make_balls(const MaterialDescription& material) {
    const BallCase& c = GetParam();
    BallsDescription set;
    set.material = material;
    for (int i = 0; i < c.count; ++i) {
      // As the compiled scene has them, so that both sides see the same balls.
      const Vec3 center = to_float(in_cube(1));
      const auto radius = static_cast<float>(c.mixed ? c.radius * uniform(0.1, 1) : c.radius);
      set.balls.push_back({c.middle + to_double(center), static_cast<double>(radius)});
    }
    // Some at the same place, and the corners that fix the middle of the scene.
    for (int i = 0; i < c.count / 50; ++i) set.balls.push_back(set.balls[static_cast<std::size_t>(i)]);
    for (const double s : {-1.0, 1.0}) set.balls.push_back({c.middle + s * Vec3d{4, 4, 4}, 0.25});
    return set;
  }

  /// Rays from within the set, from its surfaces, and from far away.
  std::vector<Ray> make_rays(const std::vector<BallDescription>& balls, Vec3d middle) {
    std::vector<Ray> rays(6000);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      Vec3d origin = in_cube(1.2), d = direction();
      if (i % 4 == 1) {  // off a ball's surface, to either side
        const BallDescription& ball = balls[i * 7919 % balls.size()];
        const Vec3d n = direction();
        origin = ball.center - middle + (ball.radius + (i % 8 < 4 ? 1e-4 : -1e-4)) * n;
      }
      if (i % 4 == 2) {  // towards it
        origin = uniform(5, 50) * direction();
        d = normalize(in_cube(1) - origin);
      }
      rays[i].origin = to_float(origin);
      rays[i].direction = normalize(to_float(d));
    }
    return rays;
  }
};

TEST_P(BallSets, AreMetAsInDoublePrecision) {
  for (const bool solid : {true, false}) {
    SceneDescription scene = scene_seen(GetParam().middle + Vec3d{0, 0, 9}, GetParam().middle, 40, 4, 1);
    scene.balls.push_back(make_balls(solid ? dielectric_material(1.33) : diffuse_material(grey(0.5f))));
    const FlatScene flat = compile(scene);
    std::vector<BallDescription> local = scene.balls[0].balls;
    for (BallDescription& ball : local) ball.center = ball.center - flat.recentring;
    const std::vector<Ray> rays = make_rays(local, {0, 0, 0});
    const BallSet simple{flat.ball_blocks.data(), static_cast<std::uint32_t>(flat.ball_blocks.size()),
                         flat.ball_ranges[0].slack, solid};

    std::vector<InstructionSet> sets;
    for (const InstructionSet s : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512})
      if (s <= instruction_set()) sets.push_back(s);
    std::vector<std::unique_ptr<CpuBackend>> backends;
    for (const InstructionSet s : sets) backends.push_back(std::make_unique<CpuBackend>(flat, kernels_of(s)));

    int met = 0, skipped = 0, inside = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const LineOracle line(local, to_double(rays[i].origin), normalize(to_double(rays[i].direction)));
      if (line.thin(1e-5 * (1 + static_cast<double>(length(rays[i].origin))))) {
        ++skipped;
        continue;
      }
      const double expected = line.first_crossing(!solid);
      met += expected < HUGE_VAL;
      inside += line.inside();
      const double tolerance = expected < HUGE_VAL ? 2e-4 * (1 + expected * 0.1) : 0;
      for (const auto& backend : backends) {
        const MediaState media = backend->kernels().media_at(backend->view(), rays[i].origin, 0.0f);
        if (solid) {
          ASSERT_EQ(media.inside_solid(0), line.inside()) << i;
        }
        bool found;
        SceneHit hit;
        backend->kernels().intersect(backend->view(), &rays[i], &media, 1, &found, &hit);
        ASSERT_EQ(found, expected < HUGE_VAL) << backend->kernels().name << " ray " << i << ", " << expected;
        if (!found) continue;
        ASSERT_NEAR(hit.surface.t, expected, tolerance) << backend->kernels().name << " ray " << i;
        if (solid) {
          ASSERT_EQ(hit.surface.entering, !line.inside()) << i;
        }
        ASSERT_EQ(hit.surface.entering, dot(hit.surface.geometric_normal, rays[i].direction) < 0) << i;
      }
      // The way without a tree, which takes its time.
      if (GetParam().count > 10000 && i % 10 != 0) continue;
      SurfaceHit hit;
      const bool found = intersect_each_ball(simple, rays[i], solid && line.inside(), hit);
      ASSERT_EQ(found, expected < HUGE_VAL) << i;
      if (found) {
        ASSERT_NEAR(hit.t, expected, tolerance) << i;
      }
    }
    EXPECT_GT(met, 2000);
    EXPECT_GT(inside, 300);
    EXPECT_LT(skipped, 2400);
  }
}

constexpr BallCase ball_cases[] = {
    {"sparse", 300, 0.15, false, {0, 0, 0}}, {"touching", 3000, 0.1, false, {0, 0, 0}},
    {"mixed", 2000, 0.2, true, {0, 0, 0}},   {"dense", 400, 0.75, false, {0, 0, 0}},  // some 85 over a point
    {"small", 20000, 0.03, true, {0, 0, 0}}, {"far_from_the_origin", 3000, 0.1, true, {1e6, -1e6, 5e5}},
};

INSTANTIATE_TEST_SUITE_P(Cases, BallSets, testing::ValuesIn(ball_cases),
                         [](const auto& c) { return std::string(c.param.name); });

// More balls over one place than a media state can count are still one solid.
TEST(BallSets, ManyCoincidentBallsAreOne) {
  SceneDescription scene = scene_seen({0, 0, 5}, {0, 0, 0}, 40, 4, 1);
  scene.balls.push_back(balls(std::vector<BallDescription>(1000, {{0, 0, 0}, 1}), dielectric_material(1.33)));
  scene.balls[0].balls.push_back({{0.5, 0, 0}, 0});
  const FlatScene flat = compile(scene);
  const CpuBackend backend(flat);
  Ray ray;
  ray.origin = {0.1f, 0.2f, 3};
  ray.direction = {0, 0, -1};
  MediaState media;
  const double half = std::sqrt(1 - 0.01 - 0.04);
  for (const double t : {3 - half, 3 + half}) {
    bool found;
    SceneHit hit;
    backend.kernels().intersect(backend.view(), &ray, &media, 1, &found, &hit);
    ASSERT_TRUE(found);
    EXPECT_NEAR(hit.surface.t, t, 1e-6);
    media = cross_boundary(media, {hit.media_class, hit.solid, hit.surface.entering});
    ray.t_min = hit.surface.t;
  }
  EXPECT_EQ(media, MediaState{});
}

}  // namespace
}  // namespace embrun
