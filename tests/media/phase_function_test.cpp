#include "media/phase_function.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "support/chi_square.h"

namespace embrun {
namespace {

struct Case {
  std::string name;
  PhaseFunction phase;
};
void PrintTo(const Case& c, std::ostream* os) { *os << c.name; }

Case hg(std::string name, float g) { return {std::move(name), {PhaseKind::henyey_greenstein, g}}; }

std::vector<Case> all() {
  return {{"isotropic", {}},
          {"rayleigh", {PhaseKind::rayleigh, 0}},
          hg("hg_0", 0),
          hg("hg_tiny", 1e-6f),
          hg("hg_half", 0.5f),
          hg("hg_backward", -0.7f),
          hg("hg_peaked", 0.95f),
          hg("hg_forward_peak", 0.999f),
          hg("hg_backward_peak", -0.999f)};
}

Sample2 numbers(int i) {
  return sample_2d(SamplerKind::independent, {7, 0, static_cast<uint32_t>(i), 0}, Dimension::phase_direction);
}

/// The textbook formulas in double precision, as a function of 1 - cos between the directions of flight.
double exact(const PhaseFunction& phase, double drop) {
  const double cosine = 1 - drop, g = static_cast<double>(phase.g);
  switch (phase.kind) {
    case PhaseKind::isotropic: break;
    case PhaseKind::henyey_greenstein:
      return (1 - g * g) / (4 * M_PI * std::pow((1 - g) * (1 - g) + 2 * g * drop, 1.5));
    case PhaseKind::rayleigh: return 3 / (16 * M_PI) * (1 + cosine * cosine);
  }
  return 1 / (4 * M_PI);
}

/// 1 - cos below which the share `p` of the light is scattered, by bisection of the numerical integral's closed form.
double distribution(const PhaseFunction& phase, double drop) {
  const double g = static_cast<double>(phase.g), mu = 1 - drop;
  switch (phase.kind) {
    case PhaseKind::isotropic: break;
    case PhaseKind::rayleigh: return 1 - (0.5 + 3.0 / 8 * (mu + mu * mu * mu / 3));
    case PhaseKind::henyey_greenstein:
      if (std::abs(g) < 1e-4) break;
      return 1 - (1 - g * g) / (2 * g) * (1 / std::sqrt((1 - g) * (1 - g) + 2 * g * drop) - 1 / (1 + g));
  }
  return drop / 2;
}

class Phase : public ::testing::TestWithParam<Case> {};

// In the variable (longitude, cumulated share) any phase function is uniform on the unit square, so bins are equally full
// however sharp the peak: a chi-square test that sees the peak's inside.
TEST_P(Phase, SamplesAreDistributedAsTheFunctionSays) {
  const PhaseFunction phase = GetParam().phase;
  const Vec3 wo = normalize(Vec3{0.3f, -0.8f, 0.5f});
  const Frame frame(-wo);
  testing_support::ChiSquareTest test;
  test.name = "phase_" + GetParam().name;
  test.sample = [&](int i) -> std::optional<std::pair<double, double>> {
    const Vec3 wi = sample_phase(phase, wo, numbers(i)).wi;
    const Vec3d along = to_double(wi) + to_double(wo), against = to_double(wi) - to_double(wo);
    const double drop = dot(along, along) / 2, rise = dot(against, against) / 2;
    const Vec3 local = frame.to_local(wi);
    const double turn = std::atan2(static_cast<double>(local.y), static_cast<double>(local.x)) / (2 * M_PI);
    return std::pair{turn - std::floor(turn),
                     std::clamp(distribution(phase, phase.g < 0 ? 2 - rise : drop), 0.0, 1 - 1e-12)};
  };
  test.density = [](double, double) { return 1.0; };
  const auto result = run_chi_square(test);
  EXPECT_TRUE(result.passed) << result.report;
}

TEST_P(Phase, ValueIsThatOfTheFormula) {
  const PhaseFunction phase = GetParam().phase;
  const Vec3 wo = normalize(Vec3{-0.2f, 0.4f, -0.9f});
  for (int i = 0; i < 2000; ++i) {
    const PhaseSample s = sample_phase(phase, wo, numbers(i));
    const Vec3d along = to_double(s.wi) + to_double(wo), against = to_double(s.wi) - to_double(wo);
    const double drop = phase.g < 0 ? 2 - dot(against, against) / 2 : dot(along, along) / 2;
    const double expected = exact(phase, drop);
    EXPECT_NEAR(eval_phase(phase, wo, s.wi) / expected, 1, 2e-3);
    // The direction is rounded to 1e-7 of a radian, a thousandth of the sharpest peak's half width.
    EXPECT_NEAR(s.pdf / expected, 1, 4e-3);
    EXPECT_NEAR(length(s.wi), 1, 1e-6);
  }
}

// Over equal steps of the cumulated share p: the integral of f is that of 1, the mean cosine that of cos.
TEST_P(Phase, IntegratesToOneAndHasItsMeanCosine) {
  const PhaseFunction phase = GetParam().phase;
  const Vec3 wo{0, 0, -1};
  const int steps = 20000;
  double integral = 0, mean_cosine = 0, last = 0;
  // drop = 2 q^4 is dense at the peak in front, 2 - 2 q^4 at one behind.
  for (int i = 0; i < steps; ++i) {
    const auto drop_at = [&](double q) { return phase.g < 0 ? 2 - 2 * std::pow(1 - q, 4) : 2 * std::pow(q, 4); };
    const double low = drop_at(static_cast<double>(i) / steps), high = drop_at((i + 1.0) / steps);
    const double drop = drop_at((i + 0.5) / steps);
    const double sine = std::sqrt(drop * (2 - drop));
    const Vec3 wi{static_cast<float>(sine), 0, static_cast<float>(1 - drop)};
    const double value = static_cast<double>(eval_phase(phase, wo, wi)) * 2 * M_PI * (high - low);
    integral += value;
    mean_cosine += value * (1 - drop);
    last = high;
  }
  EXPECT_DOUBLE_EQ(last, 2);
  EXPECT_NEAR(integral, 1, 1e-3);
  EXPECT_NEAR(mean_cosine, phase.kind == PhaseKind::henyey_greenstein ? static_cast<double>(phase.g) : 0, 1e-3);
}

// Corners of the unit square: directions of length 1, with a positive density.
TEST_P(Phase, ExtremeNumbersGiveDirections) {
  const float largest = 1 - 0x1p-24f;
  for (const float x : {0.0f, 0.5f, largest}) {
    for (const float y : {0.0f, largest}) {
      const PhaseSample s = sample_phase(GetParam().phase, {0, 1, 0}, {x, y});
      EXPECT_NEAR(length(s.wi), 1, 1e-6);
      EXPECT_GT(s.pdf, 0);
      EXPECT_TRUE(is_finite(s.pdf));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, Phase, ::testing::ValuesIn(all()), [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace embrun
