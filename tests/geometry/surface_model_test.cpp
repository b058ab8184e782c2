#include "geometry/surface_model.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "base/error.h"
#include "geometry/field_sums.h"
#include "geometry/kernels.h"
#include "geometry/particle_blocks.h"
#include "geometry/tracers.h"
#include "support/cubic_lattice.h"

namespace embrun {
namespace {

std::vector<Vec3> random_points(std::size_t count, float side, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<float> uniform(0.0f, side);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) p = {uniform(generator), uniform(generator), uniform(generator)};
  return points;
}

std::vector<float> log_uniform(std::size_t count, double low, double high, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(std::log(low), std::log(high));
  std::vector<float> values(count);
  for (float& v : values) v = static_cast<float>(std::exp(uniform(generator)));
  return values;
}

/// D at x by the definition, in double.
double brute_force_field(const std::vector<Vec3>& positions, const std::vector<float>& influence, Kernel kernel,
                         Vec3 x) {
  double sum = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double r = length(to_double(x) - to_double(positions[i]));
    sum += kernel_value(kernel, static_cast<float>(r / influence[influence.size() == 1 ? 0 : i]));
  }
  return sum;
}

SurfaceSettings settings_of(float radius, int order) {
  SurfaceSettings settings;
  settings.radius = radius;
  settings.order = order;
  return settings;
}

TEST(SurfaceModel, AutomaticThresholdIsHalfTheMeanFieldInside) {
  // The method gives D_in = 4.96 and 16.8 for n = 2, 3 at s = 2 R0, and 20.831795 for n = 3 at s = 0.93 * 2 R0
  // (with its integral rounded to 0.6206/4 pi). Spacing 0 stands for 2 R0.
  const std::vector<Vec3> one{{0, 0, 0}};
  SurfaceSettings settings = settings_of(0.025f, 2);
  EXPECT_NEAR(resolve_surface_model(one, {}, settings).mean_field, 4.96, 0.01);
  EXPECT_NEAR(resolve_surface_model(one, {}, settings).threshold, 2.48, 0.005);
  settings.order = 3;
  EXPECT_NEAR(resolve_surface_model(one, {}, settings).threshold, 8.38, 0.005);
  settings.spacing = 0.93 * 0.05;
  EXPECT_NEAR(resolve_surface_model(one, {}, settings).threshold, 10.415897, 1e-3);
}

TEST(SurfaceModel, FirstOrderThresholdAndRecoveredThresholdAreTheKernelAtR0) {
  const std::vector<Vec3> one{{0, 0, 0}};
  SurfaceSettings settings = settings_of(0.1f, 1);
  // f(1/2): (3/2)(1/2)^2; (3/4)^3; Blinn's by its formula in high precision.
  const std::pair<Kernel, double> expected[] = {
      {Kernel::metaball, 0.375}, {Kernel::zhu_bridson, 27.0 / 64.0}, {Kernel::blinn, 0.400801}};
  for (const auto& [kernel, value] : expected) {
    settings.kernel = kernel;
    const SurfaceModel model = resolve_surface_model(one, {}, settings);
    EXPECT_NEAR(model.threshold, value, 5e-4);
    EXPECT_NEAR(model.recover_threshold, value, 5e-4);
    EXPECT_FLOAT_EQ(model.influence_radius, 0.2f);
    EXPECT_FLOAT_EQ(model.recover_radius, 0.2f);
  }
}

TEST(SurfaceModel, ThesisAndNumberThresholds) {
  const std::vector<Vec3> one{{0, 0, 0}};
  SurfaceSettings settings = settings_of(0.1f, 3);
  settings.threshold_mode = ThresholdMode::thesis;
  EXPECT_EQ(resolve_surface_model(one, {}, settings).threshold, 5.0f);
  settings.threshold_mode = ThresholdMode::number;
  settings.threshold = 1.25f;
  EXPECT_EQ(resolve_surface_model(one, {}, settings).threshold, 1.25f);
}

