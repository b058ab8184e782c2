#include "lights/sky.h"

#include <cmath>
#include <string>

#include "base/error.h"

namespace embrun {
namespace {

constexpr double pi_d = 3.14159265358979323846;

double radians(double degrees) { return degrees * (pi_d / 180); }

double smooth_step(double low, double high, double x) {
  const double t = std::fmin(std::fmax((x - low) / (high - low), 0.0), 1.0);
  return t * t * (3 - 2 * t);
}

/// Air mass towards the sun: 1 at the zenith, 37 at the horizon [Kasten1965].
double sun_air_mass(double cos_zenith_angle) {
  const double cosine = std::fmax(cos_zenith_angle, 0.0);
  const double degrees = std::acos(std::fmin(cosine, 1.0)) * (180 / pi_d);
  return 1 / (cosine + 0.15 * std::pow(93.885 - degrees, -1.253));
}

/// (1 - exp(-x)) / x, which is 1 at 0.
double mean_attenuation(double x) { return std::fabs(x) < 1e-6 ? 1 - 0.5 * x : -std::expm1(-x) / x; }

/// Sky of a plane, homogeneous atmosphere of air and haze under a sun of irradiance 1 outside it [BohrenClothiaux2006].
/// Light scattered once is exact: along a line of sight of optical depth t m, sunlight arrives with exp(-t' m_sun), is
/// scattered and attenuated. Light scattered more often, and from the ground, comes from a two-stream estimate
/// of the mean radiance. So the zenith is blue (optically thin: light in proportion to the scattering) and the horizon
/// pale (thick: all that can be scattered is).
class Atmosphere {
 public:
  explicit Atmosphere(const SkySettings& settings) : sun_height_(std::sin(radians(settings.sun_elevation))) {
    // Scattering optical depths at the dominant wavelengths of the Rec. 709 primaries: air, and haze after
    // Angstrom [Preetham1999], appendix A.1.
    const double micrometres[3] = {0.611, 0.549, 0.464};
    const double haze = 0.04608 * settings.turbidity - 0.04586;
    const double sun_mass = sun_air_mass(sun_height_);
    for (int c = 0; c < 3; ++c) {
      air_[c] = 0.008735 * std::pow(micrometres[c], -4.08);
      haze_[c] = haze * std::pow(micrometres[c], -1.3);
      sun_depth_[c] = (air_[c] + haze_[c]) * sun_mass;
      const double arrives = std::exp(-sun_depth_[c]);
      mean_radiance_[c] = sun_height_ / (2 * pi_d) * (1 - arrives + static_cast<double>(settings.ground[c]) * arrives);
    }
  }

  Rgb radiance(double cos_zenith_angle, double sun_angle) const {
    // Seen through 5 air masses at the horizon, not 37: a horizon as bright as in nature would be white in pictures.
    const double mass = 1.25 / (std::fmax(cos_zenith_angle, 0.0) + 0.25);
    const double cosine = std::cos(sun_angle);
    const double air_phase = 0.75 * (1 + cosine * cosine) / (4 * pi_d);
    constexpr double g = 0.72;  // haze scatters forwards
    const double haze_phase = (1 - g * g) / std::pow(1 + g * g - 2 * g * cosine, 1.5) / (4 * pi_d);
    Rgb result;
    for (int c = 0; c < 3; ++c) {
      const double depth = (air_[c] + haze_[c]) * mass;
      const double once = (air_[c] * air_phase + haze_[c] * haze_phase) * mass * std::exp(-sun_depth_[c]) *
                          mean_attenuation(depth - sun_depth_[c]);
      result[c] = static_cast<float>(once - mean_radiance_[c] * std::expm1(-depth));
    }
    return result;
  }

  /// Colour of sunlight on the ground, of luminance 1.
  Rgb sun_colour() const {
    Rgb colour;
    for (int c = 0; c < 3; ++c) colour[c] = static_cast<float>(std::exp(-sun_depth_[c]));
    return colour * (1 / luminance(colour));
  }

