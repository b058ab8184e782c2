// Moving least squares surfaces: against an oracle that looks at every point in double precision everywhere along the ray, and
// against what calculus says of planes, spheres and borders.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <random>
#include <vector>

#include "geometry/mls_oracle.h"
#include "geometry/mls_surface.h"
#include "geometry/splat_clouds.h"

namespace embrun {
namespace {

namespace oracle = mls_oracle;
using oracle::operator-;

oracle::V v_of(Vec3 a) { return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)}; }

/// A cloud as rays meet it.
struct Cloud {
  std::vector<Splat> points;  ///< radius: the support
  SplatTree tree;
  SplatSet set;

  Cloud(std::vector<Splat> all, bool closed) : points(std::move(all)), tree(build_ball_tree(points)) {
    set = set_of(tree, closed);
  }
  bool meet(const Ray& ray, SurfaceHit& hit, bool inside = false, const SplatStart& start = {}) const {
    return intersect_mls(set, tree.view(), ray, inside, start, hit);
  }
};

std::vector<Splat> sphere_points(int steps, float support) {
  std::vector<Splat> points;
  for (const Vec3& p : icosphere(steps)) points.push_back(disc(p, p, support));
  return points;
}

/// A body that bulges and has hollows, r(p) = 1 + 0.25 sin(3 x) sin(4 y) + 0.15 cos(5 z) of the directions p, with exact
/// normals: the gradient of |x| - r(x / |x|).
std::vector<Splat> bumpy_points(int steps, float support) {
  const auto radius = [](Vec3 p) {
    return 1 + 0.25f * std::sin(3 * p.x) * std::sin(4 * p.y) + 0.15f * std::cos(5 * p.z);
  };
  std::vector<Splat> points;
  for (const Vec3& p : icosphere(steps)) {
    const Vec3 slope{0.75f * std::cos(3 * p.x) * std::sin(4 * p.y), std::sin(3 * p.x) * std::cos(4 * p.y),
                     -0.75f * std::sin(5 * p.z)};
    const Vec3 along = slope - dot(slope, p) * p;
    points.push_back(disc(radius(p) * p, p - along / radius(p), support));
  }
  return points;
}

/// Compares rays with the oracle. Those that rounding decides are left out, and must be few.
void expect_as_oracle(const Cloud& cloud, bool inside, const std::vector<Ray>& rays, double most_left_out,
                      std::size_t least_hits) {
  std::vector<oracle::Point> points;
  for (const Splat& p : cloud.points) points.push_back({v_of(p.center), v_of(p.normal), static_cast<double>(p.radius)});
  oracle::Rules rules;
  rules.reach = cloud.set.closed ? 0.5 : 0.4;
  const int sides = !cloud.set.closed ? 0 : inside ? -1 : 1;
  std::size_t left_out = 0, hits = 0;
  double worst = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const oracle::Search search(points, v_of(rays[i].origin), v_of(rays[i].direction), rules);
    const oracle::Answer expected = search.run(static_cast<double>(rays[i].t_min), sides);
    if (expected.margin < 2e-3) {
      ++left_out;
      continue;
    }
    SurfaceHit hit;
    ASSERT_EQ(cloud.meet(rays[i], hit, inside), expected.found)
        << "ray " << i << " t " << expected.t << " margin " << expected.margin;
    if (!expected.found) continue;
    ++hits;
    worst = std::max(worst, std::abs(static_cast<double>(hit.t) - expected.t));
    EXPECT_NEAR(static_cast<double>(hit.t), expected.t, 2e-4) << "ray " << i;
    EXPECT_EQ(hit.entering, expected.entering) << "ray " << i;
    EXPECT_LT(oracle::norm(v_of(hit.shading_normal) - expected.normal), 2e-3) << "ray " << i;
    EXPECT_LT(oracle::norm(v_of(hit.geometric_normal) - expected.gradient), 4e-3) << "ray " << i;
  }
  std::printf("%zu rays: %zu hits, %zu left out, t off by at most %.1e\n", rays.size(), hits, left_out, worst);
  EXPECT_GE(hits, least_hits);
  EXPECT_LE(static_cast<double>(left_out), most_left_out * static_cast<double>(rays.size()));
}