TEST(SurfaceModel, RefusesWhatCannotMakeASurface) {
  const std::vector<Vec3> one{{0, 0, 0}};
  const auto refuses = [&](auto&& change) {
    SurfaceSettings settings = settings_of(0.1f, 3);
    change(settings);
    EXPECT_THROW(resolve_surface_model(one, {}, settings), Error);
  };
  refuses([](SurfaceSettings& s) { s.radius = 0; });
  refuses([](SurfaceSettings& s) { s.radius = std::nanf(""); });
  refuses([](SurfaceSettings& s) { s.radius = infinity; });
  refuses([](SurfaceSettings& s) { s.order = 0; });
  refuses([](SurfaceSettings& s) { s.spacing = -1; });
  refuses([](SurfaceSettings& s) {
    s.threshold_mode = ThresholdMode::number;
    s.threshold = 0;
  });
  EXPECT_THROW(resolve_surface_model({}, {}, settings_of(0.1f, 3)), Error);
  const std::vector<float> bad{0.0f}, many{0.1f, 0.1f};
  EXPECT_THROW(resolve_surface_model(one, bad, settings_of(0.1f, 3)), Error);
  EXPECT_THROW(resolve_surface_model(one, many, settings_of(0.1f, 3)), Error);
}

TEST(SurfaceModel, RecoverWeightFallsSmoothlyWithinTheMethodsLimits) {
  EXPECT_EQ(recover_weight(0.0f), 1.0f);
  EXPECT_EQ(recover_weight(0.6f), 1.0f);
  EXPECT_LE(recover_weight(1.0f), 0.375f);
  EXPECT_EQ(recover_weight(1.2f), 0.0f);
  EXPECT_EQ(recover_weight(5.0f), 0.0f);
  for (float q = 0; q < 1.5f; q += 1e-3f) {
    EXPECT_LE(recover_weight(q + 1e-3f), recover_weight(q));
    // A smoothstep over 0.6 is at most 1.5/0.6 steep.
    EXPECT_LE(recover_weight(q) - recover_weight(q + 1e-3f), 2.6e-3f);
  }
}

TEST(SurfaceModel, RecoversLoneParticlesOnly) {
  // A 10^3 lattice at s = 2 R0 and one particle far away, n = 2: the lone one has D = 1 < 0.6 T = 1.49; a corner of
  // the lattice has about D_in/8 plus its own share, an inner one D_in = 2 T.
  std::vector<Vec3> positions = testing_support::cubic_lattice(10, 10, 10, 0.2f);
  positions.push_back({10, 10, 10});
  SurfaceSettings settings = settings_of(0.1f, 2);
  const std::vector<float> influence{0.4f};
  const SurfaceModel smooth = resolve_surface_model(positions, {}, settings);
  ASSERT_EQ(smooth.recovered.size(), smooth.recovered_weights.size());
  ASSERT_FALSE(smooth.recovered.empty());
  EXPECT_EQ(smooth.recovered.back(), 1000u);
  EXPECT_EQ(smooth.recovered_weights.back(), 1.0f);
  for (std::size_t r = 0; r < smooth.recovered.size(); ++r) {
    const double q =
        brute_force_field(positions, influence, Kernel::metaball, positions[smooth.recovered[r]]) / smooth.threshold;
    EXPECT_NEAR(smooth.recovered_weights[r], recover_weight(static_cast<float>(q)), 1e-4);
  }
  settings.recover = RecoverMode::thesis;
  const SurfaceModel thesis = resolve_surface_model(positions, {}, settings);
  std::vector<std::uint32_t> expected;
  for (std::uint32_t i = 0; i <= 1000; ++i) {
    if (brute_force_field(positions, influence, Kernel::metaball, positions[i]) < thesis.threshold)
      expected.push_back(i);
  }
  EXPECT_EQ(thesis.recovered, expected);
  settings.recover = RecoverMode::off;
  EXPECT_TRUE(resolve_surface_model(positions, {}, settings).recovered.empty());
}

class FieldValues : public testing::TestWithParam<Kernel> {};
INSTANTIATE_TEST_SUITE_P(All, FieldValues, testing::Values(Kernel::metaball, Kernel::zhu_bridson, Kernel::blinn));