 private:
  double sun_height_;
  double air_[3], haze_[3], sun_depth_[3], mean_radiance_[3];
};

void check(const SkySettings& settings) {
  const auto require = [](bool good, const char* name, float value, const char* range) {
    if (!good) throw Error(std::string("sky: ") + name + " " + std::to_string(value) + " is not " + range);
  };
  require(settings.sun_elevation >= 0 && settings.sun_elevation <= 90, "sun_elevation", settings.sun_elevation,
          "within 0 and 90 degrees");
  require(std::isfinite(settings.sun_azimuth), "sun_azimuth", settings.sun_azimuth, "a number");
  require(settings.sun_diameter > 0 && settings.sun_diameter <= 90, "sun_diameter", settings.sun_diameter,
          "above 0 and at most 90 degrees");
  require(settings.sun_irradiance >= 0 && is_finite(settings.sun_irradiance), "sun_irradiance", settings.sun_irradiance,
          "0 or more");
  require(settings.sky_irradiance >= 0 && is_finite(settings.sky_irradiance), "sky_irradiance", settings.sky_irradiance,
          "0 or more");
  require(settings.turbidity >= 1 && settings.turbidity <= 10, "turbidity", settings.turbidity, "within 1 and 10");
  for (int c = 0; c < 3; ++c)
    require(settings.ground[c] >= 0 && settings.ground[c] <= 1, "ground", settings.ground[c], "within 0 and 1");
}

/// Pixels of a lat-long image under construction, with their directions (y up) and solid angles.
class Canvas {
 public:
  Canvas(int width, int height) : rgb(3 * static_cast<size_t>(width) * static_cast<size_t>(height)) {
    frame_.width = width;
    frame_.height = height;
  }

  /// paint(direction, pixel, solid_angle) for every pixel; `pixel` may be changed.
  template <class Paint>
  void for_each(Paint paint) {
    float* p = rgb.data();
    for (int y = 0; y < frame_.height; ++y) {
      const float polar = (static_cast<float>(y) + 0.5f) * pi / static_cast<float>(frame_.height);
      const float solid_angle = latlong_pixel_solid_angle(frame_, y);
      for (int x = 0; x < frame_.width; ++x, p += 3) {
        const float u = (static_cast<float>(x) + 0.5f) / static_cast<float>(frame_.width);
        Rgb pixel{p[0], p[1], p[2]};
        paint(direction_from_latlong(frame_, u, polar), pixel, static_cast<double>(solid_angle));
        p[0] = pixel.r, p[1] = pixel.g, p[2] = pixel.b;
      }
    }
  }

  std::vector<float> rgb;

