// Random walks through nests of media: what the crossings say against inside tests by brute force.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "backend/cpu/cpu_backend.h"
#include "integrators/path_stages.h"
#include "io/read_particles.h"
#include "particles/neighbour_grid.h"
#include "render/transport.h"
#include "scene/compile.h"
#include "scene/tank.h"

namespace embrun {
namespace {

using namespace testing_support;

/// Which balls hold a point, in double precision.
class BallOracle {
 public:
  BallOracle(const BallsDescription& set, Vec3d recentring)
      : balls_(set.balls), positions_(centers(set, recentring)), grid_(positions_, largest(set)) {}

  int count(Vec3d p) const {
    int count = 0;
    each_near(p, [&](double gap) { count += gap < 0; });
    return count;
  }
  /// Distance to the nearest ball's surface (of those within a radius).
  double gap(Vec3d p) const {
    double least = 1;
    each_near(p, [&](double gap) { least = std::min(least, std::abs(gap)); });
    return least;
  }

 private:
  std::vector<BallDescription> balls_;
  std::vector<Vec3d> positions_;
  NeighbourGrid grid_;

  static std::vector<Vec3d> centers(const BallsDescription& set, Vec3d recentring) {
    std::vector<Vec3d> list;
    for (const BallDescription& ball : set.balls) list.push_back(to_double(to_float(ball.center - recentring)));
    return list;
  }
  static double largest(const BallsDescription& set) {
    double radius = 0;
    for (const BallDescription& ball : set.balls) radius = std::max(radius, ball.radius);
    return 2 * radius;
  }
  template <class Visit>
  void each_near(Vec3d p, const Visit& visit) const {
    grid_.for_each_within(p, grid_.cell_size(), [&](std::size_t i, Vec3d center, double) {
      visit(length(p - center) - static_cast<double>(static_cast<float>(balls_[i].radius)));
    });
  }
};

/// A tank of glass on its own, with water in it that holds bubbles and sand.
struct Nest {
  SceneDescription scene;
  Box3d tank;
  double glass = 0;  ///< thickness of the walls

