#include "lights/area_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/error.h"
#include "lights/light_set.h"
#include "lights/light_set_builder.h"
#include "support/chi_square.h"

namespace embrun {
namespace {

constexpr double pi_d = 3.14159265358979323846;

Sample2 numbers(SamplerKind kind, int i) {
  return sample_2d(kind, {9, 0, static_cast<uint32_t>(i), 0}, Dimension::light_position);
}

LightSetBuilder only(const Light& light) {
  LightSetBuilder builder;
  builder.add(light);
  builder.finish(1);
  return builder;
}

/// Irradiance at `point` on a plane facing `normal`, by sampling the lights.
double irradiance(const LightSet& lights, Vec3 point, Vec3 normal) {
  constexpr int n = 1 << 16;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const LightSample s = sample_lights(lights, point, 0.5f, numbers(SamplerKind::sobol, i));
    if (s.valid) sum += s.radiance.g * max_of(dot(s.direction, normal), 0.0f) / s.pdf / n;
  }
  return sum;
}

// A differential element below a corner of a parallel rectangle a x b at height c, with X = a/c, Y = b/c:
// F = (X/sqrt(1+X^2) atan(Y/sqrt(1+X^2)) + Y/sqrt(1+Y^2) atan(X/sqrt(1+Y^2))) / (2 pi), and E = pi L F
// (the classic configuration factor; see any heat transfer text).
double corner_form_factor(double a, double b, double c) {
  const double x = a / c, y = b / c, rx = std::sqrt(1 + x * x), ry = std::sqrt(1 + y * y);
  return (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry)) / (2 * pi_d);
}

TEST(RectangleLight, HasItsFormFactor) {
  for (const auto& [a, b, c] : {std::array{1.0, 2.0, 0.5}, std::array{0.3, 0.3, 1.0}, std::array{5.0, 4.0, 1.0}}) {
    // Facing down: cross(edge_u, edge_v) = -y.
    const auto fa = static_cast<float>(a), fb = static_cast<float>(b), fc = static_cast<float>(c);
    const LightSetBuilder lights = only(make_rectangle_light({0, fc, 0}, {fa, 0, 0}, {0, 0, fb}, {1, 3, 1}));
    const double expected = 3 * pi_d * corner_form_factor(a, b, c);
    EXPECT_NEAR(irradiance(lights.view(), {0, 0, 0}, {0, 1, 0}) / expected, 1, 2e-3);
  }
}

// Above the middle of a disk of radius r at distance h: F = r^2 / (r^2 + h^2).
TEST(DiskLight, HasItsFormFactor) {
  const LightSetBuilder lights = only(make_disk_light({1, 2, 3}, {0, -1, 0}, 0.8f, grey(2)));
  EXPECT_NEAR(irradiance(lights.view(), {1, 0.5f, 3}, {0, 1, 0}), 2 * pi_d * 0.64 / (0.64 + 2.25), 2e-3);
}

// A sphere of radius r whose centre is straight ahead at distance d: F = (r/d)^2.
TEST(SphereLight, HasItsFormFactor) {
  for (const float d : {1.01f, 2.0f, 1000.0f}) {
    const LightSetBuilder lights = only(make_sphere_light({0, 0, d}, 1, grey(2)));
    EXPECT_NEAR(irradiance(lights.view(), {0, 0, 0}, {0, 0, 1}) * d * d / (2 * pi_d), 1, 2e-3);
  }
}

// A cone of half angle h straight above: E = pi sin^2(h) L.
TEST(DistantLight, HasItsIrradiance) {
  const LightSetBuilder lights = only(make_distant_light({0, 3, 0}, 0.25f, grey(2)));
  EXPECT_NEAR(irradiance(lights.view(), {5, 6, 7}, {0, 1, 0}), 2 * pi_d * std::pow(std::sin(0.25), 2), 1e-4);
}

