#pragma once

#include <functional>
#include <optional>
#include <string>

#include "math/vec.h"

namespace embrun::testing_support {

/// Pearson's chi-square test of a sampler against the density it claims.
struct ChiSquareTest {
  /// Names the dump that a failure leaves.
  std::string name;
  /// Draws sample number i: a place in the unit square (a chart of the domain), or nothing.
  std::function<std::optional<std::pair<double, double>>(int)> sample;
  /// Density claimed, with respect to area in the unit square.
  std::function<double(double, double)> density;

  /// The density's integral is below 1, and what is missing is the share of the samples that are nothing. Otherwise
  /// none may be nothing.
  bool partial = false;

  int samples = 200'000;
  int columns = 24, rows = 12;
  /// The density is integrated over a bin by the midpoint rule with this many points a side. Bins whose edges follow
  /// the density's jumps need few.
  int points_per_side = 12;
  /// Probability of failing although the sampler is right, for all the tests of a program together; each gets
  /// the share that Sidak's correction gives it.
  double significance = 0.01;
  int tests_in_program = 20;
};

struct ChiSquareResult {
  bool passed = false;
  double p_value = 0;
  double density_integral = 0;
  /// What to print on failure: the statistic, the p-value and where the table of bins was written.
  std::string report;
};

ChiSquareResult run_chi_square(const ChiSquareTest& test);

/// The same on the sphere: `sample` gives unit directions (or none), `density` is per steradian. Uses the chart
/// (longitude / 2 pi, (1 + z)/2), whose areas are proportional to solid angle.
struct SphereChiSquareTest {
  std::string name;
  std::function<std::optional<Vec3>(int)> sample;
  std::function<double(Vec3)> density;
  bool partial = false;
  int samples = 200'000;
  int columns = 24, rows = 12;
  int points_per_side = 12;
  int tests_in_program = 20;
};
ChiSquareResult run_chi_square(const SphereChiSquareTest& test);

/// Uniformity of `bins` counts of n samples in all: the p-value.
double uniform_p_value(const std::function<double(int)>& value_in_unit_interval, int samples, int bins);

/// Upper tail of the chi-square distribution: P(X >= x) with `degrees` degrees of freedom.
double chi_square_tail(double x, int degrees);

}  // namespace embrun::testing_support
