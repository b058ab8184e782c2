#include "lights/light_set.h"

#include <gtest/gtest.h>

#include <cmath>

#include "lights/light_set_builder.h"
#include "lights/mis.h"
#include "lights/sky.h"
#include "support/chi_square.h"

namespace embrun {
namespace {

constexpr double pi_d = 3.14159265358979323846;

SampleKey key(int i) { return {10, 0, static_cast<uint32_t>(i), 0}; }

LightSample draw(const LightSet& lights, Vec3 point, int i, SamplerKind kind = SamplerKind::sobol) {
  return sample_lights(lights, point, sample_1d(kind, key(i), Dimension::light_choice),
                       sample_2d(kind, key(i), Dimension::light_position));
}

TEST(LightSet, EmptyGivesNothing) {
  const LightSetBuilder builder;
  EXPECT_FALSE(draw(builder.view(), {}, 0).valid);
  EXPECT_TRUE(is_black(escaped_light(builder.view(), {0, 1, 0}).radiance));
  EXPECT_EQ(intersect_lights(builder.view(), {}).light, -1);
}

// Powers: environment 4 pi L pi R^2, sphere 4 pi^2 r^2 L.
TEST(LightSet, ChoosesByPower) {
  LightSetBuilder builder;
  builder.set_constant_environment(grey(0.5f));
  builder.add(make_sphere_light({0, 9, 0}, 0.5f, grey(8)));
  builder.finish(2);
  const LightSet lights = builder.view();
  EXPECT_EQ(lights.environment_index, 0);
  const double environment = 4 * pi_d * 0.5 * pi_d * 4, sphere = 4 * pi_d * pi_d * 0.25 * 8;
  EXPECT_NEAR(probability_of(lights.choice, 0), environment / (environment + sphere), 1e-6);
}

TEST(LightSet, WeakLightsAreNotForgottenAndDarkOnesNeverChosen) {
  LightSetBuilder builder;
  builder.add(make_sphere_light({0, 9, 0}, 1, grey(1000)));
  builder.add(make_sphere_light({3, 9, 0}, 0.01f, grey(0.01f)));
  builder.add(make_sphere_light({6, 9, 0}, 1, grey(0)));
  builder.finish(2);
  EXPECT_NEAR(probability_of(builder.view().choice, 1), 1.0 / 31, 1e-3);
  EXPECT_EQ(probability_of(builder.view().choice, 2), 0);
}

// A scene with one of each: every direction's density, summed over the lights behind one another, is what is sampled.
TEST(LightSet, SamplesFollowThePdf) {
  LightSetBuilder builder;
  const EnvironmentImage sky = make_sky({}, 96, 48);
  builder.set_environment(sky, UpAxis::z);
  builder.add(make_distant_light({-1, 0.2f, 1}, 0.5f, grey(2)));
  builder.add(make_rectangle_light({-2, -2, 1}, {0, 1.5f, 0}, {1.5f, 0, 0}, grey(4)));
  builder.finish(1.5f);
  const LightSet lights = builder.view();
  testing_support::SphereChiSquareTest test;
  test.name = "light_set";
  test.points_per_side = 60;
  test.sample = [&](int i) -> std::optional<Vec3> {
    const LightSample s = draw(lights, {}, i, SamplerKind::independent);
    return s.valid ? std::optional(s.direction) : std::nullopt;
  };
  test.density = [&](Vec3 d) {
    Ray ray;
    ray.direction = d;
    return static_cast<double>(intersect_lights(lights, ray).pdf) + escaped_light(lights, d).pdf;
  };
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
}

TEST(LightSet, EscapedLightAddsUpWhatOverlaps) {
  LightSetBuilder builder;
  builder.set_constant_environment(grey(1));
  builder.add(make_distant_light({0, 1, 0}, 0.1f, grey(5)));
  builder.finish(1);
  const LightSet lights = builder.view();
  EXPECT_EQ(escaped_light(lights, {0, 1, 0}).radiance.g, 6);
  EXPECT_EQ(escaped_light(lights, {0, -1, 0}).radiance.g, 1);
  const double h = 1 - std::cos(0.1);
  EXPECT_NEAR(escaped_light(lights, {0, 1, 0}).pdf,
              probability_of(lights.choice, 0) / (4 * pi_d) + probability_of(lights.choice, 1) / (2 * pi_d * h), 2e-3);
  EXPECT_NEAR(escaped_light(lights, {0, -1, 0}).pdf, probability_of(lights.choice, 0) / (4 * pi_d), 1e-6);
}

// Irradiance of a plane under a rectangle and a sky by both techniques with the balance heuristic. Expected: the two
// lights each alone, E = pi L for the constant sky, minus what the opaque rectangle hides of it, plus its own: pi (1
// + F (4 - 1)).
TEST(LightSet, MultipleImportanceSamplingIsUnbiased) {
  LightSetBuilder builder;
  builder.set_constant_environment(grey(1));
  builder.add(make_rectangle_light({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, grey(4)));
  builder.finish(2);
  const LightSet lights = builder.view();
  const double r = std::sqrt(2.0), factor = 2 / r * std::atan(1 / r) / (2 * pi_d);  // corner form factor, X = Y = 1
  const double expected = pi_d * (1 + factor * (4 - 1));

  double by_balance = 0, by_power = 0;
  constexpr int n = 1 << 17;
  for (int i = 0; i < n; ++i) {
    const LightSample s = draw(lights, {}, i);
    if (s.valid && s.direction.y > 0) {
      Ray shadow;
      shadow.direction = s.direction;
      shadow.t_max = s.distance * (1 - 1e-4f);
      if (intersect_lights(lights, shadow).light < 0) {
        const float cosine = s.direction.y, other = cosine_hemisphere_pdf(cosine);
        by_balance += balance_heuristic(s.pdf, other) * s.radiance.g * cosine / s.pdf / n;
        by_power += power_heuristic(s.pdf, other) * s.radiance.g * cosine / s.pdf / n;
      }
    }
    const Vec3 local = sample_cosine_hemisphere(sample_2d(SamplerKind::sobol, key(i), Dimension::bsdf_direction));
    Ray ray;
    ray.direction = {local.x, local.z, local.y};
    const LightHit hit = intersect_lights(lights, ray);
    const EscapedLight escaped = escaped_light(lights, ray.direction);
    const float radiance = hit.light >= 0 ? hit.radiance.g : escaped.radiance.g;
    const float light_pdf = hit.light >= 0 ? hit.pdf : escaped.pdf;
    const float pdf = cosine_hemisphere_pdf(local.z);
    by_balance += balance_heuristic(pdf, light_pdf) * radiance * local.z / pdf / n;
    by_power += power_heuristic(pdf, light_pdf) * radiance * local.z / pdf / n;
  }
  EXPECT_NEAR(by_balance / expected, 1, 3e-3);
  EXPECT_NEAR(by_power / expected, 1, 3e-3);
}

}  // namespace
}  // namespace embrun
