#include "geometry/cell_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "base/instruction_set.h"
#include "measure/oracle_scene.h"

namespace embrun {
namespace {

/// The tables that this machine runs.
std::vector<const CellModelLoops*> tables() {
  std::vector<const CellModelLoops*> all{&cell_model_baseline};
  const InstructionSet best = instruction_set();
  if (best >= InstructionSet::avx2) all.push_back(&cell_model_avx2);
  if (best >= InstructionSet::avx512) all.push_back(&cell_model_avx512);
  return all;
}

CellFrame frame_of(Kernel kernel) {
  CellFrame frame{};
  frame.kernel = kernel;
  return frame;
}

TEST(BoundRecovered, HoldsEveryPointOfTheBody) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0.0f, 1.0f);
  const Vec3 center{1.5f, 2.5f, 0.5f};
  constexpr float half = 0.5f, slack = 1e-3f;
  for (const CellModelLoops* loops : tables()) {
    for (const Kernel kernel : {Kernel::metaball, Kernel::zhu_bridson, Kernel::blinn}) {
      int bodies = 0, ruled_out = 0, smaller = 0;
      for (int trial = 0; trial < 200; ++trial) {
        std::vector<RecoveredParticle> particles(1 + random() % 8);
        for (RecoveredParticle& r : particles) {
          r = {center.x + 2.4f * (unit(random) - 0.5f), center.y + 2.4f * (unit(random) - 0.5f),
               center.z + 2.4f * (unit(random) - 0.5f), 1.0f / (0.6f + 0.8f * unit(random)), 2.5f * unit(random)};
        }
        Box3 where;
        const bool any =
            loops->bound_recovered(frame_of(kernel), particles.data(), particles.size(), center, half, slack, where);
        if (!any) ++ruled_out;
        if (any && (where.high.x - where.low.x) * (where.high.y - where.low.y) * (where.high.z - where.low.z) < 0.5f)
          ++smaller;
        // As lists have them: each a little off.
        std::vector<RecoveredParticle> rounded = particles;
        for (RecoveredParticle& r : rounded) {
          r.x += slack * (unit(random) - 0.5f);
          r.y += slack * (unit(random) - 0.5f);
          r.z += slack * (unit(random) - 0.5f);
        }
        for (int i = 0; i < 500; ++i) {
          const Vec3 y{unit(random) - half, unit(random) - half, unit(random) - half};
          double sum = 0;
          for (const RecoveredParticle& r : rounded) {
            const Vec3 d = center + y - Vec3{r.x, r.y, r.z};
            sum += static_cast<double>(r.weight) *
                   oracle::kernel_value(measure::to_oracle(kernel),
                                        static_cast<double>(length(d)) * static_cast<double>(r.inverse_radius));
          }
          if (sum < 1.0) continue;
          ++bodies;
          ASSERT_TRUE(any);
          for (int a = 0; a < 3; ++a) {
            ASSERT_GE(y[a], where.low[a]);
            ASSERT_LE(y[a], where.high[a]);
          }
        }
      }
      // The trials are of all kinds.
      EXPECT_GT(bodies, 1000);
      EXPECT_GT(ruled_out, 5);
      EXPECT_GT(smaller, 5);
    }
  }
}

TEST(BoundRecovered, IsTightRoundALoneBall) {
  // Of weight 1/f(1/2) a particle is a ball of half its influence radius, here 0.21, off the corner of the middle.
  for (const CellModelLoops* loops : tables()) {
    const RecoveredParticle ball{0.6f, 0.5f, 0.5f, 1.0f / 0.42f,
                                 static_cast<float>(1 / oracle::kernel_value(oracle::Kernel::metaball, 0.5))};
    Box3 where;
    ASSERT_TRUE(loops->bound_recovered(frame_of(Kernel::metaball), &ball, 1, {0.5f, 0.5f, 0.5f}, 0.5f, 1e-4f, where));
    // In eighths: 0.1 - 0.21 = -0.11 and 0.31 along x, -0.21 and 0.21 along the others.
    EXPECT_FLOAT_EQ(where.low.x, -0.125f);
    EXPECT_FLOAT_EQ(where.high.x, 0.375f);
    for (int a = 1; a < 3; ++a) {
      EXPECT_FLOAT_EQ(where.low[a], -0.25f);
      EXPECT_FLOAT_EQ(where.high[a], 0.25f);
    }
  }
}

TEST(SlackPair, RoundsUpByAHundredthPartAtMost) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> exponent(-20.0f, 10.0f);
  for (int i = 0; i < 100000; ++i) {
    const float upper = std::exp2(exponent(random)), lower = std::exp2(exponent(random));
    const SlackPair slack(upper, -lower);
    EXPECT_GE(slack.upper(), upper);
    EXPECT_LE(slack.upper(), 1.01f * upper);
    EXPECT_GE(slack.lower(), -lower);
    EXPECT_LE(slack.lower(), -0.99f * lower);
    const SlackPair other(-lower, upper);
    EXPECT_EQ(other.upper(), slack.lower());
    EXPECT_EQ(other.lower(), slack.upper());
  }
  const SlackPair none(0.0f, 1.0f);
  EXPECT_EQ(none.upper(), 0.0f);
  EXPECT_EQ(none.lower(), 1.0f);
}

}  // namespace
}  // namespace embrun
