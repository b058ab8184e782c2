#include "image/noise_split.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "image/metrics.h"

namespace embrun {
namespace {

Image picture(int width, int height, std::vector<float> values) {
  Image image = make_image(width, height, 1);
  image.pixels = std::move(values);
  return image;
}

// Differences (0.5, 0) and, of the halves, (0.75, -0.25): MSE (0.25 + 0) / 2, product (0.375 + 0) / 2.
TEST(NoiseSplit, HalvesMultiplyDifferences) {
  const Image a = picture(2, 1, {1.0f, 2.0f}), half_a = picture(2, 1, {1.25f, 1.75f});
  const Image b = picture(2, 1, {0.5f, 2.0f}), half_b = picture(2, 1, {0.5f, 2.0f});
  const SquaredErrorSplit split = split_squared_error({&a, &half_a, nullptr}, {&b, &half_b, nullptr});
  EXPECT_DOUBLE_EQ(split.total, 0.125);
  EXPECT_DOUBLE_EQ(split.difference.value, 0.1875);
  EXPECT_DOUBLE_EQ(split.noise.value, 0.125 - 0.1875);
  // Without b's half the factors are the same here; without any, all of it is difference.
  EXPECT_DOUBLE_EQ(split_squared_error({&a, &half_a, nullptr}, {&b, nullptr, nullptr}).difference.value, 0.1875);
  EXPECT_DOUBLE_EQ(split_squared_error({&a, nullptr, nullptr}, {&b, nullptr, nullptr}).difference.value, 0.125);
}

TEST(NoiseSplit, VariancesAreSubtracted) {
  const Image a = picture(2, 1, {1.0f, 2.0f}), b = picture(2, 1, {0.5f, 2.0f});
  const Image variance_a = picture(2, 1, {0.0625f, 0.0f}), variance_b = picture(2, 1, {0.0f, 0.03125f});
  const SquaredErrorSplit split = split_squared_error({&a, nullptr, &variance_a}, {&b, nullptr, &variance_b});
  EXPECT_DOUBLE_EQ(split.difference.value, 0.125 - 0.046875);
  EXPECT_DOUBLE_EQ(split.noise.value, 0.046875);
}

// Two pixels with the products 0.1 and 0.3: mean 0.2, standard error 0.1; Student's t for one degree of freedom is 12.7
// (the expansion gives less there: at least 7). The interval ends at 0.
TEST(NoiseSplit, FewPixelsTellLittle) {
  const Image a = picture(2, 1, {std::sqrt(0.1f), std::sqrt(0.3f)}), b = picture(2, 1, {0, 0});
  const SquaredErrorSplit split = split_squared_error({&a, nullptr, nullptr}, {&b, nullptr, nullptr});
  EXPECT_NEAR(split.difference.value, 0.2, 1e-6);
  EXPECT_EQ(split.difference.low, 0.0);
  EXPECT_GT(split.difference.high, 0.2 + 7 * 0.1);
  EXPECT_LT(split.difference.high, 0.2 + 12.8 * 0.1);
}

/// Two true pictures and renders of them: means of so many samples of an exponential distribution, which is skewed,
/// with variances as a film estimates them.
class Experiment {
 public:
  static constexpr int size = 64, samples = 4;
  Image a = make_image(size, size, 1), b = a, half_a = a, half_b = a, variance_a = a, variance_b = a;
  double true_difference = 0;  ///< mean square

  /// difference(x, y): of the true values, relative to a's of 0.5.
  template <class Difference>
  explicit Experiment(const Difference& difference) {
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const double d = 0.5 * difference(x, y);
        true_a_.push_back(0.5);
        true_b_.push_back(0.5 - d);
        true_difference += d * d / (size * size);
      }
    }
  }

  /// `common`: a and b are made of the same random numbers, and so are their halves.
  void render(std::mt19937& random, bool with_halves, bool common) {
    for (std::size_t i = 0; i < true_a_.size(); ++i) {
      if (with_halves) render_pixels(half_a, half_b, i, random, common);
      render_pixels(a, b, i, random, common);
    }
  }

