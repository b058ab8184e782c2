#include "lights/environment_image.h"

#include <cmath>
#include <string>
#include <utility>

#include "base/error.h"

namespace embrun {
namespace {

/// Luminance of each pixel, averaged over the bilinear surface within the pixel, times the pixel's solid angle.
/// Averaging also gives every pixel that a bright neighbour's interpolation reaches its share, so no radiance is
/// without a density.
std::vector<float> sampling_weights(const Environment& env) {
  const int w = env.width, h = env.height;
  const auto luminance_at = [&](int x, int y) {
    const int column = (x + w) % w;
    const int row = min_of(max_of(y, 0), h - 1);
    return luminance(environment_pixel(env, column, row));
  };
  // Mean over the unit square round its centre of the tent that reaches to the neighbours' centres.
  constexpr float side = 0.125f, middle = 0.75f;
  std::vector<float> weights(static_cast<size_t>(w) * static_cast<size_t>(h));
  size_t i = 0;
  for (int y = 0; y < h; ++y) {
    const float solid_angle = latlong_pixel_solid_angle(env, y);
    for (int x = 0; x < w; ++x) {
      float sum = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        const float row =
            side * (luminance_at(x - 1, y + dy) + luminance_at(x + 1, y + dy)) + middle * luminance_at(x, y + dy);
        sum += row * (dy == 0 ? middle : side);
      }
      weights[i++] = sum * solid_angle;
    }
  }
  return weights;
}

}  // namespace

EnvironmentImage::EnvironmentImage(int width, int height, std::vector<float> rgb)
    : width_(width), height_(height), rgb_(std::move(rgb)) {
  if (width <= 0 || height <= 0)
    throw Error("environment image: its size " + std::to_string(width) + "x" + std::to_string(height) +
                " is not positive");
  if (rgb_.size() != 3 * static_cast<size_t>(width) * static_cast<size_t>(height))
    throw Error("environment image: " + std::to_string(rgb_.size()) + " values do not make " + std::to_string(width) +
                "x" + std::to_string(height) + " RGB pixels");
  // Single values up to the largest float would overflow in sums; nothing real comes near this limit.
  constexpr float largest = 1e15f;
  for (float& v : rgb_) {
    if (v >= 0 && v <= largest) continue;
    v = 0;
    ++bad_values_;
  }

  const Environment env = view(UpAxis::y);
  pixels_ = DistributionTable(sampling_weights(env), width, height);
  double sum[3] = {0, 0, 0};
  for (int y = 0; y < height; ++y) {
    double row[3] = {0, 0, 0};
    for (int x = 0; x < width; ++x) {
      const Rgb pixel = environment_pixel(env, x, y);
      for (int c = 0; c < 3; ++c) row[c] += pixel[c];
    }
    for (int c = 0; c < 3; ++c) sum[c] += row[c] * latlong_pixel_solid_angle(env, y);
  }
  for (int c = 0; c < 3; ++c) mean_radiance_[c] = static_cast<float>(sum[c] / (4 * M_PI));
}

Environment EnvironmentImage::view(UpAxis up, float turn) const {
  Environment env;
  env.kind = width_ > 0 ? EnvironmentKind::image : EnvironmentKind::none;
  env.rgb = rgb_.data();
  env.width = width_;
  env.height = height_;
  if (!pixels_.empty()) env.pixels = pixels_.view();
  env.basis = up_basis(up);
  env.turn = turn;
  return env;
}

}  // namespace embrun
