#include "image/flip.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "image/separable_filter.h"
#include "image/tone_curve.h"
#include "math/vec.h"

namespace embrun {
namespace {

constexpr double pi = 3.14159265358979323846;

// ---- colours -----------------------------------------------------------------------------------------------------

/// XYZ of linear sRGB relative to the white point, so that white is (1, 1, 1) and grey g is (g, g, g).
Vec3d relative_xyz(Vec3d rgb) {
  constexpr Vec3d white{0.950428545, 1.0, 1.088900371};  // the rows' sums
  return {(10135552.0 * rgb.x + 8788810.0 * rgb.y + 4435075.0 * rgb.z) / 24577794.0 / white.x,
          (2613072.0 * rgb.x + 8788810.0 * rgb.y + 887015.0 * rgb.z) / 12288897.0 / white.y,
          (1425312.0 * rgb.x + 8788810.0 * rgb.y + 70074185.0 * rgb.z) / 73733382.0 / white.z};
}

Vec3d rgb_from_relative_xyz(Vec3d v) {
  const Vec3d xyz{0.950428545 * v.x, v.y, 1.088900371 * v.z};
  return {3.241003275 * xyz.x - 1.537398934 * xyz.y - 0.498615861 * xyz.z,
          -0.969224334 * xyz.x + 1.875930071 * xyz.y + 0.041554224 * xyz.z,
          0.055639423 * xyz.x - 0.204011202 * xyz.y + 1.057148933 * xyz.z};
}

/// The opponent space that the eye's blur works in: L*a*b* without its cube roots.
Vec3d ycc_from_rgb(Vec3d rgb) {
  const Vec3d v = relative_xyz(rgb);
  return {116 * v.y - 16, 500 * (v.x - v.y), 200 * (v.y - v.z)};
}

Vec3d rgb_from_ycc(Vec3d ycc) {
  const double y = (ycc.x + 16) / 116;
  return rgb_from_relative_xyz({y + ycc.y / 500, y, y - ycc.z / 200});
}

/// L*a*b* with colourfulness growing with lightness (Hunt's effect).
Vec3d hunt_lab_from_rgb(Vec3d rgb) {
  const auto f = [](double t) {
    constexpr double delta = 6.0 / 29.0;
    return t > delta * delta * delta ? std::cbrt(t) : t / (3 * delta * delta) + 4.0 / 29.0;
  };
  const Vec3d v = relative_xyz(rgb);
  const double lightness = 116 * f(v.y) - 16;
  return {lightness, 0.01 * lightness * 500 * (f(v.x) - f(v.y)), 0.01 * lightness * 200 * (f(v.y) - f(v.z))};
}

double hyab(Vec3d a, Vec3d b) { return std::abs(a.x - b.x) + std::hypot(a.y - b.y, a.z - b.z); }

/// HyAB distance to an error in [0, 1]: the exponent 0.7, then the lower 40 % of the range spread over 95 %.
double color_error(double distance) {
  constexpr double exponent = 0.7, knee = 0.4, knee_error = 0.95;
  static const double most = std::pow(hyab(hunt_lab_from_rgb({0, 1, 0}), hunt_lab_from_rgb({0, 0, 1})), exponent);
  const double d = std::pow(distance, exponent), at_knee = knee * most;
  if (d < at_knee) return d * knee_error / at_knee;
  return knee_error + (d - at_knee) / (most - at_knee) * (1 - knee_error);
}

// ---- filters -----------------------------------------------------------------------------------------------------

/// One Gaussian term of a contrast sensitivity function: amplitude a and width b (squared degrees times 2 pi^2).
struct Sensitivity {
  double a, b;
};
constexpr Sensitivity achromatic{1, 0.0047}, red_green{1, 0.0053};
constexpr std::array<Sensitivity, 2> blue_yellow{{{34.1, 0.04}, {13.5, 0.025}}};

/// exp(-pi^2 x^2 / b) at whole pixels, out to three deviations of the widest term of all.
FilterTaps sensitivity_taps(double b, double pixels_per_degree) {
  const int radius = static_cast<int>(std::ceil(3 * std::sqrt(blue_yellow[0].b / (2 * pi * pi)) * pixels_per_degree));
  FilterTaps taps;
  for (int i = -radius; i <= radius; ++i) {
    const double x = i / pixels_per_degree;
    taps.push_back(std::exp(-pi * pi * x * x / b));
  }
  return taps;
}

double sum_of(const FilterTaps& taps) {
  double sum = 0;
  for (double w : taps) sum += w;
  return sum;
}

Image blur(const Image& image, double b, double pixels_per_degree) {
  FilterTaps taps = sensitivity_taps(b, pixels_per_degree);
  const double sum = sum_of(taps);
  for (double& w : taps) w /= sum;
  return filter_separably(image, taps, taps);
}

/// The sum of the two terms as one filter of weight 1: each weighs as its volume, a sqrt(pi / b) times its sum squared.
Image blur_blue_yellow(const Image& image, double pixels_per_degree) {
  std::array<double, 2> share{};
  for (std::size_t i = 0; i < 2; ++i) {
    const double sum = sum_of(sensitivity_taps(blue_yellow[i].b, pixels_per_degree));
    share[i] = blue_yellow[i].a * std::sqrt(pi / blue_yellow[i].b) * sum * sum;
  }
  const double all = share[0] + share[1];
  Image out = blur(image, blue_yellow[0].b, pixels_per_degree);
  const Image second = blur(image, blue_yellow[1].b, pixels_per_degree);
  for (std::size_t i = 0; i < out.pixels.size(); ++i) {
    out.pixels[i] = static_cast<float>(
        (share[0] * static_cast<double>(out.pixels[i]) + share[1] * static_cast<double>(second.pixels[i])) / all);
  }
  return out;
}

/// A Gaussian of the width of the eye's edge detector and its first two derivatives. The Gaussian's weights sum to 1,
/// the positive weights of each derivative to 1 and its negative ones to -1.
struct FeatureTaps {
  FilterTaps gaussian, edge, point;
};

FeatureTaps feature_taps(double pixels_per_degree) {
  const double sigma = 0.5 * 0.082 * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  FeatureTaps taps;
  for (int x = -radius; x <= radius; ++x) {
    const double g = std::exp(-x * x / (2 * sigma * sigma));
    taps.gaussian.push_back(g);
    taps.edge.push_back(-x * g);
    taps.point.push_back((x * x / (sigma * sigma) - 1) * g);
  }
  for (FilterTaps* filter : {&taps.gaussian, &taps.edge, &taps.point}) {
    double positive = 0, negative = 0;
    for (double w : *filter) (w > 0 ? positive : negative) += std::abs(w);
    for (double& w : *filter) w /= w > 0 ? positive : w < 0 ? negative : 1.0;
  }
  return taps;
}

// ---- the two parts of the metric ---------------------------------------------------------------------------------

Image magnitude(const Image& x, const Image& y) {
  Image out = make_image(x.width, x.height, 1);
  for (std::size_t i = 0; i < out.pixels.size(); ++i) out.pixels[i] = std::hypot(x.pixels[i], y.pixels[i]);
  return out;
}

/// What is compared of one picture.
struct Perceived {
  std::array<Image, 3> lab;  ///< Hunt-adjusted, of the blurred picture
  Image edges, points;       ///< strength of such features, of the picture as it is
};

Perceived perceive(const Image& display, double pixels_per_degree) {
  std::array<Image, 3> planes;
  for (Image& plane : planes) plane = make_image(display.width, display.height, 1);
  const std::size_t count = display.pixel_count();
  constexpr std::size_t pixels_per_task = 4096;
  parallel_for(count, pixels_per_task, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto linear = [&](std::size_t c) {
        return static_cast<double>(srgb_decode(std::clamp(display.pixels[3 * i + c], 0.0f, 1.0f)));
      };
      const Vec3d ycc = ycc_from_rgb({linear(0), linear(1), linear(2)});
      planes[0].pixels[i] = static_cast<float>(ycc.x);
      planes[1].pixels[i] = static_cast<float>(ycc.y);
      planes[2].pixels[i] = static_cast<float>(ycc.z);
    }
  });

