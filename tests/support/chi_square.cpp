#include "support/chi_square.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>
#include <sstream>
#include <vector>

namespace embrun::testing_support {
namespace {

constexpr double pi_d = 3.14159265358979323846;

struct Bins {
  std::vector<double> expected, observed;
  double missing = 0;  // samples that were nothing
};

Bins fill(const ChiSquareTest& test) {
  const auto count = static_cast<size_t>(test.columns) * static_cast<size_t>(test.rows);
  Bins bins{std::vector<double>(count), std::vector<double>(count), 0};
  for (int i = 0; i < test.samples; ++i) {
    const auto place = test.sample(i);
    if (!place) {
      ++bins.missing;
      continue;
    }
    const int x = std::clamp(static_cast<int>(place->first * test.columns), 0, test.columns - 1);
    const int y = std::clamp(static_cast<int>(place->second * test.rows), 0, test.rows - 1);
    ++bins.observed[static_cast<size_t>(y * test.columns + x)];
  }
  const int n = test.points_per_side;
  const double dx = 1.0 / (test.columns * n), dy = 1.0 / (test.rows * n);
  for (int y = 0; y < test.rows * n; ++y)
    for (int x = 0; x < test.columns * n; ++x)
      bins.expected[static_cast<size_t>(y / n * test.columns + x / n)] +=
          test.density((x + 0.5) * dx, (y + 0.5) * dy) * dx * dy * test.samples;
  return bins;
}

std::string dump(const std::string& name, const Bins& bins, int columns) {
  const std::string path = ::testing::TempDir() + "chi_square_" + name + ".csv";
  std::ofstream file(path);
  file << "column,row,observed,expected\n";
  for (size_t i = 0; i < bins.expected.size(); ++i)
    file << i % static_cast<size_t>(columns) << ',' << i / static_cast<size_t>(columns) << ',' << bins.observed[i]
         << ',' << bins.expected[i] << '\n';
  return path;
}

}  // namespace

double chi_square_tail(double x, int degrees) {
  // Regularised upper incomplete gamma function Q(degrees/2, x/2): series below the mean, continued fraction above.
  const double a = 0.5 * degrees, z = 0.5 * x;
  if (z <= 0) return 1;
  const double prefix = std::exp(a * std::log(z) - z - std::lgamma(a));
  if (z < a + 1) {
    double term = 1 / a, sum = term;
    for (int n = 1; n < 10'000 && term > sum * 1e-16; ++n) sum += term *= z / (a + n);
    return 1 - prefix * sum;
  }
  double b = z + 1 - a, c = 1e300, d = 1 / b, h = d;
  for (int n = 1; n < 10'000; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    const double delta = c * d;
    h *= delta;
    if (std::fabs(delta - 1) < 1e-15) break;
  }
  return prefix * h;
}

ChiSquareResult run_chi_square(const ChiSquareTest& test) {
  const Bins bins = fill(test);
  ChiSquareResult result;
  const double expected_total = std::accumulate(bins.expected.begin(), bins.expected.end(), 0.0);
  result.density_integral = expected_total / test.samples;

  // Bins with few expected samples are pooled, smallest first, until each pool expects at least five.
  std::vector<std::pair<double, double>> cells;  // expected, observed
  for (size_t i = 0; i < bins.expected.size(); ++i) cells.emplace_back(bins.expected[i], bins.observed[i]);
  if (test.partial) cells.emplace_back(std::max(0.0, test.samples - expected_total), bins.missing);
  // Samples where there should be none. A sliver between the points of the quadrature may catch a few.
  double impossible = test.partial ? 0 : bins.missing;
  std::sort(cells.begin(), cells.end());
  double statistic = 0, pool_expected = 0, pool_observed = 0;
  int used = 0;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].first == 0) impossible += cells[i].second;
    pool_expected += cells[i].first;
    pool_observed += cells[i].second;
    if (pool_expected < 5) continue;
    statistic += (pool_observed - pool_expected) * (pool_observed - pool_expected) / pool_expected;
    pool_expected = pool_observed = 0;
    ++used;
  }
  result.p_value = used > 1 ? chi_square_tail(statistic, used - 1) : 1;

  const double threshold = 1 - std::pow(1 - test.significance, 1.0 / test.tests_in_program);
  result.passed = result.p_value > threshold && impossible <= 1e-4 * test.samples && result.density_integral < 1.005 &&
                  (test.partial || result.density_integral > 0.995);
  if (!result.passed) {
    std::ostringstream text;
    text << test.name << ": chi-square " << statistic << " with " << used - 1 << " degrees of freedom, p "
         << result.p_value << " (needs " << threshold << "), density integrates to " << result.density_integral << ", "
         << bins.missing / test.samples << " of the samples are nothing"
         << ", " << impossible << " are where there should be none; bins in " << dump(test.name, bins, test.columns);
    result.report = text.str();
  }
  return result;
}

ChiSquareResult run_chi_square(const SphereChiSquareTest& test) {
  ChiSquareTest square;
  square.name = test.name;
  square.partial = test.partial;
  square.samples = test.samples;
  square.columns = test.columns;
  square.rows = test.rows;
  square.points_per_side = test.points_per_side;
  square.tests_in_program = test.tests_in_program;
  square.sample = [&](int i) -> std::optional<std::pair<double, double>> {
    const auto direction = test.sample(i);
    if (!direction) return std::nullopt;
    double turn = std::atan2(direction->y, direction->x) / (2 * pi_d);
    if (turn < 0) turn += 1;
    return std::pair{turn, 0.5 * (1 + static_cast<double>(direction->z))};
  };
  square.density = [&](double x, double y) {
    const double z = 2 * y - 1, ring = std::sqrt(std::max(0.0, 1 - z * z)), angle = 2 * pi_d * x;
    return 4 * pi_d * test.density(to_float({ring * std::cos(angle), ring * std::sin(angle), z}));
  };
  return run_chi_square(square);
}

double uniform_p_value(const std::function<double(int)>& value_in_unit_interval, int samples, int bins) {
  std::vector<double> counts(static_cast<size_t>(bins));
  for (int i = 0; i < samples; ++i)
    ++counts[static_cast<size_t>(std::clamp(static_cast<int>(value_in_unit_interval(i) * bins), 0, bins - 1))];
  const double expected = static_cast<double>(samples) / bins;
  double statistic = 0;
  for (const double c : counts) statistic += (c - expected) * (c - expected) / expected;
  return chi_square_tail(statistic, bins - 1);
}

}  // namespace embrun::testing_support
