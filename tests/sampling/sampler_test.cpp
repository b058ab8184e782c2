#include "sampling/sampler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "support/chi_square.h"

namespace embrun {
namespace {

constexpr SamplerKind both_kinds[] = {SamplerKind::independent, SamplerKind::sobol};
constexpr uint32_t width = 640;

using testing_support::uniform_p_value;

// 2 kinds x 12 series x 2 coordinates: with p > 1e-5 each, a right sampler fails in 1 of 2000 choices of this
// file's seeds.
constexpr double least_p = 1e-5;

/// The ways in which a render walks through keys: i counts along one part of the key.
struct Walk {
  const char* name;
  std::function<SampleKey(uint32_t)> key;
};

const Walk walks[] = {
    {"sample",
     [](uint32_t i) {
       return SampleKey{7, 12345, i, 0};
     }},
    {"pixel",
     [](uint32_t i) {
       return SampleKey{7, i, 3, 0};
     }},
    {"column",
     [](uint32_t i) {
       return SampleKey{7, i * width + 20, 0, 1};
     }},
    {"seed",
     [](uint32_t i) {
       return SampleKey{i, 99, 0, 0};
     }},
    {"bounce",
     [](uint32_t i) {
       return SampleKey{0, 0, 0, i};
     }},
};

TEST(Sampler, ValuesAreInTheHalfOpenUnitInterval) {
  EXPECT_EQ(unit_float(0), 0.0f);
  EXPECT_EQ(unit_float(0xffffffffu), 1.0f - 0x1p-24f);
  EXPECT_LT(unit_float(0xffffffffu), 1.0f);
}

TEST(Sampler, ReplaysIdentically) {
  for (const SamplerKind kind : both_kinds) {
    const SampleKey key{42, 1000, 17, 3};
    const Sample2 once = sample_2d(kind, key, Dimension::bsdf_direction);
    sample_2d(kind, {1, 2, 3, 4}, Dimension::time);
    const Sample2 again = sample_2d(kind, key, Dimension::bsdf_direction);
    EXPECT_EQ(once.x, again.x);
    EXPECT_EQ(once.y, again.y);
  }
}

TEST(Sampler, EveryPartOfTheKeyMatters) {
  for (const SamplerKind kind : both_kinds) {
    const float base = sample_1d(kind, {1, 2, 3, 4}, Dimension::bsdf_lobe);
    EXPECT_NE(base, sample_1d(kind, {5, 2, 3, 4}, Dimension::bsdf_lobe));
    EXPECT_NE(base, sample_1d(kind, {1, 5, 3, 4}, Dimension::bsdf_lobe));
    EXPECT_NE(base, sample_1d(kind, {1, 2, 5, 4}, Dimension::bsdf_lobe));
    EXPECT_NE(base, sample_1d(kind, {1, 2, 3, 5}, Dimension::bsdf_lobe));
    EXPECT_NE(base, sample_1d(kind, {1, 2, 3, 4}, Dimension::roulette));
  }
}

TEST(Sampler, UniformAlongEveryWalk) {
  constexpr int n = 1 << 16;
  for (const SamplerKind kind : both_kinds)
    for (const Walk& walk : walks) {
      const auto point = [&](int i) {
        return sample_2d(kind, walk.key(static_cast<uint32_t>(i)), Dimension::bsdf_direction);
      };
      // 1000 bins do not divide 2^16, so that the net's perfect strata cannot hide a fault by being perfect.
      EXPECT_GT(uniform_p_value([&](int i) { return point(i).x; }, n, 1000), least_p) << walk.name;
      EXPECT_GT(uniform_p_value([&](int i) { return point(i).y; }, n, 1000), least_p) << walk.name;
    }
}

// Pairs fill the square evenly: the two coordinates, two dimensions of one vertex, two bounces, two neighbouring
// pixels.
TEST(Sampler, PairsOfNumbersAreIndependent) {
  constexpr int n = 1 << 16, side = 32;
  const auto joint_p = [](const std::function<double(uint32_t)>& a, const std::function<double(uint32_t)>& b) {
    return uniform_p_value(
        [&](int i) {
          const auto index = static_cast<uint32_t>(i);
          return (std::floor(a(index) * side) + b(index)) / side;
        },
        n, side * side);
  };
  for (const SamplerKind kind : both_kinds)
    for (const Walk& walk : walks) {
      const auto x = [&](uint32_t i) { return sample_2d(kind, walk.key(i), Dimension::bsdf_direction).x; };
      const auto y = [&](uint32_t i) { return sample_2d(kind, walk.key(i), Dimension::bsdf_direction).y; };
      const auto lobe = [&](uint32_t i) { return sample_1d(kind, walk.key(i), Dimension::bsdf_lobe); };
      const auto shifted = [&](SampleKey step) {
        return [&, step](uint32_t i) {
          SampleKey k = walk.key(i);
          k.seed += step.seed, k.pixel += step.pixel, k.bounce += step.bounce;
          return sample_2d(kind, k, Dimension::bsdf_direction).x;
        };
      };
      EXPECT_GT(joint_p(x, y), least_p) << walk.name;
      EXPECT_GT(joint_p(x, lobe), least_p) << walk.name;
      EXPECT_GT(joint_p(y, lobe), least_p) << walk.name;
      EXPECT_GT(joint_p(x, shifted({0, 1, 0, 0})), least_p) << walk.name;
      EXPECT_GT(joint_p(x, shifted({0, width, 0, 0})), least_p) << walk.name;
      EXPECT_GT(joint_p(x, shifted({0, 0, 0, 1})), least_p) << walk.name;
      EXPECT_GT(joint_p(x, shifted({1, 0, 0, 0})), least_p) << walk.name;
    }
}

// Low sample counts are what renders use: the means of 16 samples of neighbouring pixels, seeds and dimensions must not
// go together. Correlation of n pairs has a deviation of 1/sqrt(n).
TEST(Sampler, SmallSumsOfNeighboursAreUncorrelated) {
  constexpr uint32_t n = 4096;
  const auto sum = [](SamplerKind kind, SampleKey key, Dimension dimension) {
    double total = 0;
    for (key.sample = 0; key.sample < 16; ++key.sample) {
      const double u = sample_1d(kind, key, dimension);
      total += u * u * u;
    }
    return total;
  };
  const auto correlation = [&](const std::function<double(uint32_t)>& a, const std::function<double(uint32_t)>& b) {
    double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
    for (uint32_t i = 0; i < n; ++i) {
      const double x = a(i), y = b(i);
      sa += x, sb += y, saa += x * x, sbb += y * y, sab += x * y;
    }
    return (n * sab - sa * sb) / std::sqrt((n * saa - sa * sa) * (n * sbb - sb * sb));
  };
  const double bound = 4.5 / std::sqrt(static_cast<double>(n));
  for (const SamplerKind kind : both_kinds) {
    const auto base = [&](uint32_t i) { return sum(kind, {1, 2 * i, 0, 1}, Dimension::light_choice); };
    EXPECT_LT(std::fabs(correlation(base,
                                    [&](uint32_t i) {
                                      return sum(kind, {1, 2 * i + 1, 0, 1}, Dimension::light_choice);
                                    })),
              bound);
    EXPECT_LT(std::fabs(correlation(base,
                                    [&](uint32_t i) {
                                      return sum(kind, {1, 2 * i + width, 0, 1}, Dimension::light_choice);
                                    })),
              bound);
    EXPECT_LT(std::fabs(correlation(base,
                                    [&](uint32_t i) {
                                      return sum(kind, {2, 2 * i, 0, 1}, Dimension::light_choice);
                                    })),
              bound);
    EXPECT_LT(std::fabs(correlation(base,
                                    [&](uint32_t i) {
                                      return sum(kind, {1, 2 * i, 0, 2}, Dimension::light_choice);
                                    })),
              bound);
    EXPECT_LT(std::fabs(correlation(base,
                                    [&](uint32_t i) {
                                      return sum(kind, {1, 2 * i, 0, 1}, Dimension::roulette);
                                    })),
              bound);
  }
}

}  // namespace
}  // namespace embrun