/// Rays that pass a unit sphere within 2 % of its radius: they graze it.
std::vector<Ray> grazing_rays(std::size_t count, float radius, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<Ray> rays(count);
  for (Ray& ray : rays) {
    Vec3 p{unit(random), unit(random), unit(random)};
    while (length(p) > 1 || length(p) < 0.1f) p = {unit(random), unit(random), unit(random)};
    const Frame frame(normalize(p));
    const float turn = 3.14159f * unit(random);
    ray.direction = std::cos(turn) * frame.s + std::sin(turn) * frame.t;
    ray.origin = (radius * (1 + 0.02f * unit(random))) * frame.n - 3 * ray.direction;
  }
  return rays;
}

TEST(MlsSurface, ASphereAsTheOracle) {
  const Cloud cloud(sphere_points(3, 0.44f), true);
  expect_as_oracle(cloud, false, rays_at({{-1, -1, -1}, {1, 1, 1}}, 300, 3), 0.02, 150);
  std::vector<Ray> inner = rays_at({{-1, -1, -1}, {1, 1, 1}}, 150, 4);
  for (Ray& ray : inner) ray.origin = 0.15f * ray.origin;
  expect_as_oracle(cloud, true, inner, 0.02, 150);
}

TEST(MlsSurface, GrazingRaysAsTheOracle) {
  // The surface is about 5/72 h^2 within the sphere.
  const Cloud cloud(sphere_points(3, 0.44f), true);
  expect_as_oracle(cloud, false, grazing_rays(300, 1 - 5.0f / 72 * 0.44f * 0.44f, 5), 0.15, 80);
}

TEST(MlsSurface, ABumpyBodyOfUnevenSupportsAsTheOracle) {
  for (const bool closed : {true, false}) {
    std::vector<Splat> points = bumpy_points(3, 0.4f);
    std::mt19937 random(6);
    std::uniform_real_distribution<float> unit(0, 1);
    for (Splat& p : points) p.radius *= 0.8f + unit(random);
    expect_as_oracle(Cloud(points, closed), false, rays_at({{-1.2f, -1.2f, -1.2f}, {1.2f, 1.2f, 1.2f}}, 300, 7), 0.05,
                     100);
  }
}

TEST(MlsSurface, PointsWithoutAnySenseAsTheOracle) {
  // Normals anywhere, supports that differ by a factor of ten: zeros wherever the ray looks.
  std::mt19937 random(8);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<Splat> points;
  for (int i = 0; i < 400; ++i) {
    const Vec3 c{unit(random), unit(random), unit(random)}, n{unit(random), unit(random), unit(random) + 1e-3f};
    points.push_back(disc(c, n, 0.06f * std::pow(10.0f, 0.5f + 0.5f * unit(random))));
  }
  expect_as_oracle(Cloud(points, false), false, rays_at({{-1, -1, -1}, {1, 1, 1}}, 300, 9), 0.35, 100);
}

TEST(MlsSurface, FarMorePointsInOnePlaceThanFitAsTheOracle) {
  // Of 2,562 points 0.8^2 / 4 are felt where the surface is: more than are kept at a time.
  expect_as_oracle(Cloud(sphere_points(4, 0.8f), true), false, rays_at({{-1, -1, -1}, {1, 1, 1}}, 40, 10), 0.1, 20);
}

