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

/// CIE xyY to linear Rec. 709 primaries (ITU-R BT.709, D65); out-of-gamut channels are cut at 0.
Rgb rgb_from_chromaticity(double x, double y, double luminance_y) {
  const double X = x / y * luminance_y, Y = luminance_y, Z = (1 - x - y) / y * luminance_y;
  return {static_cast<float>(std::fmax(0.0, 3.2404542 * X - 1.5371385 * Y - 0.4985314 * Z)),
          static_cast<float>(std::fmax(0.0, -0.9692660 * X + 1.8760108 * Y + 0.0415560 * Z)),
          static_cast<float>(std::fmax(0.0, 0.0556434 * X - 0.2040259 * Y + 1.0572252 * Z))};
}

/// One quantity (luminance or a chromaticity) over the sky: zenith value and Perez coefficients a .. e, which are
/// linear in turbidity [Preetham1999], appendix A.2.
struct PerezField {
  double a, b, c, d, e, zenith;

  double shape(double cos_zenith_angle, double sun_angle) const {
    const double cosine = std::cos(sun_angle);
    return (1 + a * std::exp(b / std::fmax(cos_zenith_angle, 1e-3))) *
           (1 + c * std::exp(d * sun_angle) + e * cosine * cosine);
  }
};

struct PreethamSky {
  PerezField luminance, x, y;
  double sun_polar;  // radians from the zenith

  PreethamSky(double turbidity, double sun_polar_angle) : sun_polar(sun_polar_angle) {
    const double t = turbidity, s = sun_polar_angle;
    const double chi = (4.0 / 9 - t / 120) * (pi_d - 2 * s);
    luminance = {0.1787 * t - 1.4630,  -0.3554 * t + 0.4275,
                 -0.0227 * t + 5.3251, 0.1206 * t - 2.5771,
                 -0.0670 * t + 0.3703, (4.0453 * t - 4.9710) * std::tan(chi) - 0.2155 * t + 2.4192};
    x = {-0.0193 * t - 0.2592,
         -0.0665 * t + 0.0008,
         -0.0004 * t + 0.2125,
         -0.0641 * t - 0.8989,
         -0.0033 * t + 0.0452,
         t * t * (((0.00166 * s - 0.00375) * s + 0.00209) * s) +
             t * (((-0.02903 * s + 0.06377) * s - 0.03202) * s + 0.00394) +
             (((0.11693 * s - 0.21196) * s + 0.06052) * s + 0.25886)};
    y = {-0.0167 * t - 0.2608,
         -0.0950 * t + 0.0092,
         -0.0079 * t + 0.2102,
         -0.0441 * t - 1.6537,
         -0.0109 * t + 0.0529,
         t * t * (((0.00275 * s - 0.00610) * s + 0.00317) * s) +
             t * (((-0.04214 * s + 0.08970) * s - 0.04153) * s + 0.00516) +
             (((0.15346 * s - 0.26756) * s + 0.06670) * s + 0.26688)};
  }

  Rgb radiance(double cos_zenith_angle, double sun_angle) const {
    const auto value = [&](const PerezField& field) {
      return field.zenith * field.shape(cos_zenith_angle, sun_angle) / field.shape(1, sun_polar);
    };
    return rgb_from_chromaticity(value(x), value(y), value(luminance));
  }
};

/// Colour of sunlight after the atmosphere, luminance 1: Rayleigh scattering and haze at the Rec. 709 primaries'
/// dominant wavelengths [Preetham1999], appendix A.1.
Rgb sun_colour(const SkySettings& settings) {
  const double polar = radians(90 - settings.sun_elevation);
  const double air_mass = 1 / (std::cos(polar) + 0.15 * std::pow(93.885 - (90.0 - settings.sun_elevation), -1.253));
  const double haze = 0.04608 * settings.turbidity - 0.04586;
  const double micrometres[3] = {0.611, 0.549, 0.464};
  Rgb colour;
  for (int c = 0; c < 3; ++c)
    colour[c] = static_cast<float>(std::exp(-0.008735 * std::pow(micrometres[c], -4.08) * air_mass) *
                                   std::exp(-haze * std::pow(micrometres[c], -1.3) * air_mass));
  return colour * (1 / luminance(colour));
}

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
  require(settings.turbidity >= 2 && settings.turbidity <= 10, "turbidity", settings.turbidity, "within 2 and 10");
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

/// Replaces what is below the horizon by ground lit by sky and sun, with a haze that hides the horizon's line.
void paint_ground(Canvas& canvas, const SkySettings& settings, const PreethamSky& sky, float sky_scale, Vec3 sun) {
  const float sun_share = settings.sun_irradiance * max_of(sun.y, 0.0f);
  const Rgb lit = settings.ground * (sun_colour(settings) * sun_share + grey(settings.sky_irradiance)) * inv_pi;
  canvas.for_each([&](Vec3 d, Rgb& pixel, double) {
    if (d.y >= 0) return;
    const Vec3 level = normalize(Vec3{d.x, 0, d.z});
    const Rgb horizon = sky.radiance(0, angle_between(level, sun)) * sky_scale;
    const float ground_share = static_cast<float>(smooth_step(0, radians(8), std::asin(-static_cast<double>(d.y))));
    pixel = horizon * (1 - ground_share) + lit * ground_share;
  });
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
  return sun_colour(settings) * static_cast<float>(settings.sun_irradiance / (pi_d * sine * sine));
}

EnvironmentImage make_sky(const SkySettings& settings, int width, int height, bool include_sun) {
  check(settings);
  if (include_sun && settings.sun_diameter * static_cast<float>(height) < 4 * 180.0f)
    throw Error("sky: a sun of " + std::to_string(settings.sun_diameter) + " degrees is too small for an image of " +
                std::to_string(height) + " rows; use a distant light for it");
  const Vec3 sun = sun_direction(settings, UpAxis::y);
  const PreethamSky sky(settings.turbidity, radians(90 - settings.sun_elevation));
  const double sun_radius = 0.5 * radians(settings.sun_diameter);

  // The sky in the model's own units, and how much it and the sun's profile bring to a plane.
  Canvas canvas(width, height);
  double sky_irradiance = 0, profile_irradiance = 0;
  canvas.for_each([&](Vec3 d, Rgb& pixel, double solid_angle) {
    if (d.y < 0) return;
    const double sun_angle = angle_between(d, sun);
    pixel = sky.radiance(d.y, sun_angle);
    sky_irradiance += luminance(pixel) * d.y * solid_angle;
    profile_irradiance += sun_profile(sun_angle, sun_radius) * std::cos(sun_angle) * solid_angle;
  });
  const auto sky_scale = static_cast<float>(sky_irradiance > 0 ? settings.sky_irradiance / sky_irradiance : 0);
  const auto sun_scale =
      static_cast<float>(include_sun && profile_irradiance > 0 ? settings.sun_irradiance / profile_irradiance : 0);

  const Rgb colour = sun_colour(settings);
  canvas.for_each([&](Vec3 d, Rgb& pixel, double) {
    if (d.y < 0) return;
    const auto profile = static_cast<float>(sun_profile(angle_between(d, sun), sun_radius));
    pixel = pixel * sky_scale + colour * (sun_scale * profile);
  });
  paint_ground(canvas, settings, sky, sky_scale, sun);
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