  /// Class of the medium of the tank's walls at a point; 0 outside them.
  bool in_glass(Vec3d p) const {
    const Vec3d wall{glass, glass, glass};
    const auto within = [](Vec3d q, Vec3d low, Vec3d high) {
      return q.x > low.x && q.y > low.y && q.z > low.z && q.x < high.x && q.y < high.y && q.z < high.z;
    };
    const Vec3d top{tank.high.x + glass, tank.high.y, tank.high.z + glass};
    return within(p, tank.low - wall, top) && !within(p, tank.low, {tank.high.x, tank.high.y + 1, tank.high.z});
  }
  double gap_to_glass(Vec3d p) const {
    double gap = 1;
    const double faces[3][4] = {
        {tank.low.x, tank.low.x - glass, tank.high.x, tank.high.x + glass},
        {tank.low.y, tank.low.y - glass, tank.high.y, tank.high.y},
        {tank.low.z, tank.low.z - glass, tank.high.z, tank.high.z + glass},
    };
    for (int axis = 0; axis < 3; ++axis)
      for (const double face : faces[axis])
        gap = std::min(gap, std::abs((axis == 0 ? p.x : axis == 1 ? p.y : p.z) - face));
    return gap;
  }
};

constexpr double water_ior = 1.33;

Nest make_nest(std::vector<Vec3d> water, double radius, const Box3d& tank, std::vector<BallDescription> bubbles,
               std::vector<BallDescription> sand) {
  Nest nest;
  nest.tank = tank;
  nest.glass = 0.03;
  nest.scene = scene_seen({0, 1, 9}, {0, 0.5, 0}, 40, 4, 1);
  FluidDescription fluid;
  fluid.positions = std::move(water);
  fluid.surface.radius = static_cast<float>(radius);
  fluid.surface.spacing = 1.86 * radius;
  fluid.surface.order = 3;
  fluid.container = tank;
  press_into_walls(fluid, nest.glass);
  nest.scene.fluids.push_back(fluid);
  nest.scene.balls.push_back(balls(std::move(bubbles), dielectric_material(1, {}, 2)));
  nest.scene.balls.push_back(balls(std::move(sand), diffuse_material({0.5f, 0.4f, 0.2f})));
  nest.scene.meshes.push_back(make_tank(tank, nest.glass, UpAxis::y, dielectric_material(1.5, {}, 3)));
  return nest;
}

struct WalkCounts {
  long crossings = 0, contradictions = 0;
  long checked = 0, wrong = 0, wrong_water = 0;
  long in_bubble = 0, in_glass = 0, in_water = 0, in_air = 0, most_over = 0;
};

/// Paths that cross or are thrown back at every boundary by chance, and never end inside what is opaque.
WalkCounts walk(const Nest& nest, int walks, int steps) {
  const FlatScene flat = compile(nest.scene);
  const CpuBackend backend(flat);
  const BallOracle bubbles(nest.scene.balls[0], flat.recentring);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto direction = [&] {
    for (;;) {
      const Vec3d v{uniform(random), uniform(random), uniform(random)};
      if (length(v) > 0.1 && length(v) < 1) return normalize(to_float(v));
    }
  };
  const Vec3d middle = 0.5 * (nest.tank.low + nest.tank.high), half = 0.5 * (nest.tank.high - nest.tank.low);
  WalkCounts counts;
  for (int w = 0; w < walks; ++w) {
    Ray ray;
    const Vec3d start{1.05 * half.x * uniform(random), 1.05 * half.y * uniform(random),
                      1.05 * half.z * uniform(random)};
    const auto& cloud = nest.scene.balls[0].balls;
    // Every other walk starts among the bubbles.
    const Vec3d from = w % 2 == 0 ? middle + start : cloud[static_cast<std::size_t>(w) * 7919 % cloud.size()].center;
    ray.origin = to_float(from - flat.recentring);
    ray.direction = direction();
    MediaState media = backend.kernels().media_at(backend.view(), ray.origin, 0.0f);
    for (int s = 0; s < steps; ++s) {
      SceneHit hit;
      bool found;
      backend.kernels().intersect(backend.view(), &ray, &media, 1, &found, &hit);
      if (!found) {
        counts.contradictions += media.counts != 0;
        break;
      }
      ++counts.crossings;

      // Somewhere on the way: what is there?
      const double t = static_cast<double>(ray.t_min) +
                       (0.5 + 0.49 * uniform(random)) * static_cast<double>(hit.surface.t - ray.t_min);
      const Vec3d p = to_double(ray.origin) + t * to_double(ray.direction);
      const double clear = 2e-5 * (1 + t);
      if (bubbles.gap(p) > clear && nest.gap_to_glass(p + flat.recentring) > clear) {
        ++counts.checked;
        const int over = bubbles.count(p);
        const bool glass = nest.in_glass(p + flat.recentring);
        counts.wrong += (media.count(2) > 0) != (over > 0) || (media.count(3) > 0) != glass;
        counts.most_over = std::max<long>(counts.most_over, over);
        const int current = media.current();
        ++(current == 3   ? counts.in_glass
           : current == 2 ? counts.in_bubble
           : current == 1 ? counts.in_water
                          : counts.in_air);
        // The field decides at points; its crossings are found to 2e-4 of a radius, so thin films may differ.
        counts.wrong_water +=
            media.inside_fluid(0) != backend.kernels().media_at(backend.view(), to_float(p), 0.0f).inside_fluid(0);
      }

      const MediaBoundary boundary = boundary_of(hit);
      MediaState behind = media;
      if (boundary.media_class != 0) {
        if (contradicts(media, boundary)) {
          ++counts.contradictions;
          break;
        }
        behind = cross_boundary(media, boundary);
      }
      // Straight on as through matched boundaries, off in a new direction on either side as scattering does.
      const double choice = uniform(random);
      if (hit.media_class != 0 && choice < 0) {
        media = behind;
        if (choice < -0.5) {
          ray.t_min = hit.surface.t;
          continue;
        }
      }
      Vec3 next = direction();
      const bool onwards = hit.media_class != 0 && choice < 0;
      const float side =
          dot(ray.direction, hit.surface.geometric_normal) < 0.0f ? 1.0f : -1.0f;  // of where it came from
      if ((dot(next, hit.surface.geometric_normal) * side > 0.0f) == onwards) next = -next;
      ray.origin = leave_surface(hit, next);
      ray.direction = next;
      ray.t_min = 0;
      ray.clearance = hit.fluid >= 0 ? clearance_after(hit.surface, next, hit.fluid) : Clearance{};
    }
  }
  return counts;
}

void expect_consistent(const WalkCounts& counts) {
  testing::Test::RecordProperty("crossings", std::to_string(counts.crossings));
  EXPECT_EQ(counts.contradictions, 0) << "in " << counts.crossings << " crossings";
  EXPECT_EQ(counts.wrong, 0) << "of " << counts.checked;
  EXPECT_LE(counts.wrong_water, counts.checked / 2000);
  for (const long visited : {counts.in_air, counts.in_water, counts.in_bubble, counts.in_glass})
    EXPECT_GT(visited, counts.checked / 100) << "of " << counts.checked;
}

// Bubbles of all sizes, many of them reaching into the glass and out of the water, dense enough for 80 over a point.
TEST(MediaWalk, NestsOfRandomBubbles) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Box3d tank{{-0.5, 0, -0.5}, {0.5, 1, 0.5}};
  std::vector<Vec3d> water;
  for (double x = -0.46; x < 0.48; x += 0.04)
    for (double y = 0.04; y < 0.5; y += 0.04)
      for (double z = -0.46; z < 0.48; z += 0.04)
        water.push_back({x + 0.006 * uniform(random), y + 0.006 * uniform(random), z + 0.006 * uniform(random)});
  std::vector<BallDescription> bubbles, sand;
  for (int i = 0; i < 3000; ++i) {
    // Half of them in a cloud, half all over.
    const double spread = i % 2 == 0 ? 0.05 : 0.6;
    const Vec3d p{spread * uniform(random), 0.3 + spread * uniform(random), spread * uniform(random)};
    bubbles.push_back({p, 0.005 + 0.04 * std::abs(uniform(random))});
    if (i % 100 == 0) bubbles.push_back(bubbles.back());
  }
  for (int i = 0; i < 500; ++i)
    sand.push_back({{0.5 * uniform(random), 0.03 * uniform(random), 0.5 * uniform(random)}, 0.02});
  const WalkCounts counts = walk(make_nest(water, 0.0215, tank, bubbles, sand), 10000, 200);
  expect_consistent(counts);
  EXPECT_GT(counts.most_over, 60);
}

// A real dam break with its bubbles, as large as its particles: up to 85 lie over one point.
TEST(MediaWalk, TheDamBreakWithItsBubbles) {
  const std::string folder = EMBRUN_DATA_DIR;
  const ParticleSet water = read_particles(folder + "/dam_break.bgeo");
  const ParticleSet bubbles = read_particles(folder + "/dam_break_bubbles.bgeo");
  std::vector<BallDescription> balls, sand;
  for (const Vec3d& p : bubbles.positions) balls.push_back({p, 0.025});
  for (std::size_t i = 0; i < water.positions.size(); ++i)
    if (water.positions[i].y < 0.02 && i % 3 == 0) sand.push_back({water.positions[i] - Vec3d{0, 0.03, 0}, 0.02});
  const Box3d tank{{-2.25, -0.05, -1.5}, {2.25, 1.95, 1.5}};
  const WalkCounts counts = walk(make_nest(water.positions, 0.025, tank, balls, sand), 10000, 200);
  expect_consistent(counts);
  EXPECT_GT(counts.most_over, 60);
}

}  // namespace
}  // namespace embrun