TEST_P(FieldValues, AtTheParticlesAreTheDefinitionsForAnySpreadOfRadii) {
  const std::vector<Vec3> positions = random_points(3000, 1.0f, 3);
  for (const auto& [low, high] : {std::pair{0.1, 0.1}, std::pair{1e-3, 0.3}, std::pair{1e-8, 0.2}}) {
    const std::vector<float> influence = log_uniform(positions.size(), low, high, 4);
    const std::vector<float> values = particle_field_values(positions, influence, GetParam());
    for (std::size_t i = 0; i < positions.size(); i += 7) {
      const double expected = brute_force_field(positions, influence, GetParam(), positions[i]);
      EXPECT_NEAR(values[i], expected, 2e-5 * expected);
    }
  }
}

std::vector<const FieldSums*> available_tables() {
  std::vector<const FieldSums*> tables{&field_sums_baseline};
  const std::vector<std::string> isas = test::available_isas();
  if (isas.size() > 1) tables.push_back(&field_sums_avx2);
  if (isas.size() > 2) tables.push_back(&field_sums_avx512);
  return tables;
}

// Each table that this machine can run, around a lattice of points: with all that is felt there packed.
TEST_P(FieldValues, AreTheDefinitionsOnEveryInstructionSet) {
  const std::vector<Vec3> positions = random_points(700, 1.0f, 5);
  const std::vector<float> influence = log_uniform(positions.size(), 0.05, 0.4, 6);
  const ParticleBlocks blocks(positions, influence, {}, kernel_support(GetParam()));
  const Vec3 corner{0.3f, 0.2f, 0.4f};
  const float cell = 0.03f;
  const Vec3 far_corner = corner + Vec3{3, 3, 3} * cell;
  std::vector<std::uint32_t> near;
  blocks.find_near(corner, far_corner, near);
  const BlockList list{blocks.blocks().data(), blocks.bounds().data(), near.data(), near.size()};
  for (const FieldSums* table : available_tables()) {
    std::vector<ParticleBlock> packed(near.size());
    const PackedParticles felt{packed.data(), table->pack(GetParam(), list, corner, far_corner, packed.data())};
    EXPECT_LT(felt.count, positions.size());
    alignas(64) float lattice[lattice_size];
    for (float& v : lattice) v = 1.0f;
    table->lattice(GetParam(), felt, corner, cell, lattice);
    for (int i = 0; i < lattice_size; ++i) {
      const Vec3 p =
          corner + cell * Vec3{static_cast<float>(i % 4), static_cast<float>(i / 4 % 4), static_cast<float>(i / 16)};
      const double expected = brute_force_field(positions, influence, GetParam(), p);
      EXPECT_NEAR(lattice[i] - 1.0f, expected, 3e-5 * expected);
      const FieldNormal away = table->normal(GetParam(), NormalMode::gradient, felt, p);
      EXPECT_NEAR(away.value, expected, 3e-5 * expected);
      for (int axis = 0; axis < 3; ++axis) {
        Vec3 a = p, b = p;
        a[axis] -= 1e-4f;
        b[axis] += 1e-4f;
        const double difference = (brute_force_field(positions, influence, GetParam(), b) -
                                   brute_force_field(positions, influence, GetParam(), a)) /
                                  (static_cast<double>(b[axis]) - a[axis]);
        EXPECT_NEAR(away.normal[axis], -difference, 0.1);
        const FieldSlope slope = table->slope(GetParam(), felt, p, axis);
        EXPECT_NEAR(slope.value, expected, 3e-5 * expected);
        EXPECT_NEAR(slope.slope, difference, 0.1);
      }
    }
  }
}

TEST_P(FieldValues, WeightedNormalsAreTheDefinition) {
  const std::vector<Vec3> positions = random_points(300, 1.0f, 11);
  const std::vector<float> influence = log_uniform(positions.size(), 0.1, 0.4, 12);
  const ParticleBlocks blocks(positions, influence, {}, kernel_support(GetParam()));
  const Vec3 x{0.55f, 0.4f, 0.62f};
  std::vector<std::uint32_t> near;
  blocks.find_near(x, x, near);
  Vec3d expected;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Vec3d away = to_double(x) - to_double(positions[i]);
    const double r = length(away);
    expected = expected + (kernel_value(GetParam(), static_cast<float>(r / influence[i])) / r) * away;
  }
  for (const FieldSums* table : available_tables()) {
    std::vector<ParticleBlock> packed(near.size());
    const BlockList list{blocks.blocks().data(), blocks.bounds().data(), near.data(), near.size()};
    const PackedParticles felt{packed.data(), table->pack(GetParam(), list, x, x, packed.data())};
    const Vec3d found = to_double(table->normal(GetParam(), NormalMode::weighted, felt, x).normal);
    EXPECT_LT(length(found - expected), 1e-4 * length(expected));
  }
}