  Perceived seen;
  Image grey = planes[0];
  for (float& v : grey.pixels) v = (v + 16) / 116;
  const FeatureTaps taps = feature_taps(pixels_per_degree);
  seen.edges =
      magnitude(filter_separably(grey, taps.edge, taps.gaussian), filter_separably(grey, taps.gaussian, taps.edge));
  seen.points =
      magnitude(filter_separably(grey, taps.point, taps.gaussian), filter_separably(grey, taps.gaussian, taps.point));

  seen.lab = {blur(planes[0], achromatic.b, pixels_per_degree), blur(planes[1], red_green.b, pixels_per_degree),
              blur_blue_yellow(planes[2], pixels_per_degree)};
  parallel_for(count, pixels_per_task, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto value = [&](std::size_t c) { return static_cast<double>(seen.lab[c].pixels[i]); };
      const Vec3d rgb = rgb_from_ycc({value(0), value(1), value(2)});
      const Vec3d lab =
          hunt_lab_from_rgb({std::clamp(rgb.x, 0.0, 1.0), std::clamp(rgb.y, 0.0, 1.0), std::clamp(rgb.z, 0.0, 1.0)});
      seen.lab[0].pixels[i] = static_cast<float>(lab.x);
      seen.lab[1].pixels[i] = static_cast<float>(lab.y);
      seen.lab[2].pixels[i] = static_cast<float>(lab.z);
    }
  });
  return seen;
}

}  // namespace

Image flip_map(const Image& a, const Image& b, double pixels_per_degree) {
  EMBRUN_CHECK(a.width == b.width && a.height == b.height && a.channels == 3 && b.channels == 3);
  EMBRUN_CHECK(pixels_per_degree > 0);
  const Perceived pa = perceive(a, pixels_per_degree), pb = perceive(b, pixels_per_degree);
  Image map = make_image(a.width, a.height, 1, "flip");
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    const auto lab = [&](const Perceived& p) {
      return Vec3d{static_cast<double>(p.lab[0].pixels[i]), static_cast<double>(p.lab[1].pixels[i]),
                   static_cast<double>(p.lab[2].pixels[i])};
    };
    const double feature = static_cast<double>(std::max(std::abs(pa.edges.pixels[i] - pb.edges.pixels[i]),
                                                        std::abs(pa.points.pixels[i] - pb.points.pixels[i])));
    const double feature_error = std::sqrt(feature / std::sqrt(2.0));
    map.pixels[i] = static_cast<float>(std::pow(color_error(hyab(lab(pa), lab(pb))), 1 - feature_error));
  }
  return map;
}

}  // namespace embrun
