#include "image/noise_split.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/error.h"

namespace embrun {
namespace {

double square(double v) { return v * v; }

/// The 0.975 quantile of Student's t distribution with nu degrees of freedom [Abramowitz1964], 26.7.5.
double student_t_975(double nu) {
  constexpr double z = 1.959963984540054;
  const double z3 = z * z * z, z5 = z3 * z * z;
  return z + (z3 + z) / (4 * nu) + (5 * z5 + 16 * z3 + 3 * z) / (96 * nu * nu);
}

/// Sums over one block of the picture's values.
struct BlockSum {
  double sum = 0;
  double count = 0;
};

/// The mean of all values with the interval that the spread of the blocks gives (a ratio estimate: blocks at the edges
/// have fewer values).
Interval mean_of_blocks(const std::vector<BlockSum>& blocks) {
  double sum = 0, count = 0;
  for (const BlockSum& block : blocks) {
    sum += block.sum;
    count += block.count;
  }
  const double mean = sum / count;
  double squares = 0;
  for (const BlockSum& block : blocks) squares += square(block.sum - mean * block.count);
  const double n = static_cast<double>(blocks.size());
  const double reach = student_t_975(n - 1) * std::sqrt(squares * n / (n - 1)) / count;
  return {mean, std::max(0.0, mean - reach), std::max(0.0, mean + reach)};
}

/// The value of the half where there is one, else the picture's own.
double second_value(const NoisyPicture& picture, std::size_t i) {
  return static_cast<double>((picture.half != nullptr ? picture.half : picture.values)->pixels[i]);
}

double known_variance(const NoisyPicture& picture, std::size_t i) {
  return picture.variance != nullptr ? static_cast<double>(picture.variance->pixels[i]) : 0.0;
}

void check_shape(const NoisyPicture& picture, const Image& like) {
  EMBRUN_CHECK(picture.values != nullptr && (picture.half == nullptr || picture.variance == nullptr));
  for (const Image* image : {picture.values, picture.half, picture.variance}) {
    EMBRUN_CHECK(image == nullptr ||
                 (image->width == like.width && image->height == like.height && image->channels == like.channels));
  }
}

}  // namespace

SquaredErrorSplit split_squared_error(const NoisyPicture& a, const NoisyPicture& b) {
  const Image& like = *a.values;
  check_shape(a, like);
  check_shape(b, like);
  EMBRUN_CHECK(like.pixel_count() >= 2 && like.channels > 0);
  const bool many = like.pixel_count() >= std::size_t{64} * 64;
  const int side = many ? 8 : 1;
  const int columns = (like.width + side - 1) / side, rows = (like.height + side - 1) / side;
  std::vector<BlockSum> difference(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
  std::vector<BlockSum> noise = difference;
  SquaredErrorSplit split;
  for (int y = 0; y < like.height; ++y) {
    for (int x = 0; x < like.width; ++x) {
      const auto block =
          static_cast<std::size_t>(y / side) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x / side);
      for (int c = 0; c < like.channels; ++c) {
        const std::size_t i = like.index(x, y, c);
        const double first = static_cast<double>(a.values->pixels[i]) - static_cast<double>(b.values->pixels[i]);
        const double total = first * first;
        const double bias =
            first * (second_value(a, i) - second_value(b, i)) - known_variance(a, i) - known_variance(b, i);
        split.total += total;
        difference[block].sum += bias;
        noise[block].sum += total - bias;
        difference[block].count += 1;
        noise[block].count += 1;
      }
    }
  }
  split.total /= static_cast<double>(like.pixels.size());
  split.difference = mean_of_blocks(difference);
  split.noise = mean_of_blocks(noise);
  return split;
}

Image display_variance(const Image& radiance, const Image& variance, const ToneSettings& settings) {
  EMBRUN_CHECK(radiance.channels == 3 && variance.channels == 3 && radiance.pixels.size() == variance.pixels.size());
  Image out = make_image(radiance.width, radiance.height, 3, "variance");
  const float far = std::sqrt(3.0f);
  for (std::size_t i = 0; i < out.pixels.size(); i += 3) {
    const Rgb mean{radiance.pixels[i], radiance.pixels[i + 1], radiance.pixels[i + 2]};
    const auto deviation = [&](std::size_t c) { return far * std::sqrt(std::max(0.0f, variance.pixels[i + c])); };
    const Rgb step{deviation(0), deviation(1), deviation(2)};
    const Rgb low = tone_map(mean - step, settings), middle = tone_map(mean, settings),
              high = tone_map(mean + step, settings);
    for (int c = 0; c < 3; ++c) {
      const double m =
          (static_cast<double>(low[c]) + 4 * static_cast<double>(middle[c]) + static_cast<double>(high[c])) / 6;
      out.pixels[i + static_cast<std::size_t>(c)] =
          static_cast<float>((square(static_cast<double>(low[c]) - m) + 4 * square(static_cast<double>(middle[c]) - m) +
                              square(static_cast<double>(high[c]) - m)) /
                             6);
    }
  }
  return out;
}

Image variance_of_halves(const Image& a, const Image& b) {
  EMBRUN_CHECK(a.pixels.size() == b.pixels.size());
  Image out = make_image(a.width, a.height, a.channels, "variance");
  for (std::size_t i = 0; i < out.pixels.size(); ++i) {
    out.pixels[i] =
        static_cast<float>(0.5 * square(static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i])));
  }
  return out;
}

}  // namespace embrun
