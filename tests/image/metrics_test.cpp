#include "image/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace embrun {
namespace {

Image filled(int width, int height, float value) {
  Image image = make_image(width, height, 3);
  image.pixels.assign(image.pixels.size(), value);
  return image;
}

TEST(Metrics, ErrorsOfKnownPictures) {
  Image a = filled(2, 2, 1.0f), b = filled(2, 2, 1.0f);
  a.at(0, 0, 0) = 4.0f;  // one of twelve values is off by 3
  EXPECT_DOUBLE_EQ(mean_value(a), 15.0 / 12.0);
  EXPECT_DOUBLE_EQ(mean_squared_error(a, b), 9.0 / 12.0);
  EXPECT_DOUBLE_EQ(root_mean_squared_error(a, b), std::sqrt(0.75));
  EXPECT_EQ(mean_squared_error(a, a), 0.0);
}

TEST(Metrics, PeakSignalToNoise) {
  EXPECT_NEAR(peak_signal_to_noise(0.01), 20.0, 1e-12);
  EXPECT_NEAR(peak_signal_to_noise(1.0), 0.0, 1e-12);
  EXPECT_TRUE(std::isinf(peak_signal_to_noise(0.0)));
}

TEST(Metrics, RelativeErrorsCountByTheReference) {
  Image a = filled(2, 1, 0.1f), b = filled(2, 1, 0.0f);
  for (int c = 0; c < 3; ++c) {
    a.at(1, 0, c) = 1.5f;
    b.at(1, 0, c) = 1.0f;
  }
  // 0.1^2 / 0.01 beside black, 0.5^2 / 1.01 beside 1.
  EXPECT_NEAR(relative_mean_squared_error(a, b), 0.5 * (1.0 + 0.25 / 1.01), 1e-6);
}

TEST(Metrics, BlocksAreRelativeToTheirOwnMean) {
  Image a = filled(17, 9, 0.5f), b = filled(17, 9, 0.5f);  // two whole blocks; the rim is left out
  for (int y = 0; y < 8; ++y) {
    for (int x = 8; x < 16; ++x) {
      for (int c = 0; c < 3; ++c) {
        a.at(x, y, c) = 0.03f;
        b.at(x, y, c) = 0.01f;
      }
    }
  }
  const auto blocks = compare_blocks(a, b);
  ASSERT_EQ(blocks.size(), 2u);
  EXPECT_EQ(blocks[0].relative, 0.0);
  EXPECT_NEAR(blocks[1].relative, 1.0, 1e-6);  // 0.02 / 0.02
  EXPECT_EQ(blocks[1].x, 8);
  EXPECT_NEAR(block_quantile(blocks, 0.5), 0.5, 1e-6);
  EXPECT_NEAR(block_rms(blocks), std::sqrt(0.5), 1e-6);
  EXPECT_TRUE(compare_blocks(filled(7, 7, 1), filled(7, 7, 1)).empty());
  EXPECT_EQ(compare_blocks(filled(8, 8, 0), filled(8, 8, 0))[0].relative, 0.0);
}

/// Noisy copies of a picture: value 1 with independent normal noise per pixel, the same in all channels, and a
/// true relative difference per block of the given deviation.
struct NoisyPair {
  Image a, b, variance_a, variance_b;

  NoisyPair(double noise, double true_difference, unsigned seed) {
    constexpr int size = 256;
    a = b = variance_a = variance_b = filled(size, size, 0);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    for (int y0 = 0; y0 < size; y0 += 8) {
      for (int x0 = 0; x0 < size; x0 += 8) {
        const double offset = true_difference * normal(random);
        for (int y = y0; y < y0 + 8; ++y) {
          for (int x = x0; x < x0 + 8; ++x) {
            const double noise_a = noise * normal(random), noise_b = noise * normal(random);
            for (int c = 0; c < 3; ++c) {
              a.at(x, y, c) = static_cast<float>(1.0 + offset + noise_a);
              b.at(x, y, c) = static_cast<float>(1.0 + noise_b);
              variance_a.at(x, y, c) = variance_b.at(x, y, c) = static_cast<float>(noise * noise);
            }
          }
        }
      }
    }
  }
  std::vector<BlockDifference> blocks() const { return compare_blocks(a, b, &variance_a, &variance_b); }
};

TEST(Metrics, StandardErrorOfABlockIsThatOfItsDifference) {
  // 64 pixels of noise 0.2 in both pictures: the difference of the means has deviation 0.2 sqrt(2 / 64) = 0.03536.
  const NoisyPair pair(0.2, 0.0, 3);
  const auto blocks = pair.blocks();
  EXPECT_NEAR(block_noise_rms(blocks), 0.035355, 0.0005);
  EXPECT_NEAR(block_rms(blocks), 0.035355, 4 * 0.035355 / std::sqrt(2.0 * 1024));
}

TEST(Metrics, PureNoiseIsWithinZeroToleranceAtTheNormalRate) {
  const auto blocks = NoisyPair(0.2, 0.0, 4).blocks();
  // P(|Z| <= 2) = 0.9545; of 1024 blocks the share has deviation 0.0065.
  EXPECT_NEAR(share_within(blocks, 0.0, 2.0), 0.9545, 4 * 0.0065);
  EXPECT_LT(share_within(blocks, 0.0, 1.0), 0.75);  // 0.683
  EXPECT_LT(noise_free_quantile(blocks, 0.95), 0.03);
}

TEST(Metrics, ATrueDifferenceBeyondTheToleranceShows) {
  // True differences of deviation 0.05 with noise 0.0354 per block: 95 % of the true ones are within 0.098.
  const auto blocks = NoisyPair(0.2, 0.05, 5).blocks();
  EXPECT_LT(share_within(blocks, 0.025, 1.0), 0.75);  // P(|N(0, 0.0612)| <= 0.0604) = 0.676
  EXPECT_NEAR(noise_free_quantile(blocks, 0.95), 1.96 * 0.05, 0.012);
  EXPECT_NEAR(block_quantile(blocks, 0.95), 1.96 * 0.06124, 0.01);
}

TEST(Metrics, WithoutNoiseTheQuantileIsTheObservedOne) {
  const auto blocks = NoisyPair(0.0, 0.05, 6).blocks();
  const double observed = block_quantile(blocks, 0.95);
  EXPECT_NEAR(noise_free_quantile(blocks, 0.95), observed, 0.15 * observed);
  EXPECT_EQ(share_within({}, 0.0), 1.0);
  EXPECT_EQ(noise_free_quantile({}, 0.95), 0.0);
}

TEST(Metrics, MeanRatioAndItsError) {
  NoisyPair pair(0.2, 0.0, 7);
  for (float& v : pair.a.pixels) {
    v *= 1.05f;
  }
  const Estimate ratio = mean_ratio(pair.a, pair.b);
  // 65536 pixels: errors 0.2 / 256 of each mean; the ratio's is 1.05 sqrt(2) 0.2 / 256 = 0.00116.
  EXPECT_NEAR(ratio.value, 1.05, 4 * 0.00116);
  EXPECT_NEAR(ratio.standard_error, 0.00116, 0.0002);
}

}  // namespace
}  // namespace embrun
