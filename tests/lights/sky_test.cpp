#include "lights/sky.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"

namespace embrun {
namespace {

constexpr double pi_d = 3.14159265358979323846;

/// Irradiance (luminance) on a plane facing `normal`, by quadrature through the look-up.
double irradiance(const Environment& env, Vec3 normal) {
  double sum = 0;
  constexpr int rows = 256, columns = 512;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const double polar = pi_d * (i + 0.5) / rows, a = 2 * pi_d * (j + 0.5) / columns;
      const Vec3 d = to_float({std::sin(polar) * std::cos(a), std::cos(polar), std::sin(polar) * std::sin(a)});
      if (d.y < 0 || dot(d, normal) <= 0) continue;
      sum += luminance(environment_radiance(env, d)) * dot(d, normal) * std::sin(polar) * (pi_d / rows) *
             (2 * pi_d / columns);
    }
  return sum;
}

TEST(Sky, HasTheIrradianceThatIsAskedFor) {
  SkySettings settings;
  const EnvironmentImage image = make_sky(settings, 512, 256), without_sun = make_sky(settings, 512, 256, false);
  const Vec3 sun = sun_direction(settings, UpAxis::y);
  const double sky = irradiance(without_sun.view(UpAxis::y), {0, 1, 0});
  EXPECT_NEAR(sky, settings.sky_irradiance, 0.01);
  EXPECT_NEAR(irradiance(image.view(UpAxis::y), {0, 1, 0}) - sky, settings.sun_irradiance * sun.y, 0.01);
  EXPECT_NEAR(irradiance(image.view(UpAxis::y), sun) - irradiance(without_sun.view(UpAxis::y), sun),
              settings.sun_irradiance, 0.01);
}

TEST(Sky, LooksLikeASky) {
  const SkySettings settings;
  const EnvironmentImage image = make_sky(settings, 512, 256);
  const Environment env = image.view(UpAxis::y);
  EXPECT_EQ(image.bad_values(), 0);
  for (const float v : image.rgb()) ASSERT_GE(v, 0);
  const Rgb zenith = environment_radiance(env, {0, 1, 0});
  const Vec3 sun = sun_direction(settings, UpAxis::y);
  const Vec3 away = normalize(Vec3{-sun.x, 0.05f, -sun.z});
  const Rgb horizon = environment_radiance(env, away);
  EXPECT_GT(luminance(horizon), 1.5f * luminance(zenith));  // air mass brightens the horizon
  EXPECT_GT(zenith.b, 1.5f * zenith.r);                     // blue
  const Rgb at_sun = environment_radiance(env, sun);
  EXPECT_GT(luminance(at_sun), 10 * luminance(horizon));
  EXPECT_GT(at_sun.r, at_sun.b);  // warm
  // No jump at the horizon.
  const Rgb above = environment_radiance(env, normalize(Vec3{1, 0.004f, 0.3f}));
  const Rgb below = environment_radiance(env, normalize(Vec3{1, -0.004f, 0.3f}));
  EXPECT_NEAR(luminance(below) / luminance(above), 1, 0.1);
}

// No light smaller than 5 degrees by default: the sun is at half its peak 2.5 degrees off its middle at least.
TEST(Sky, DefaultSunIsWide) {
  const SkySettings settings;
  const EnvironmentImage image = make_sky(settings, 512, 256);
  const Environment env = image.view(UpAxis::y);
  const Vec3 sun = sun_direction(settings, UpAxis::y);
  const Frame frame(sun);
  const Vec3 off =
      sun * static_cast<float>(std::cos(2.5 * pi_d / 180)) + frame.s * static_cast<float>(std::sin(2.5 * pi_d / 180));
  EXPECT_GT(luminance(environment_radiance(env, off)), 0.5f * luminance(environment_radiance(env, sun)));
}

TEST(Sky, SunStandsWhereItIsPut) {
  SkySettings settings;
  settings.sun_elevation = 30;
  settings.sun_azimuth = 90;
  const float half_root_3 = std::sqrt(0.75f);
  EXPECT_LT(length(sun_direction(settings, UpAxis::y) - Vec3{half_root_3, 0.5f, 0}), 1e-6);
  EXPECT_LT(length(sun_direction(settings, UpAxis::z) - Vec3{half_root_3, 0, 0.5f}), 1e-6);
  settings.sun_azimuth = 0;  // the viewer's side
  EXPECT_LT(length(sun_direction(settings, UpAxis::y) - Vec3{0, 0.5f, half_root_3}), 1e-6);
  EXPECT_LT(length(sun_direction(settings, UpAxis::z) - Vec3{0, -half_root_3, 0.5f}), 1e-6);
  // And the brightest pixel is there.
  const EnvironmentImage image = make_sky(settings, 512, 256);
  for (const UpAxis up : {UpAxis::y, UpAxis::z}) {
    const Environment env = image.view(up);
    float brightest = 0;
    Vec3 where;
    for (int y = 0; y < env.height; ++y)
      for (int x = 0; x < env.width; ++x)
        if (luminance(environment_pixel(env, x, y)) > brightest) {
          brightest = luminance(environment_pixel(env, x, y));
          where = direction_from_latlong(env, (static_cast<float>(x) + 0.5f) / static_cast<float>(env.width),
                                         pi * (static_cast<float>(y) + 0.5f) / static_cast<float>(env.height));
        }
    EXPECT_GT(dot(where, sun_direction(settings, up)), std::cos(0.5 * pi_d / 180));
  }
}

// A real sun is 0.53 degrees wide: L = E / (pi sin^2(h)).
TEST(Sky, SmallSunIsADistantLight) {
  SkySettings settings;
  settings.sun_diameter = 0.53f;
  EXPECT_THROW(make_sky(settings), Error);
  EXPECT_NO_THROW(make_sky(settings, 64, 32, false));
  const double sine = std::sin(0.265 * pi_d / 180);
  EXPECT_NEAR(luminance(sun_radiance(settings)) * pi_d * sine * sine, settings.sun_irradiance, 1e-4);
}

TEST(Sky, WorksOverItsWholeRange) {
  for (const float elevation : {0.0f, 5.0f, 45.0f, 90.0f})
    for (const float turbidity : {1.0f, 2.0f, 6.0f, 10.0f}) {
      SkySettings settings;
      settings.sun_elevation = elevation;
      settings.turbidity = turbidity;
      const EnvironmentImage image = make_sky(settings, 128, 64);
      EXPECT_EQ(image.bad_values(), 0) << elevation << " " << turbidity;
      EXPECT_NEAR(irradiance(make_sky(settings, 128, 64, false).view(UpAxis::y), {0, 1, 0}), settings.sky_irradiance,
                  0.05);
    }
}

TEST(Sky, RefusesWhatMakesNoSense) {
  const auto refuses = [](auto change) {
    SkySettings settings;
    change(settings);
    EXPECT_THROW(make_sky(settings, 128, 64), Error);
  };
  refuses([](SkySettings& s) { s.turbidity = 0.9f; });
  refuses([](SkySettings& s) { s.sun_elevation = -1; });
  refuses([](SkySettings& s) { s.sun_diameter = 0; });
  refuses([](SkySettings& s) { s.sun_irradiance = std::nanf(""); });
  refuses([](SkySettings& s) { s.ground.g = 1.5f; });
}

TEST(Studio, LightsAWhiteFloorToNineTenths) {
  const EnvironmentImage image = make_studio(512, 256);
  EXPECT_EQ(image.bad_values(), 0);
  EXPECT_NEAR(irradiance(image.view(UpAxis::y), {0, 1, 0}) / pi_d, 0.9, 0.01);
}

}  // namespace
}  // namespace embrun
