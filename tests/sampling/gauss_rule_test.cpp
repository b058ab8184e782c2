// Gauss's rules against their closed forms [Abramowitz1964], table 25.4, and against integrals that they have to get right.

#include "sampling/gauss_rule.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <tuple>

namespace embrun {
namespace {

/// Legendre's rule is for [-1, 1], with weights whose sum is 2: here are its nodes and weights.
void expect_legendre(const std::vector<std::pair<double, double>>& expected) {
  const IntervalRule rule = gauss_legendre(static_cast<int>(expected.size()));
  ASSERT_EQ(rule.nodes.size(), expected.size());
  ASSERT_EQ(rule.weights.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(2 * rule.nodes[i] - 1, expected[i].first, 4e-16) << i << " of " << expected.size();
    EXPECT_NEAR(2 * rule.weights[i], expected[i].second, 2e-15) << i << " of " << expected.size();
  }
}

TEST(GaussLegendre, HasItsClosedForms) {
  expect_legendre({{0, 2}});
  const double two = 1 / std::sqrt(3.0);
  expect_legendre({{-two, 1}, {two, 1}});
  const double three = std::sqrt(0.6);
  expect_legendre({{-three, 5.0 / 9}, {0, 8.0 / 9}, {three, 5.0 / 9}});
  const double root = 2 * std::sqrt(10.0 / 7), seventy = 13 * std::sqrt(70.0);
  const double outer = std::sqrt(5 + root) / 3, inner = std::sqrt(5 - root) / 3;
  const double light = (322 - seventy) / 900, heavy = (322 + seventy) / 900;
  expect_legendre({{-outer, light}, {-inner, heavy}, {0, 128.0 / 225}, {inner, heavy}, {outer, light}});
}

double quadrature_of_power(const IntervalRule& rule, int power) {
  double sum = 0;
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) sum += rule.weights[i] * std::pow(rule.nodes[i], power);
  return sum;
}

// The integral of x^k is 1 / (k + 1). Of the first power that is not exact the error is n!^4 / ((2n + 1) (2n)!^2), from the
// remainder of 25.4.29 for [0, 1].
TEST(GaussLegendre, IsExactUpToItsDegreeAndNotBeyond) {
  for (int n : {1, 2, 3, 4, 7, 16, 64})
    for (int k = 0; k < 2 * n; ++k) EXPECT_NEAR(quadrature_of_power(gauss_legendre(n), k), 1.0 / (k + 1), 1e-14) << n;
  for (int n = 1; n <= 7; ++n) {
    const double factorial = std::tgamma(n + 1.0), of_twice = std::tgamma(2 * n + 1.0);
    const double error = std::pow(factorial, 4) / ((2 * n + 1) * of_twice * of_twice);
    EXPECT_NEAR(1.0 / (2 * n + 1) - quadrature_of_power(gauss_legendre(n), 2 * n), error, 1e-6 * error + 1e-15) << n;
  }
}

TEST(GaussLegendre, OfManyNodes) {
  const IntervalRule rule = gauss_legendre(256);
  double sum = 0;
  for (std::size_t i = 0; i < rule.nodes.size(); ++i) {
    EXPECT_GT(rule.nodes[i], i == 0 ? 0 : rule.nodes[i - 1]);
    EXPECT_GT(rule.weights[i], 0);
    sum += rule.weights[i];
  }
  EXPECT_LT(rule.nodes.back(), 1);
  EXPECT_NEAR(sum, 1, 1e-13);
}

// Four azimuths for each height where that divides the number, else what is nearest to it.
TEST(HemisphereRule, HasASizeWhereThereAreFactors) {
  const std::tuple<int, int, int> sizes[] = {{1, 1, 1},    {2, 1, 2},    {4, 1, 4},     {9, 3, 3},
                                             {16, 2, 8},   {36, 3, 12},  {64, 4, 16},   {100, 5, 20},
                                             {128, 8, 16}, {256, 8, 32}, {500, 10, 50}, {65536, 128, 512}};
  for (const auto& [nodes, heights, azimuths] : sizes) {
    const auto size = hemisphere_rule_size(nodes);
    ASSERT_TRUE(size) << nodes;
    EXPECT_EQ(size->heights, heights) << nodes;
    EXPECT_EQ(size->azimuths, azimuths) << nodes;
  }
  for (const int nodes : {-4, 0, 11, 13, 17, 34, 251, 65537, 1 << 20})
    EXPECT_FALSE(hemisphere_rule_size(nodes)) << nodes;
}

/// The mean of x^a y^b over the hemisphere by the cosine, which is over the unit disc: 0 for odd powers, else
/// 2 / (a + b + 2) / pi times the integral of cos^a sin^b over half a turn, B((a + 1) / 2, (b + 1) / 2).
double moment(int a, int b) {
  if (a % 2 != 0 || b % 2 != 0) return 0;
  const double beta = std::tgamma(0.5 * (a + 1)) * std::tgamma(0.5 * (b + 1)) / std::tgamma(0.5 * (a + b) + 1);
  return 2 / M_PI / (a + b + 2) * beta;
}

double mean_by_rule(const std::vector<HemisphereNode>& nodes, int a, int b) {
  double sum = 0;
  for (const HemisphereNode& node : nodes) {
    sum += static_cast<double>(node.weight) * std::pow(static_cast<double>(node.direction.x), a) *
           std::pow(static_cast<double>(node.direction.y), b);
  }
  return sum / static_cast<double>(nodes.size());
}

TEST(HemisphereRule, IsExactForPolynomials) {
  EXPECT_DOUBLE_EQ(moment(2, 0), 0.25);
  EXPECT_DOUBLE_EQ(moment(4, 0), 0.125);
  for (const HemisphereRuleSize size : {HemisphereRuleSize{1, 4}, {2, 8}, {4, 16}, {3, 5}, {5, 7}}) {
    const std::vector<HemisphereNode> nodes = gauss_hemisphere(size);
    ASSERT_EQ(nodes.size(), static_cast<std::size_t>(size.heights * size.azimuths));
    const int degree = std::min(4 * size.heights, size.azimuths) - 1;
    for (int a = 0; a <= degree; ++a)
      for (int b = 0; a + b <= degree; ++b)
        EXPECT_NEAR(mean_by_rule(nodes, a, b), moment(a, b), 2e-7) << size.heights << " " << a << " " << b;
    for (const HemisphereNode& node : nodes) EXPECT_NEAR(length(node.direction), 1, 1e-6f);
  }
  // Of x^4 with four azimuths half a step off, cos^4 is 1/4 in place of 3/8.
  EXPECT_GT(std::abs(mean_by_rule(gauss_hemisphere({1, 4}), 4, 0) - moment(4, 0)), 0.03);
}

TEST(HemisphereRule, IsSpreadFromTheFirstNodesOn) {
  for (const HemisphereRuleSize size : {HemisphereRuleSize{4, 16}, {8, 32}, {5, 20}, {3, 7}}) {
    const std::vector<HemisphereNode> nodes = gauss_hemisphere(size);
    std::set<std::pair<float, float>> places;
    for (const HemisphereNode& node : nodes) places.insert({node.direction.x, node.direction.y});
    EXPECT_EQ(places.size(), nodes.size());
    // A quarter of them has its middle near the pole's axis, and its heights are those of all.
    const std::vector<HemisphereNode> first(nodes.begin(), nodes.begin() + static_cast<long>(nodes.size() / 4));
    Vec3 all_mean, mean;
    for (const HemisphereNode& node : first) mean += (1.0f / static_cast<float>(first.size())) * node.direction;
    for (const HemisphereNode& node : nodes) all_mean += (1.0f / static_cast<float>(nodes.size())) * node.direction;
    EXPECT_NEAR(mean.x, 0, 0.25) << nodes.size();
    EXPECT_NEAR(mean.y, 0, 0.25) << nodes.size();
    EXPECT_NEAR(mean.z, all_mean.z, 0.1) << nodes.size();
  }
}

}  // namespace
}  // namespace embrun
