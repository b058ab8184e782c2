#include "sampling/sobol.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "sampling/sampler.h"

namespace embrun {
namespace {

TEST(ReverseBits, AgreesWithTheDefinition) {
  for (const uint32_t v : {0u, 1u, 0x80000000u, 0x12345678u, 0xdeadbeefu, 0xffffffffu}) {
    uint32_t expected = 0;
    for (int bit = 0; bit < 32; ++bit)
      if (v >> bit & 1u) expected |= 1u << (31 - bit);
    EXPECT_EQ(reverse_bits(v), expected);
  }
}

// First points of the two-dimensional Sobol sequence, by hand: x is the radical inverse of the index; y's digits are
// the index's times the Pascal triangle modulo 2.
TEST(Sobol, FirstPoints) {
  const double x[8] = {0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875};
  const double y[8] = {0, 0.5, 0.75, 0.25, 0.625, 0.125, 0.375, 0.875};
  for (uint32_t i = 0; i < 8; ++i) {
    EXPECT_EQ(reverse_bits(i) * 0x1p-32, x[i]);
    EXPECT_EQ(reverse_bits(sobol_second_reversed(i)) * 0x1p-32, y[i]);
  }
}

// Digit k of y (k = 0 the most significant) is the sum over the index's digits j of binomial(j, k), modulo 2.
TEST(Sobol, SecondCoordinateIsThePascalMatrix) {
  for (const uint32_t index : {1u, 2u, 77u, 0x9e3779b9u, 0xffffffffu}) {
    uint32_t expected = 0;
    for (unsigned k = 0; k < 32; ++k) {
      unsigned digit = 0;
      for (unsigned j = k; j < 32; ++j) digit ^= (index >> j & 1u) & ((k & ~j) == 0 ? 1u : 0u);  // Lucas's theorem
      expected |= digit << k;
    }
    EXPECT_EQ(sobol_second_reversed(index), expected);
  }
}

TEST(OwenShuffle, IsAPermutationOfEveryAlignedBlock) {
  for (const uint32_t seed : {0u, 1u, 0x1234567u, 0xffffffffu})
    for (const uint32_t block : {0u, 5u}) {
      std::set<uint32_t> images, blocks;
      for (uint32_t i = 0; i < 256; ++i) {
        images.insert(owen_shuffle(block * 256 + i, seed));
        blocks.insert(owen_shuffle(block * 256 + i, seed) >> 8);
      }
      EXPECT_EQ(images.size(), 256u);
      EXPECT_EQ(blocks.size(), 1u);
    }
}

/// True when 2^k points have exactly one in each of the 2^k boxes of every shape 2^-a by 2^-(k-a).
bool stratified_in_all_elementary_intervals(const std::vector<Sample2>& points, int k) {
  for (int a = 0; a <= k; ++a) {
    const float columns = std::ldexp(1.0f, a), rows = std::ldexp(1.0f, k - a);
    std::vector<bool> taken(points.size());
    for (const Sample2 p : points) {
      const auto box =
          static_cast<size_t>(p.y * rows) * static_cast<size_t>(columns) + static_cast<size_t>(p.x * columns);
      if (taken[box]) return false;
      taken[box] = true;
    }
  }
  return true;
}

TEST(SobolSampler, StratifiedInAllElementaryIntervals) {
  for (int k = 0; k <= 12; ++k)
    for (uint32_t pixel = 0; pixel < 8; ++pixel) {
      // The first points, and the next as many: rendering goes on in aligned blocks.
      for (const uint32_t block : {0u, 1u, 6u}) {
        std::vector<Sample2> points;
        for (uint32_t i = 0; i < 1u << k; ++i)
          points.push_back(sample_2d(SamplerKind::sobol, {pixel * 77, pixel, (block << k) + i, pixel % 3},
                                     Dimension::light_position));
        EXPECT_TRUE(stratified_in_all_elementary_intervals(points, k)) << "k " << k << " pixel " << pixel;
      }
    }
}

TEST(SobolSampler, OneDimensionStratified) {
  for (int k = 0; k <= 12; ++k) {
    std::set<uint32_t> strata;
    for (uint32_t i = 0; i < 1u << k; ++i)
      strata.insert(
          static_cast<uint32_t>(std::ldexp(sample_1d(SamplerKind::sobol, {3, 1234, i, 2}, Dimension::roulette), k)));
    EXPECT_EQ(strata.size(), size_t{1} << k);
  }
}

// The test above must be able to fail: independent numbers are not stratified.
TEST(SobolSampler, IndependentNumbersAreNotStratified) {
  std::vector<Sample2> points;
  for (uint32_t i = 0; i < 64; ++i)
    points.push_back(sample_2d(SamplerKind::independent, {1, 2, i, 0}, Dimension::camera_film));
  EXPECT_FALSE(stratified_in_all_elementary_intervals(points, 6));
}

/// Root mean square error, over many pixels, of the mean of f over n samples.
template <class F>
double integration_error(SamplerKind kind, int n, double truth, F f) {
  constexpr uint32_t pixels = 400;
  double sum = 0;
  for (uint32_t pixel = 0; pixel < pixels; ++pixel) {
    double mean = 0;
    for (uint32_t i = 0; i < static_cast<uint32_t>(n); ++i)
      mean += f(sample_2d(kind, {11, pixel, i, 1}, Dimension::bsdf_direction)) / n;
    sum += (mean - truth) * (mean - truth);
  }
  return std::sqrt(sum / pixels);
}

// f = exp(x + y) / (e - 1)^2 integrates to 1. Owen-scrambled nets have a variance of O(n^-3 log n) for smooth
// functions: the error falls by nearly 8 from n to 4 n; independent numbers' by 2.
TEST(SobolSampler, ErrorFallsMuchFasterThanTheSquareRoot) {
  const double e1 = std::exp(1.0) - 1;
  const auto f = [e1](Sample2 u) { return std::exp(static_cast<double>(u.x) + u.y) / (e1 * e1); };
  const double at_64 = integration_error(SamplerKind::sobol, 64, 1, f);
  const double at_1024 = integration_error(SamplerKind::sobol, 1024, 1, f);
  EXPECT_LT(at_1024, at_64 / 16) << at_64 << " " << at_1024;  // square root: 4
  const double independent = integration_error(SamplerKind::independent, 64, 1, f);
  EXPECT_LT(at_64, independent / 10);
  // Var f = ((e^2 - 1)/2)^2 / (e - 1)^4 - 1 = 0.1708.
  EXPECT_NEAR(independent, std::sqrt((std::pow((std::exp(2.0) - 1) / 2, 2) / std::pow(e1, 4) - 1) / 64),
              0.1 * independent);
}

// A disk's indicator is not smooth; the net still beats independent numbers clearly.
TEST(SobolSampler, HelpsWithEdges) {
  const auto f = [](Sample2 u) { return u.x * u.x + u.y * u.y < 1 ? 4.0 : 0.0; };
  const double pi_d = 3.14159265358979;
  EXPECT_LT(integration_error(SamplerKind::sobol, 256, pi_d, f),
            integration_error(SamplerKind::independent, 256, pi_d, f) / 2.5);
}

}  // namespace
}  // namespace embrun