TEST(MlsSurface, APlaneIsExact) {
  // Points of a plane in no order: a(x) is in it, n(x) its normal, whatever the weights.
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(-1, 1);
  const Frame plane(normalize(Vec3{1, 2, 3}));
  std::vector<Splat> points;
  for (int i = 0; i < 4000; ++i)
    points.push_back(disc(unit(random) * plane.s + unit(random) * plane.t, plane.n, 0.15f));
  const Cloud cloud(points, false);
  int hits = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 target = 0.8f * unit(random) * plane.s + 0.8f * unit(random) * plane.t;
    Ray ray;
    ray.direction = normalize(Vec3{unit(random), unit(random), unit(random)});
    ray.origin = target - 2.0f * ray.direction;
    SurfaceHit hit;
    // Rays in the plane have no meeting with it.
    if (std::fabs(dot(ray.direction, plane.n)) < 0.05f) continue;
    ASSERT_TRUE(cloud.meet(ray, hit)) << i;
    ++hits;
    EXPECT_NEAR(dot(hit.position, plane.n), 0, 1e-6f);
    EXPECT_LT(length(hit.position - target), 1e-4f);
    EXPECT_LT(length(hit.geometric_normal - plane.n), 1e-3f);
    EXPECT_LT(length(hit.shading_normal - plane.n), 1e-5f);
    EXPECT_EQ(hit.entering, dot(ray.direction, plane.n) < 0);
  }
  EXPECT_GT(hits, 900);
}

TEST(MlsSurface, ASphereIsOffByTheSquareOfTheSupport) {
  // Over a sphere of radius R the mean of points within h lies below x, by <r^2> / (2 R) to second order, and f = 0 where x is
  // that mean. <r^2> = int phi(r / h) r^3 dr / int phi(r / h) r dr = h^2 (5/504) / (1/14) = 5/36 h^2: R - 5/72 h^2 / R. By
  // symmetry the normals are those of the sphere but for the unevenness of the sampling.
  for (const int steps : {3, 4, 5}) {
    const float h = 0.22f * std::pow(2.0f, 4.0f - static_cast<float>(steps));
    const Cloud cloud(sphere_points(steps, h), true);
    double shrunk = 0, least = 1, most = -1, normal_error = 0, gradient_error = 0;
    int hits = 0;
    for (const Ray& ray : rays_at({{-1, -1, -1}, {1, 1, 1}}, 2000, 12)) {
      SurfaceHit hit;
      if (!cloud.meet(ray, hit)) continue;
      ++hits;
      const double below = (1 - static_cast<double>(length(hit.position))) / static_cast<double>(h * h);
      shrunk += below;
      least = std::min(least, below);
      most = std::max(most, below);
      normal_error += static_cast<double>(length(hit.shading_normal - normalize(hit.position)));
      gradient_error += static_cast<double>(length(hit.geometric_normal - normalize(hit.position)));
    }
    ASSERT_GT(hits, 800);
    std::printf("h %.3f: %.5f h^2 within the sphere (%.5f to %.5f), normals off by %.4f, gradients by %.4f degrees\n",
                static_cast<double>(h), shrunk / hits, least, most, normal_error / hits * 180 / M_PI,
                gradient_error / hits * 180 / M_PI);
    // What follows is of fourth order: a share of h^2.
    EXPECT_NEAR(shrunk / hits, 5.0 / 72, 5.0 / 72 * (0.1 * static_cast<double>(h * h) + 0.004));
    EXPECT_GT(least, 0.93 * 5 / 72);
    EXPECT_LT(most, 1.1 * 5 / 72);
    EXPECT_LT(normal_error / hits, 0.012 * static_cast<double>(h));
    EXPECT_LT(gradient_error / hits, 0.012 * static_cast<double>(h));
  }
}