// Two triangles make the rectangle of the form factor above.
TEST(TriangleLight, HasItsFormFactor) {
  LightSetBuilder builder;
  const LightTriangle triangles[] = {{{0, 0.5f, 0}, {1, 0, 0}, {0, 0, 2}}, {{1, 0.5f, 2}, {-1, 0, 0}, {0, 0, -2}}};
  builder.add_triangles(triangles, grey(1));
  builder.finish(1);
  EXPECT_NEAR(irradiance(builder.view(), {0, 0, 0}, {0, 1, 0}), pi_d * corner_form_factor(1, 2, 0.5), 2e-3);
}

struct ShapeCase {
  const char* name;
  Light light;
};

std::vector<ShapeCase> shapes() {
  return {{"rectangle_light", make_rectangle_light({-1, 1, -0.5f}, {1.5f, 0.3f, 0}, {0, 0, 2}, grey(1), true)},
          {"disk_light", make_disk_light({0.3f, 0.4f, 1}, {0.2f, 0.1f, -1}, 1.2f, grey(1))},
          {"sphere_light", make_sphere_light({0.5f, -1, -1}, 0.9f, grey(1))},
          {"distant_light", make_distant_light({1, 1, -1}, 0.7f, grey(1))}};
}

/// Density of sample_lights towards `direction`, from what a ray finds.
double density(const LightSet& lights, Vec3 point, Vec3 direction) {
  Ray ray;
  ray.origin = point;
  ray.direction = direction;
  const LightHit hit = intersect_lights(lights, ray);
  return (hit.light >= 0 && !is_black(hit.radiance) ? hit.pdf : 0.0f) + escaped_light(lights, direction).pdf;
}

TEST(AreaLights, SamplesFollowThePdf) {
  const Vec3 point{0.1f, 0.2f, -0.1f};
  for (const ShapeCase& shape : shapes()) {
    const LightSetBuilder builder = only(shape.light);
    const LightSet lights = builder.view();
    testing_support::SphereChiSquareTest test;
    test.name = shape.name;
    test.points_per_side = 60;  // the light's outline cuts bins
    int misses = 0;
    test.sample = [&](int i) -> std::optional<Vec3> {
      const LightSample s = sample_lights(lights, point, 0.3f, numbers(SamplerKind::independent, i));
      if (!s.valid) return std::nullopt;
      // The density that a ray finds there is the sample's, but for directions at the outline.
      const double found = density(lights, point, s.direction);
      if (found == 0)
        ++misses;
      else
        EXPECT_NEAR(found / s.pdf, 1, 1e-3);
      return s.direction;
    };
    test.density = [&](Vec3 d) { return density(lights, point, d); };
    const auto result = run_chi_square(test);
    EXPECT_TRUE(result.passed) << result.report;
    EXPECT_LT(misses, 20) << shape.name;
  }
}

TEST(AreaLights, SampledDistanceIsTheIntersections) {
  for (const ShapeCase& shape : shapes()) {
    if (shape.light.kind == LightKind::distant) continue;
    const LightSetBuilder builder = only(shape.light);
    for (int i = 0; i < 1000; ++i) {
      const Vec3 point{0.1f, 0.2f, -0.1f};
      const LightSample s = sample_lights(builder.view(), point, 0.3f, numbers(SamplerKind::sobol, i));
      if (!s.valid) continue;
      Ray ray;
      ray.origin = point;
      ray.direction = s.direction;
      const LightHit hit = intersect_lights(builder.view(), ray);
      if (hit.light >= 0) {
        EXPECT_NEAR(hit.distance / s.distance, 1, 2e-3) << shape.name;
      }
    }
  }
}

