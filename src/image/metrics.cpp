#include "image/metrics.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace embrun {
namespace {

void check_same_shape(const Image& a, const Image& b) {
  EMBRUN_CHECK(a.width == b.width && a.height == b.height && a.channels == b.channels);
}

/// Mean over the channels, in double.
double pixel_value(const Image& image, int x, int y) {
  double sum = 0;
  for (int c = 0; c < image.channels; ++c) {
    sum += static_cast<double>(image.at(x, y, c));
  }
  return sum / image.channels;
}

/// Variance of pixel_value() when the channels are fully correlated: the square of the mean standard error.
double pixel_variance(const Image* variance, int x, int y) {
  if (variance == nullptr) {
    return 0.0;
  }
  double sum = 0;
  for (int c = 0; c < variance->channels; ++c) {
    sum += std::sqrt(std::max(0.0, static_cast<double>(variance->at(x, y, c))));
  }
  const double error = sum / variance->channels;
  return error * error;
}

/// Linear between order statistics of sorted values.
double quantile_of_sorted(const std::vector<double>& sorted, double p) {
  if (sorted.empty()) {
    return 0.0;
  }
  const double place = std::clamp(p, 0.0, 1.0) * static_cast<double>(sorted.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(place), sorted.size() - 1);
  const std::size_t j = std::min(i + 1, sorted.size() - 1);
  return sorted[i] + (place - static_cast<double>(i)) * (sorted[j] - sorted[i]);
}

/// P(|X| <= q) of a normal variable with mean 0.
double normal_share_within(double q, double sigma) { return sigma > 0 ? std::erf(q / (sigma * std::sqrt(2.0))) : 1.0; }

/// The z with P(|Z| <= z) = p of a standard normal variable, by bisection.
double two_sided_z(double p) {
  double low = 0, high = 10;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (normal_share_within(middle, 1.0) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double mean_value(const Image& image) {
  double sum = 0;
  for (float v : image.pixels) {
    sum += static_cast<double>(v);
  }
  return image.pixels.empty() ? 0.0 : sum / static_cast<double>(image.pixels.size());
}

double mean_squared_error(const Image& a, const Image& b) {
  check_same_shape(a, b);
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const double d = static_cast<double>(a.pixels[i]) - static_cast<double>(b.pixels[i]);
    sum += d * d;
  }
  return a.pixels.empty() ? 0.0 : sum / static_cast<double>(a.pixels.size());
}

double root_mean_squared_error(const Image& a, const Image& b) { return std::sqrt(mean_squared_error(a, b)); }

double peak_signal_to_noise(double mean_squared_error) { return -10 * std::log10(mean_squared_error); }

double relative_mean_squared_error(const Image& a, const Image& reference) {
  check_same_shape(a, reference);
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    const double r = static_cast<double>(reference.pixels[i]), d = static_cast<double>(a.pixels[i]) - r;
    sum += d * d / (r * r + 0.01);
  }
  return a.pixels.empty() ? 0.0 : sum / static_cast<double>(a.pixels.size());
}

Estimate mean_ratio(const Image& a, const Image& b, int block_size) {
  check_same_shape(a, b);
  const double mean_b = mean_value(b);
  Estimate result;
  result.value = mean_b != 0.0 ? mean_value(a) / mean_b : 0.0;
  // Ratio estimator: residuals a - ratio * b of the blocks are what is left of the mean's error.
  const std::vector<BlockDifference> blocks = compare_blocks(a, b, nullptr, nullptr, block_size);
  if (blocks.size() > 1 && mean_b != 0.0) {
    const double n = static_cast<double>(blocks.size());
    double sum = 0, squares = 0;
    for (const BlockDifference& block : blocks) {
      const double residual = block.mean_a - result.value * block.mean_b;
      sum += residual;
      squares += residual * residual;
    }
    const double spread = std::max(0.0, squares - sum * sum / n) / (n - 1.0);
    result.standard_error = std::sqrt(spread / n) / std::fabs(mean_b);
  }
  return result;
}

std::vector<BlockDifference> compare_blocks(const Image& a, const Image& b, const Image* variance_a,
                                            const Image* variance_b, int block_size) {
  check_same_shape(a, b);
  for (const Image* variance : {variance_a, variance_b}) {
    EMBRUN_CHECK(variance == nullptr || (variance->width == a.width && variance->height == a.height));
  }
  EMBRUN_CHECK(block_size > 0);
  std::vector<BlockDifference> blocks;
  const double count = static_cast<double>(block_size) * block_size;
  for (int y0 = 0; y0 + block_size <= a.height; y0 += block_size) {
    for (int x0 = 0; x0 + block_size <= a.width; x0 += block_size) {
      BlockDifference block;
      block.x = x0;
      block.y = y0;
      double variance = 0;
      for (int y = y0; y < y0 + block_size; ++y) {
        for (int x = x0; x < x0 + block_size; ++x) {
          block.mean_a += pixel_value(a, x, y) / count;
          block.mean_b += pixel_value(b, x, y) / count;
          variance += pixel_variance(variance_a, x, y) + pixel_variance(variance_b, x, y);
        }
      }
      const double scale = 0.5 * (block.mean_a + block.mean_b);
      if (scale > 0) {
        block.relative = (block.mean_a - block.mean_b) / scale;
        block.standard_error = std::sqrt(variance) / count / scale;
      }
      blocks.push_back(block);
    }
  }
  return blocks;
}

double block_quantile(const std::vector<BlockDifference>& blocks, double p) {
  std::vector<double> values;
  values.reserve(blocks.size());
  for (const BlockDifference& block : blocks) {
    values.push_back(std::fabs(block.relative));
  }
  std::sort(values.begin(), values.end());
  return quantile_of_sorted(values, p);
}

double block_rms(const std::vector<BlockDifference>& blocks) {
  double sum = 0;
  for (const BlockDifference& block : blocks) {
    sum += block.relative * block.relative;
  }
  return blocks.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(blocks.size()));
}

double block_noise_rms(const std::vector<BlockDifference>& blocks) {
  double sum = 0;
  for (const BlockDifference& block : blocks) {
    sum += block.standard_error * block.standard_error;
  }
  return blocks.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(blocks.size()));
}

double share_within(const std::vector<BlockDifference>& blocks, double tolerance, double sigmas) {
  std::size_t within = 0;
  for (const BlockDifference& block : blocks) {
    within += std::fabs(block.relative) <= tolerance + sigmas * block.standard_error ? 1u : 0u;
  }
  return blocks.empty() ? 1.0 : static_cast<double>(within) / static_cast<double>(blocks.size());
}

double noise_free_quantile(const std::vector<BlockDifference>& blocks, double p) {
  const double observed = block_quantile(blocks, p);
  if (blocks.empty() || observed <= 0) {
    return observed;
  }
  const double z = two_sided_z(p);
  // Share of the blocks expected within the observed quantile, were the true differences normal with quantile t.
  const auto share = [&](double t) {
    double sum = 0;
    for (const BlockDifference& block : blocks) {
      sum += normal_share_within(observed, std::hypot(t / z, block.standard_error));
    }
    return sum / static_cast<double>(blocks.size());
  };
  if (share(0.0) <= p) {
    return 0.0;
  }
  double low = 0, high = 2 * observed;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (share(middle) > p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace embrun