TEST(MlsSurface, EvensOutNoise) {
  // A sphere whose points are off by 1 % and normals by 10 degrees, both at random: about 30 points count where each weighs
  // less than one, so that the surface is several times as smooth as the splats.
  std::mt19937 random(13);
  std::normal_distribution<float> noise(0, 1);
  std::vector<Splat> discs;
  for (const Vec3& p : icosphere(4)) {
    const Frame frame(p);
    const Vec3 normal = p + 0.1234f * (noise(random) * frame.s + noise(random) * frame.t);
    discs.push_back(disc(p * (1 + 0.01f * noise(random)), normal, 0.055f));
  }
  std::vector<Splat> points = discs;
  for (Splat& p : points) p.radius *= 4;
  const Cloud cloud(points, true);
  const SplatTree tree = build_splat_tree(discs);
  const SplatSet set = set_of(tree, true);
  double mls[2] = {}, splats[2] = {};  // squares of what normals and radii are off by
  int hits = 0;
  const double radius = 1 - 5.0 / 72 * 0.22 * 0.22;
  for (const Ray& ray : rays_at({{-1, -1, -1}, {1, 1, 1}}, 3000, 14)) {
    SurfaceHit a, b;
    if (!cloud.meet(ray, a) || !intersect_splats(set, tree.view(), ray, false, {}, b)) continue;
    ++hits;
    mls[0] += static_cast<double>(length_squared(a.shading_normal - normalize(a.position)));
    splats[0] += static_cast<double>(length_squared(b.shading_normal - normalize(b.position)));
    mls[1] += std::pow(static_cast<double>(length(a.position)) - radius, 2);
    splats[1] += std::pow(static_cast<double>(length(b.position)) - 1, 2);
  }
  std::printf("noise of normals: mls %.4f, splats %.4f; of positions %.5f and %.5f\n", std::sqrt(mls[0] / hits),
              std::sqrt(splats[0] / hits), std::sqrt(mls[1] / hits), std::sqrt(splats[1] / hits));
  EXPECT_GT(hits, 1000);
  EXPECT_LT(std::sqrt(mls[0]), 0.5 * std::sqrt(splats[0]));
  EXPECT_LT(std::sqrt(mls[1]), 0.4 * std::sqrt(splats[1]));
}

TEST(MlsSurface, NothingPassesThroughAClosedBody) {
  const Cloud cloud(bumpy_points(4, 0.25f), true);
  std::mt19937 random(15);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto direction = [&] {
    Vec3 d{unit(random), unit(random), unit(random)};
    while (length(d) > 1 || length(d) < 0.1f) d = {unit(random), unit(random), unit(random)};
    return normalize(d);
  };
  for (int i = 0; i < 10000; ++i) {
    // The ball of radius 0.5 is inside the body, that of radius 2 holds it.
    Ray ray;
    ray.origin = 0.5f * direction();
    ray.direction = direction();
    SurfaceHit out;
    ASSERT_TRUE(cloud.meet(ray, out, true)) << i;
    ASSERT_FALSE(out.entering);
    ASSERT_LT(out.t, 2.0f);
    Ray back;
    back.origin = 2.5f * direction();
    back.direction = normalize(ray.origin - back.origin);
    SurfaceHit in;
    ASSERT_TRUE(cloud.meet(back, in)) << i;
    ASSERT_TRUE(in.entering);
    ASSERT_LT(in.t, length(ray.origin - back.origin));
  }
  EXPECT_TRUE(mls_contains(cloud.set, cloud.tree.view(), {0.1f, 0.2f, 0}));
  EXPECT_FALSE(mls_contains(cloud.set, cloud.tree.view(), {0, 1.45f, 0}));
}

