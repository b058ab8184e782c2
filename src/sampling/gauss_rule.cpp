#include "sampling/gauss_rule.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <numeric>

#include "base/error.h"

namespace embrun {
namespace {

/// Legendre's polynomial of a degree at x in (-1, 1), and its derivative.
struct LegendreValue {
  double value, slope;
};

LegendreValue legendre(int degree, double x) {
  // (k + 1) P_k+1 = (2k + 1) x P_k - k P_k-1
  double before = 0, value = 1;
  for (int k = 0; k < degree; ++k) {
    const double next = ((2 * k + 1) * x * value - k * before) / (k + 1);
    before = value;
    value = next;
  }
  return {value, degree * (before - x * value) / (1 - x * x)};
}

/// Less than `count`, without a common divisor, and near the golden section of it: its multiples modulo `count` are all
/// numbers, and any stretch of them is spread.
int golden_stride(int count) {
  int stride = std::max(1, static_cast<int>(std::lround(count / std::numbers::phi)));
  while (std::gcd(stride, count) != 1) ++stride;
  return stride;
}

}  // namespace

IntervalRule gauss_legendre(int count) {
  EMBRUN_CHECK(count >= 1);
  IntervalRule rule;
  rule.nodes.resize(static_cast<std::size_t>(count));
  rule.weights.resize(rule.nodes.size());
  for (int i = 0; i < count; ++i) {
    // The roots in descending order; Newton's method doubles the digits of the first guess with each step.
    double x = std::cos(std::numbers::pi * (i + 0.75) / (count + 0.5));
    for (int step = 0; step < 8; ++step) {
      const LegendreValue p = legendre(count, x);
      x -= p.value / p.slope;
    }
    const double slope = legendre(count, x).slope;
    const auto place = static_cast<std::size_t>(count - 1 - i);
    rule.nodes[place] = 0.5 * (1 + x);
    rule.weights[place] = 1 / ((1 - x * x) * slope * slope);
  }
  return rule;
}

std::optional<HemisphereRuleSize> hemisphere_rule_size(int nodes) {
  if (nodes < 1 || nodes > most_hemisphere_nodes) return std::nullopt;
  std::optional<HemisphereRuleSize> best;
  double least = 0;
  for (int heights = static_cast<int>(std::sqrt(nodes)); heights >= 1; --heights) {
    const int azimuths = nodes / heights;
    if (heights * azimuths != nodes || azimuths > 8 * heights) continue;
    const double ratio = azimuths / (4.0 * heights);
    const double off = std::max(ratio, 1 / ratio);
    if (best && off >= least) continue;
    best = {heights, azimuths};
    least = off;
  }
  return best;
}

std::vector<HemisphereNode> gauss_hemisphere(HemisphereRuleSize size) {
  EMBRUN_CHECK(size.heights >= 1 && size.azimuths >= 1);
  const IntervalRule rule = gauss_legendre(size.heights);
  const int count = size.heights * size.azimuths;
  const int stride = golden_stride(count);
  std::vector<HemisphereNode> nodes;
  nodes.reserve(static_cast<std::size_t>(count));
  for (int place = 0; nodes.size() < static_cast<std::size_t>(count); place = (place + stride) % count) {
    const auto height = static_cast<std::size_t>(place / size.azimuths);
    const double sin2 = rule.nodes[height], ring = std::sqrt(sin2);
    const double angle = 2 * std::numbers::pi * (place % size.azimuths + 0.5) / size.azimuths;
    nodes.push_back({{static_cast<float>(ring * std::cos(angle)), static_cast<float>(ring * std::sin(angle)),
                      static_cast<float>(std::sqrt(1 - sin2))},
                     static_cast<float>(rule.weights[height] * size.heights)});
  }
  return nodes;
}

}  // namespace embrun