TEST(TriangleLight, SamplesFollowThePdf) {
  LightSetBuilder builder;
  const LightTriangle triangles[] = {{{-0.5f, -0.2f, 1}, {2, 0, 0}, {0, 0.7f, 0}},
                                     {{-1, 0, -0.4f}, {0, 1, 0}, {1, 1, 1}}};
  builder.add_triangles(triangles, grey(1), true);
  builder.finish(1);
  const LightSet lights = builder.view();
  testing_support::SphereChiSquareTest test;
  test.name = "triangle_light";
  test.points_per_side = 60;
  test.sample = [&](int i) -> std::optional<Vec3> {
    const LightSample s = sample_lights(lights, {}, 0.5f, numbers(SamplerKind::independent, i));
    return s.valid ? std::optional(s.direction) : std::nullopt;
  };
  test.density = [&](Vec3 d) {
    double sum = 0;
    for (const LightTriangle& t : triangles) {
      // Cramer's rule for vertex + b1 edge_1 + b2 edge_2 = s d, in double.
      const Vec3d e1 = to_double(t.edge_1), e2 = to_double(t.edge_2), v = to_double(t.vertex), dir = to_double(d);
      const double det = dot(cross(e1, e2), dir);
      const double distance = dot(cross(e1, e2), v) / det;
      const Vec3d p = dir * distance - v;
      const double b1 = dot(cross(p, e2), dir) / det, b2 = dot(cross(e1, p), dir) / det;
      if (distance <= 0 || b1 < 0 || b2 < 0 || b1 + b2 > 1) continue;
      Ray ray;
      ray.direction = d;
      sum += emissive_shape_hit(lights, 0, ray, static_cast<float>(distance), normalize(cross(t.edge_1, t.edge_2))).pdf;
    }
    return sum;
  };
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
}

TEST(AreaLights, OneSidedLightsAreDarkAndOpaqueFromBehind) {
  const LightSetBuilder lights = only(make_rectangle_light({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, grey(1)));  // faces down
  EXPECT_TRUE(sample_lights(lights.view(), {0.5f, 0, 0.5f}, 0, {0.5f, 0.5f}).valid);
  EXPECT_FALSE(sample_lights(lights.view(), {0.5f, 2, 0.5f}, 0, {0.5f, 0.5f}).valid);
  Ray ray;
  ray.origin = {0.5f, 2, 0.5f};
  ray.direction = {0, -1, 0};
  const LightHit hit = intersect_lights(lights.view(), ray);
  EXPECT_EQ(hit.light, 0);
  EXPECT_EQ(hit.distance, 1);
  EXPECT_TRUE(is_black(hit.radiance));
}

TEST(AreaLights, RaysRespectTheirExtent) {
  const LightSetBuilder lights = only(make_sphere_light({0, 0, 5}, 1, grey(1)));
  Ray ray;
  EXPECT_EQ(intersect_lights(lights.view(), ray).distance, 4);
  ray.t_max = 3.9f;
  EXPECT_EQ(intersect_lights(lights.view(), ray).light, -1);
  ray.t_max = infinity;
  ray.t_min = 4.5f;  // beyond the near side: the far side, from within, which is dark
  EXPECT_EQ(intersect_lights(lights.view(), ray).distance, 6);
  EXPECT_TRUE(is_black(intersect_lights(lights.view(), ray).radiance));
  ray.t_min = 7;
  EXPECT_EQ(intersect_lights(lights.view(), ray).light, -1);
}

TEST(SphereLight, SeesNothingFromWithin) {
  const LightSetBuilder lights = only(make_sphere_light({0, 0, 0}, 1, grey(1)));
  EXPECT_FALSE(sample_lights(lights.view(), {0.2f, 0, 0}, 0, {0.5f, 0.5f}).valid);
}

TEST(AreaLights, RefuseWhatHasNoArea) {
  EXPECT_THROW(make_rectangle_light({}, {1, 0, 0}, {2, 0, 0}, grey(1)), Error);
  EXPECT_THROW(make_rectangle_light({}, {1, 0, 0}, {1, 1, 0}, grey(1)), Error);
  EXPECT_THROW(make_disk_light({}, {0, 0, 0}, 1, grey(1)), Error);
  EXPECT_THROW(make_distant_light({0, 1, 0}, 0, grey(1)), Error);
  LightSetBuilder builder;
  EXPECT_THROW(builder.add(make_sphere_light({}, 0, grey(1))), Error);
  EXPECT_THROW(builder.add(make_sphere_light({}, 1, grey(-1))), Error);
  EXPECT_THROW(builder.add_triangles({}, grey(1)), Error);
}

}  // namespace
}  // namespace embrun