TEST(MlsSurface, RaysThatLeaveItDoNotMeetItAtOnce) {
  // Out of a convex body nothing is met again, whichever way; into it the far side is, at the chord 2 cos(angle).
  const float h = 0.22f, radius = 1 - 5.0f / 72 * h * h;
  for (const bool closed : {true, false}) {
    const Cloud cloud(sphere_points(4, h), closed);
    std::mt19937 random(16);
    std::uniform_real_distribution<float> unit(-1, 1);
    for (const Ray& ray : rays_at({{-0.8f, -0.8f, -0.8f}, {0.8f, 0.8f, 0.8f}}, 3000, 17)) {
      SurfaceHit hit, again;
      if (!cloud.meet(ray, hit)) continue;
      const Vec3 n = hit.geometric_normal;
      Vec3 d{unit(random), unit(random), unit(random)};
      while (length(d) > 1 || length(d) < 0.1f) d = {unit(random), unit(random), unit(random)};
      d = normalize(d);
      Ray next;
      next.direction = dot(d, n) < 0 ? -d : d;
      const float offset = 1e-3f * hit.splat_radius;
      next.origin = hit.position + offset * n;
      const SplatStart outwards{n, hit.splat_radius, false};
      EXPECT_FALSE(cloud.meet(next, again, false, outwards)) << "cosine " << dot(next.direction, n);
      // A chord that is hardly more than the offset may be missed.
      const float cosine = dot(next.direction, n);
      if (cosine < 0.02f) continue;
      next.direction = -next.direction;
      next.origin = hit.position - offset * n;
      const SplatStart inwards{n, hit.splat_radius, true};
      ASSERT_TRUE(cloud.meet(next, again, true, inwards)) << "cosine " << cosine;
      EXPECT_FALSE(again.entering);
      EXPECT_NEAR(again.t, 2 * radius * cosine, 0.02f);
    }
  }
}

TEST(MlsSurface, ASheetEndsAtItsBorder) {
  // A sheet of even density over x > 0. At a distance e beyond the border the mean lies c(e) = int_e^1 u g du / int_e^1 g du
  // away (h = 1), g(u) = int phi(sqrt(u^2 + v^2)) dv: there is a surface to where that is 0.4.
  const auto g = [](double u) {
    double sum = 0;
    for (int k = 0; k < 400; ++k) sum += oracle::weight_of(std::hypot(u, (k + 0.5) / 400)) / 400;
    return 2 * sum;
  };
  const auto mean = [&](double e) {
    double moment = 0, mass = 0;
    for (int k = 0; k < 400; ++k) {
      const double u = e + (1 - e) * (k + 0.5) / 400, w = g(u);
      moment += u * w;
      mass += w;
    }
    return moment / mass;
  };
  EXPECT_NEAR(mean(0), 2 / (3 * M_PI), 1e-4);
  double beyond = 0, far = 0.5;
  for (int i = 0; i < 40; ++i) (mean(0.5 * (beyond + far)) < 0.4 ? beyond : far) = 0.5 * (beyond + far);
  std::printf("the sheet ends %.4f h beyond its border\n", beyond);

  // A lattice of spacing s is even over x > -s/2.
  const float s = 0.012f, h = 10 * s;
  std::vector<Splat> points;
  for (int i = 0; i < 34; ++i)
    for (int j = -30; j <= 30; ++j)
      points.push_back(disc({static_cast<float>(i) * s, static_cast<float>(j) * s, 0}, {0, 0, 1}, h));
  const Cloud cloud(points, false);
  const float border = -0.5f * s - static_cast<float>(beyond) * h;
  std::mt19937 random(18);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (int i = 0; i < 4000; ++i) {
    Ray ray;
    const Vec3 target{0.15f * unit(random), 0.2f * unit(random), 0};
    ray.direction = normalize(Vec3{unit(random), unit(random), unit(random) < 0 ? -1.0f : 1.0f});
    ray.origin = target - ray.direction;
    SurfaceHit hit;
    const bool found = cloud.meet(ray, hit);
    if (std::fabs(target.x - border) < 0.01f * h) continue;
    EXPECT_EQ(found, target.x > border) << (target.x - border) / h;
    if (found) {
      EXPECT_LT(length(hit.position - target), 1e-5f);
    }
  }
}