// Bounds on D in boxes of some sizes, held against D at many points of them; and what shells leave out.
TEST_P(FieldValues, BoundsHold) {
  const std::vector<Vec3> positions = random_points(700, 1.0f, 13);
  const std::vector<float> influence = log_uniform(positions.size(), 0.05, 0.4, 14);
  const ParticleBlocks blocks(positions, influence, {}, kernel_support(GetParam()));
  const std::vector<Vec3> shares = random_points(40, 1.0f, 15);
  for (const float side : {0.01f, 0.05f, 0.2f}) {
    for (const Vec3 low : random_points(20, 1.0f, 16)) {
      const Vec3 size{side, 0.5f * side, 2 * side}, high = low + size, center = 0.5f * (low + high);
      std::vector<std::uint32_t> near;
      blocks.find_near(low, high, near);
      const BlockList list{blocks.blocks().data(), blocks.bounds().data(), near.data(), near.size()};
      for (const FieldSums* table : available_tables()) {
        std::vector<ParticleBlock> packed(near.size()), inner(near.size() + 1), outer(near.size() + 1);
        const PackedParticles felt{packed.data(), table->pack(GetParam(), list, low, high, packed.data())};
        const float reach = 0.5f * length(size);
        const FieldBound bound = table->bound(GetParam(), felt, center, reach);
        const float most = table->most(GetParam(), felt, low, high);
        const std::size_t inner_count = table->repack(GetParam(), felt, low, high, 0, 0.6f, inner.data());
        const std::size_t outer_count = table->repack(GetParam(), felt, low, high, 0.6f, 1e3f, outer.data());
        EXPECT_EQ(inner_count + outer_count, felt.count);
        for (const Vec3 share : shares) {
          const Vec3 x = low + share * size;
          const double value = brute_force_field(positions, influence, GetParam(), x);
          const double away = static_cast<double>(length(x - center));
          const double linear = static_cast<double>(bound.value + dot(bound.gradient, x - center));
          EXPECT_LE(value, linear + 0.5 * bound.rise * away * away + 1e-4 * (value + 1));
          EXPECT_GE(value, linear - 0.5 * bound.fall * away * away - 1e-4 * (value + 1));
          EXPECT_LE(value, most * (1 + 1e-4) + 1e-4);
          const double split = static_cast<double>(table->slope(GetParam(), {inner.data(), inner_count}, x, 0).value +
                                                   table->slope(GetParam(), {outer.data(), outer_count}, x, 0).value);
          EXPECT_NEAR(split, value, 1e-4 * (value + 1));
        }
      }
    }
  }
}

TEST(FieldValues, DoNotDependOnTheNumberOfThreads) {
  const std::vector<Vec3> positions = random_points(20000, 1.0f, 8);
  const std::vector<float> influence{0.1f};
  std::vector<float> results[2];
  for (int i = 0; i < 2; ++i) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, i == 0 ? 1 : 3);
    results[i] = particle_field_values(positions, influence, Kernel::metaball);
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST(SurfaceModel, RadiiOfAnySpreadTakeNoLongThanEqualOnes) {
  // A peer hangs on a mean radius of 2e-3 beside 1e-8. A quadratic method would take minutes here.
  const std::vector<Vec3> positions = random_points(60000, 2.0f, 9);
  std::vector<float> radii = log_uniform(positions.size(), 1e-4, 1e-1, 10);
  EXPECT_NO_THROW(resolve_surface_model(positions, radii, settings_of(3e-3f, 3)));
  for (std::size_t i = 0; i < radii.size(); ++i) radii[i] = i % 2 ? 1e-8f : 4e-3f;
  const SurfaceModel model = resolve_surface_model(positions, radii, settings_of(2e-3f, 3));
  // Few of these touch: nearly all are recovered.
  EXPECT_GT(model.recovered.size(), positions.size() * 9 / 10);
}

}  // namespace
}  // namespace embrun