  /// The pictures with their halves or with their variances.
  SquaredErrorSplit split(bool with_halves) const {
    if (with_halves) return split_squared_error({&a, &half_a, nullptr}, {&b, &half_b, nullptr});
    return split_squared_error({&a, nullptr, &variance_a}, {&b, nullptr, &variance_b});
  }

 private:
  /// Mean and estimated variance of the mean of samples whose mean is 1.
  struct Draw {
    double mean, variance;
  };

  static Draw draw(std::mt19937& random) {
    double sum = 0, squares = 0;
    for (int s = 0; s < samples; ++s) {
      const double v = -std::log((static_cast<double>(random()) + 0.5) * 0x1p-32);
      sum += v;
      squares += v * v;
    }
    return {sum / samples, (squares - sum * sum / samples) / (samples - 1) / samples};
  }

  void render_pixels(Image& first, Image& second, std::size_t i, std::mt19937& random, bool common) {
    const Draw of_a = draw(random), of_b = common ? of_a : draw(random);
    first.pixels[i] = static_cast<float>(true_a_[i] * of_a.mean);
    second.pixels[i] = static_cast<float>(true_b_[i] * of_b.mean);
    variance_a.pixels[i] = static_cast<float>(true_a_[i] * true_a_[i] * of_a.variance);
    variance_b.pixels[i] = static_cast<float>(true_b_[i] * true_b_[i] * of_b.variance);
  }

  std::vector<double> true_a_, true_b_;
};

struct Coverage {
  double share = 0;       ///< of the intervals that hold the true difference
  double mean = 0;        ///< of the estimates
  double deviations = 0;  ///< of the mean estimate from the truth, in standard errors
};

Coverage repeat(Experiment experiment, bool halves, bool common, unsigned seed) {
  constexpr int trials = 200;
  std::mt19937 random(seed);
  double sum = 0, squares = 0;
  int held = 0;
  for (int t = 0; t < trials; ++t) {
    experiment.render(random, halves, common);
    const SquaredErrorSplit split = experiment.split(halves);
    EXPECT_NEAR(split.difference.value + split.noise.value, split.total, 1e-12);
    const Interval& d = split.difference;
    held += d.low <= experiment.true_difference && experiment.true_difference <= d.high ? 1 : 0;
    sum += d.value;
    squares += d.value * d.value;
  }
  Coverage result;
  result.share = held / static_cast<double>(trials);
  result.mean = sum / trials;
  const double error = std::sqrt((squares / trials - result.mean * result.mean) / (trials - 1));
  result.deviations = (result.mean - experiment.true_difference) / error;
  return result;
}

// Of 200 intervals at 95 % the share has a standard error of 0.0154; four of them are 0.062.
TEST(NoiseSplit, IntervalsHoldTheTruth) {
  const auto even = [](int, int) { return 0.1; };
  const auto uneven = [](int x, int y) { return x >= 16 && x < 24 && y < 32 ? 0.4 : 0.0; };
  const auto none = [](int, int) { return 0.0; };
  for (const bool halves : {true, false}) {
    const Coverage of_even = repeat(Experiment(even), halves, false, 1);
    EXPECT_NEAR(of_even.share, 0.95, 0.062) << halves;
    EXPECT_LT(std::abs(of_even.deviations), 4) << halves;
    // A difference in one place: the interval may be too wide, not too narrow.
    const Coverage of_uneven = repeat(Experiment(uneven), halves, false, 2);
    EXPECT_GE(of_uneven.share, 0.95 - 0.062) << halves;
    EXPECT_LT(std::abs(of_uneven.deviations), 4) << halves;
    // An interval that ends at 0 holds 0 whenever the estimate is low: 97.5 %.
    const Coverage of_none = repeat(Experiment(none), halves, false, 3);
    EXPECT_NEAR(of_none.share, 0.975, 0.045) << halves;
    EXPECT_LT(std::abs(of_none.deviations), 4) << halves;
  }
}

// The same random numbers in both pictures: halves see through it; variances do not know, and take off too much.
TEST(NoiseSplit, CommonRandomNumbersNeedHalves) {
  const auto even = [](int, int) { return 0.1; };
  const Coverage halves = repeat(Experiment(even), true, true, 4);
  EXPECT_NEAR(halves.share, 0.95, 0.062);
  EXPECT_LT(std::abs(halves.deviations), 4);
  const Coverage variances = repeat(Experiment(even), false, true, 5);
  EXPECT_LT(variances.deviations, -20);
}