TEST(MlsSurface, ColoursAreInterpolated) {
  std::vector<Splat> points = sphere_points(4, 0.22f);
  Cloud cloud(points, true);
  std::vector<Rgb> colors(cloud.tree.order.size(), Rgb{0.2f, 0.5f, 0.7f});
  cloud.set.colors = colors.data();
  const std::vector<Ray> rays = rays_at({{-1, -1, -1}, {1, 1, 1}}, 500, 19);
  for (const Ray& ray : rays) {
    SurfaceHit hit;
    if (!cloud.meet(ray, hit)) continue;
    EXPECT_NEAR(hit.color.r, 0.2f, 1e-6f);
    EXPECT_NEAR(hit.color.g, 0.5f, 1e-6f);
    EXPECT_NEAR(hit.color.b, 0.7f, 1e-6f);
  }
  // A linear field of colours has the colour of the mean of the points, which is where the surface is.
  for (std::size_t i = 0; i < colors.size(); ++i) {
    if (cloud.tree.order[i] == no_splat) continue;
    const Vec3 p = cloud.points[cloud.tree.order[i]].center;
    colors[i] = {0.5f + 0.4f * p.x, 0.5f + 0.4f * p.y, 0.5f};
  }
  int hits = 0;
  for (const Ray& ray : rays) {
    SurfaceHit hit;
    if (!cloud.meet(ray, hit)) continue;
    ++hits;
    EXPECT_NEAR(hit.color.r, 0.5f + 0.4f * hit.position.x, 2e-3f);
    EXPECT_NEAR(hit.color.g, 0.5f + 0.4f * hit.position.y, 2e-3f);
  }
  EXPECT_GT(hits, 200);
}

TEST(MlsSurface, OnePointIsADiscOfItsReach) {
  const Cloud cloud({disc({0, 0, 0}, {0, 0, 1}, 1)}, false);
  for (const float x : {0.0f, 0.39f, 0.41f, 0.9f, 1.1f}) {
    Ray ray;
    ray.origin = {x, 0, 2};
    ray.direction = {0, 0, -1};
    SurfaceHit hit;
    EXPECT_EQ(cloud.meet(ray, hit), x < 0.4f) << x;
    if (x < 0.4f) {
      EXPECT_NEAR(hit.t, 2, 1e-6f);
    }
  }
}

TEST(MlsSurface, ExtentsOfRaysCount) {
  const Cloud cloud(sphere_points(4, 0.22f), false);
  Ray ray;
  ray.origin = {0.1f, 0.2f, 5};
  ray.direction = {0, 0, -1};
  SurfaceHit first, second, none;
  ASSERT_TRUE(cloud.meet(ray, first));
  EXPECT_TRUE(first.entering);
  ray.t_max = first.t * 0.999f;
  EXPECT_FALSE(cloud.meet(ray, none));
  // Straight on from where it was met.
  ray.t_max = infinity;
  ray.t_min = first.t;
  ASSERT_TRUE(cloud.meet(ray, second));
  EXPECT_FALSE(second.entering);
  EXPECT_GT(second.t, first.t + 1.5f);
  ray.t_min = second.t;
  EXPECT_FALSE(cloud.meet(ray, none));
}

TEST(MlsSurface, WhatIsNoPointIsNotFelt) {
  EXPECT_FALSE(Cloud({}, false).meet({}, *std::make_unique<SurfaceHit>()));
  std::vector<Splat> points = sphere_points(3, 0.44f);
  const Cloud clean(points, true);
  points.push_back(disc({0, 0, 1}, {0, 0, 1}, 0));
  points.push_back(disc({0, 0, infinity}, {0, 0, 1}, 1));
  points.push_back({{0, 0, 1}, 1, {0, 0, 0}, {}});
  const Cloud cloud(points, true);
  for (const Ray& ray : rays_at({{-1, -1, -1}, {1, 1, 1}}, 200, 20)) {
    SurfaceHit a, b;
    const bool found = clean.meet(ray, a);
    ASSERT_EQ(found, cloud.meet(ray, b));
    if (found) {
      EXPECT_NEAR(a.t, b.t, 1e-5f);
    }
  }
}

}  // namespace
}  // namespace embrun
