#include "math/lanes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>

namespace embrun {
namespace {

std::array<float, 16> numbers_of(const F16& lanes) {
  std::array<float, 16> all;
  store16(all.data(), lanes);
  return all;
}

template <class T>
void expect_two_eights() {
  T numbers[24];
  for (int i = 0; i < 24; ++i) numbers[i] = static_cast<T>(1000 * i + 7);
  const auto both = join_eights(numbers, numbers + 16, T{3});
  const auto one = join_eights(numbers, static_cast<const T*>(nullptr), T{3});
  for (int i = 0; i < 8; ++i) {
    EXPECT_EQ(both[i], static_cast<T>(1000 * i + 7));
    EXPECT_EQ(both[8 + i], static_cast<T>(1000 * (i + 16) + 7));
    EXPECT_EQ(one[i], static_cast<T>(1000 * i + 7));
    EXPECT_EQ(one[8 + i], T{3});
  }
}

TEST(Lanes, AreLoadedFromTwoEights) {
  expect_two_eights<float>();
  expect_two_eights<std::int32_t>();
}

TEST(Lanes, AreSummedByFours) {
  float numbers[4][register_lanes];
  double sums[4] = {};
  for (int k = 0; k < 4; ++k) {
    for (int i = 0; i < register_lanes; ++i) {
      numbers[k][i] = std::sin(static_cast<float>(17 * k + 3 * i));
      sums[k] += static_cast<double>(numbers[k][i]);
    }
  }
  const auto load = [&](int k) { return load_lanes<RegisterLanes>(numbers[k]); };
  const LaneSums all = sum_lanes(load(0), load(1), load(2), load(3));
  for (int k = 0; k < 4; ++k) EXPECT_NEAR(all.of[k], sums[k], 1e-6) << k;
}

TEST(Lanes, HaveRoughSquareRoots) {
  for (int step = 0; step < 2500; ++step) {
    const float x = 1e-12f * std::pow(1.013f, static_cast<float>(step));
    float numbers[16];
    for (int i = 0; i < 16; ++i) numbers[i] = x * (1.0f + 0.01f * static_cast<float>(i));
    const std::array<float, 16> roots = numbers_of(rough_sqrt_of(load16(numbers)));
    for (std::size_t i = 0; i < 16; ++i) {
      const double root = std::sqrt(static_cast<double>(numbers[i]));
      ASSERT_NEAR(static_cast<double>(roots[i]), root, 6.6e-4 * root) << numbers[i];
    }
  }
}

TEST(Lanes, FindBits) {
  for (int low = 0; low < 32; ++low) {
    for (int high = low; high < 32; ++high) {
      const std::uint32_t bits = 1u << low | 1u << high;
      EXPECT_EQ(lowest_bit(bits), low);
      EXPECT_EQ(highest_bit(bits), high);
    }
  }
}

}  // namespace
}  // namespace embrun