// Noise of 0.5 / 2 in one and 0.45 / 2 in the other: the part of the MSE that it makes.
TEST(NoiseSplit, TheNoiseIsWhatWasPutIn) {
  Experiment experiment([](int, int) { return 0.1; });
  std::mt19937 random(6);
  experiment.render(random, true, false);
  const double expected = (0.5 * 0.5 + 0.45 * 0.45) / Experiment::samples;
  for (const bool halves : {true, false}) {
    const SquaredErrorSplit split = experiment.split(halves);
    EXPECT_LE(split.noise.low, expected);
    EXPECT_GE(split.noise.high, expected);
    EXPECT_LT(split.noise.high - split.noise.low, 0.25 * expected);
  }
}

TEST(NoiseSplit, VarianceOfHalves) {
  const Image v = variance_of_halves(picture(2, 1, {1.0f, 2.0f}), picture(2, 1, {1.5f, 2.0f}));
  EXPECT_EQ(v.pixels[0], 0.125f);
  EXPECT_EQ(v.pixels[1], 0.0f);
}

// ---- through the tone curve --------------------------------------------------------------------------------------

Image colour(Rgb c) {
  Image image = make_image(1, 1, 3);
  image.pixels = {c.r, c.g, c.b};
  return image;
}

// The sRGB curve starts with slope 12.92; at 0.2 its slope is 1.055 / 2.4 0.2^(1/2.4 - 1) = 1.12406.
TEST(DisplayVariance, SmallNoiseGrowsByTheSlopeOfTheCurve) {
  const ToneSettings srgb{0, ToneCurve::srgb, false};
  const Image linear = display_variance(colour({1e-3f, 1e-3f, 1e-3f}), colour({1e-8f, 4e-8f, 0}), srgb);
  EXPECT_NEAR(linear.pixels[0], 12.92 * 12.92 * 1e-8, 1e-9);
  EXPECT_NEAR(linear.pixels[1], 12.92 * 12.92 * 4e-8, 4e-9);
  EXPECT_EQ(linear.pixels[2], 0.0f);
  const Image middle = display_variance(colour({0.2f, 0.2f, 0.2f}), colour({1e-4f, 1e-4f, 1e-4f}), srgb);
  EXPECT_NEAR(middle.pixels[0], 1.12406 * 1.12406 * 1e-4, 0.01 * 1.2635e-4);
  const Image exposed =
      display_variance(colour({0.1f, 0.1f, 0.1f}), colour({2.5e-5f, 2.5e-5f, 2.5e-5f}), {1, ToneCurve::srgb, false});
  EXPECT_NEAR(exposed.pixels[0], middle.pixels[0], 1e-8);
}

// Noise of a fifth, through the filmic curve: against 10^5 drawn colours, whose variance has an error of 0.5 %. The
// rule of three points is exact for curves that are straight or quadratic there; these nearly are.
TEST(DisplayVariance, OfTheFilmicCurveIsThatOfDrawnColours) {
  const Rgb mean{0.3f, 0.8f, 0.1f}, deviation{0.06f, 0.16f, 0.02f};
  const ToneSettings filmic{0, ToneCurve::filmic, false};
  const Image got = display_variance(
      colour(mean), colour({deviation.r * deviation.r, deviation.g * deviation.g, deviation.b * deviation.b}), filmic);
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  constexpr int count = 100000;
  double sum[3] = {}, squares[3] = {};
  for (int i = 0; i < count; ++i) {
    const Rgb v = tone_map(mean + deviation * normal(random), filmic);
    for (int c = 0; c < 3; ++c) {
      sum[c] += static_cast<double>(v[c]);
      squares[c] += static_cast<double>(v[c]) * static_cast<double>(v[c]);
    }
  }
  for (int c = 0; c < 3; ++c) {
    const double variance = squares[c] / count - sum[c] / count * sum[c] / count;
    EXPECT_NEAR(got.pixels[static_cast<std::size_t>(c)], variance, 0.05 * variance) << c;
  }
}

}  // namespace
}  // namespace embrun