 private:
  Environment frame_;
};

double angle_between(Vec3 a, Vec3 b) { return 2 * std::asin(std::fmin(1.0, 0.5 * static_cast<double>(length(a - b)))); }

/// Raised cosine that reaches 0 with zero slope at the radius: no edge that could alias.
double sun_profile(double angle, double radius) {
  const double c = angle < radius ? std::cos(0.5 * pi_d * angle / radius) : 0.0;
  return c * c;
}

/// The sky without sun, and the factors that bring both to the irradiances asked for. The factors differ by channel:
/// they balance white, as a camera does, most of the way, so that a white floor under sun and sky is hardly tinted and
/// the sky keeps its blue.
struct Balance {
  Rgb sky, sun;
};

Balance balance_white(const SkySettings& settings, Rgb sky_irradiance, Rgb sun_colour, float sun_height) {
  const float brightness = settings.sky_irradiance / luminance(sky_irradiance);
  const Rgb total = sky_irradiance * brightness + sun_colour * (settings.sun_irradiance * sun_height);
  const float level = luminance(total);
  Rgb gain{1, 1, 1};
  for (int c = 0; c < 3; ++c)
    if (total[c] > 0) gain[c] = std::pow(level / total[c], 0.5f);
  // Balancing must not change the brightness of either.
  Balance result;
  result.sky = gain * (settings.sky_irradiance / luminance(sky_irradiance * gain));
  result.sun = sun_colour * gain * (settings.sun_irradiance / luminance(sun_colour * gain));
  return result;
}

/// Replaces what is below the horizon by ground lit by sky and sun, with a haze that hides the horizon's line.
void paint_ground(Canvas& canvas, const SkySettings& settings, const Atmosphere& atmosphere, Rgb sky_scale, Vec3 sun) {
  const float lit = (settings.sky_irradiance + settings.sun_irradiance * max_of(sun.y, 0.0f)) * inv_pi;
  canvas.for_each([&](Vec3 d, Rgb& pixel, double) {
    if (d.y >= 0) return;
    const Vec3 level = normalize(Vec3{d.x, 0, d.z});
    const Rgb horizon = atmosphere.radiance(0, angle_between(level, sun)) * sky_scale;
    const float ground_share = static_cast<float>(smooth_step(0, radians(12), std::asin(-static_cast<double>(d.y))));
    pixel = horizon * (1 - ground_share) + settings.ground * (lit * ground_share);
  });
}

/// Everything about a sky but its pixels.
struct SkyPlan {
  Vec3 sun;
  Atmosphere atmosphere;
  Balance balance;
};

SkyPlan plan_sky(const SkySettings& settings) {
  check(settings);
  SkyPlan plan{sun_direction(settings, UpAxis::y), Atmosphere(settings), {}};
  // The sky is smooth: a coarse grid integrates it.
  Rgb irradiance;
  Canvas coarse(128, 64);
  coarse.for_each([&](Vec3 d, Rgb&, double solid_angle) {
    if (d.y > 0)
      irradiance += plan.atmosphere.radiance(d.y, angle_between(d, plan.sun)) * static_cast<float>(d.y * solid_angle);
  });
  plan.balance = balance_white(settings, irradiance, plan.atmosphere.sun_colour(), plan.sun.y);
  return plan;
}

}  // namespace

Vec3 sun_direction(const SkySettings& settings, UpAxis up) {
  const double elevation = radians(settings.sun_elevation), azimuth = radians(settings.sun_azimuth);
  const UpBasis basis = up_basis(up);
  const auto right = static_cast<float>(std::cos(elevation) * std::sin(azimuth));
  const auto back = static_cast<float>(std::cos(elevation) * std::cos(azimuth));
  return normalize(basis.right * right + basis.back * back + basis.up * static_cast<float>(std::sin(elevation)));
}

Rgb sun_radiance(const SkySettings& settings) {
  // Irradiance of a uniform disk of half angle h on a plane that faces it: pi sin^2(h) L.
  const double sine = std::sin(0.5 * radians(settings.sun_diameter));
  return plan_sky(settings).balance.sun * static_cast<float>(1 / (pi_d * sine * sine));
}

EnvironmentImage make_sky(const SkySettings& settings, int width, int height, bool include_sun) {
  const SkyPlan plan = plan_sky(settings);
  if (include_sun && settings.sun_diameter * static_cast<float>(height) < 4 * 180.0f)
    throw Error("sky: a sun of " + std::to_string(settings.sun_diameter) + " degrees is too small for an image of " +
                std::to_string(height) + " rows; use a distant light for it");
  const double sun_radius = 0.5 * radians(settings.sun_diameter);

  Canvas canvas(width, height);
  double profile_irradiance = 0;
  canvas.for_each([&](Vec3 d, Rgb& pixel, double solid_angle) {
    const double sun_angle = angle_between(d, plan.sun);
    profile_irradiance += sun_profile(sun_angle, sun_radius) * std::cos(sun_angle) * solid_angle;
    if (d.y >= 0) pixel = plan.atmosphere.radiance(d.y, sun_angle) * plan.balance.sky;
  });
  paint_ground(canvas, settings, plan.atmosphere, plan.balance.sky, plan.sun);
  if (include_sun && profile_irradiance > 0) {
    const Rgb peak = plan.balance.sun * static_cast<float>(1 / profile_irradiance);
    canvas.for_each([&](Vec3 d, Rgb& pixel, double) {
      if (d.y >= 0) pixel += peak * static_cast<float>(sun_profile(angle_between(d, plan.sun), sun_radius));
    });
  }
  return {width, height, std::move(canvas.rgb)};
}

EnvironmentImage make_studio(int width, int height) {
  struct Softbox {
    double azimuth, elevation;       // degrees: where its middle is
    double half_width, half_height;  // degrees
    float radiance;
  };
  constexpr Softbox boxes[] = {
      {35, 48, 28, 18, 5.0f},   // key, above the viewer's right
      {-65, 25, 30, 22, 2.0f},  // fill, left
      {180, 22, 55, 9, 3.5f},   // rim, a strip behind
      {0, 88, 26, 26, 2.5f},    // overhead
  };
  Canvas canvas(width, height);
  double irradiance = 0;
  canvas.for_each([&](Vec3 d, Rgb& pixel, double solid_angle) {
    const auto height_share = static_cast<float>(smooth_step(-0.6, 0.9, d.y));
    pixel = Rgb{0.10f, 0.10f, 0.105f} * (1 - height_share) + Rgb{0.62f, 0.64f, 0.68f} * height_share;
    for (const Softbox& box : boxes) {
      const double azimuth = radians(box.azimuth), elevation = radians(box.elevation);
      const double c = std::cos(elevation), s = std::sin(elevation);
      const Vec3d middle{c * std::sin(azimuth), s, c * std::cos(azimuth)};
      const Vec3d across{std::cos(azimuth), 0, -std::sin(azimuth)};
      const Vec3d along = cross(middle, across);
      const Vec3d direction = to_double(d);
      const double depth = dot(direction, middle);
      if (depth <= 0) continue;
      const double a = std::atan(dot(direction, across) / depth), b = std::atan(dot(direction, along) / depth);
      const double edge = radians(2);
      const double inside = smooth_step(-edge, edge, radians(box.half_width) - std::fabs(a)) *
                            smooth_step(-edge, edge, radians(box.half_height) - std::fabs(b));
      pixel += grey(box.radiance * static_cast<float>(inside));
    }
    if (d.y > 0) irradiance += luminance(pixel) * d.y * solid_angle;
  });
  const auto scale = static_cast<float>(0.9 * pi_d / irradiance);
  for (float& v : canvas.rgb) v *= scale;
  return {width, height, std::move(canvas.rgb)};
}

}  // namespace embrun
