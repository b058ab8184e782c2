#include "lights/mis.h"

#include <gtest/gtest.h>

#include "math/vec.h"

namespace embrun {
namespace {

TEST(Mis, WeightsOfBothTechniquesAddUpToOne) {
  for (const float a : {1e-6f, 0.3f, 1.0f, 1e4f})
    for (const float b : {1e-6f, 0.3f, 1.0f, 1e4f}) {
      EXPECT_NEAR(balance_heuristic(a, b) + balance_heuristic(b, a), 1, 1e-6);
      EXPECT_NEAR(power_heuristic(a, b) + power_heuristic(b, a), 1, 1e-6);
    }
  EXPECT_FLOAT_EQ(balance_heuristic(3, 1), 0.75f);
  EXPECT_FLOAT_EQ(power_heuristic(3, 1), 0.9f);
}

TEST(Mis, ExtremeDensities) {
  EXPECT_EQ(balance_heuristic(0, 0), 0);
  EXPECT_EQ(power_heuristic(0, 0), 0);
  EXPECT_EQ(power_heuristic(0, 5), 0);
  EXPECT_EQ(power_heuristic(5, 0), 1);
  EXPECT_EQ(power_heuristic(1e30f, 1e30f), 0.5f);
  EXPECT_EQ(power_heuristic(1e-30f, 1e30f), 0);
  EXPECT_TRUE(is_finite(balance_heuristic(1e38f, 1e38f)) || balance_heuristic(1e38f, 1e38f) >= 0);
}

}  // namespace
}  // namespace embrun
