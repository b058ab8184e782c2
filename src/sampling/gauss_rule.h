#pragma once

#include <optional>
#include <vector>

#include "sampling/hemisphere_rule.h"

namespace embrun {

/// Nodes of an integral over [0, 1] in ascending order, and their weights, whose sum is 1.
struct IntervalRule {
  std::vector<double> nodes, weights;
};

/// Gauss's rule of `count` (at least 1, checked) nodes: exact for polynomials up to degree 2 count - 1 [Abramowitz1964],
/// 25.4.29 and 25.4.30.
IntervalRule gauss_legendre(int count);

/// How many heights above the horizon a rule of the hemisphere has, and how many azimuths at each.
struct HemisphereRuleSize {
  int heights = 1, azimuths = 1;

  bool operator==(const HemisphereRuleSize&) const = default;
};

/// Most nodes of a rule of the hemisphere.
inline constexpr int most_hemisphere_nodes = 65536;

/// How gauss_hemisphere() is to be made of so many nodes: azimuths as near as may be to four times the heights, with which
/// it is of one degree in both, and from 1 to 8 times. None where there are no such factors, or too many nodes.
std::optional<HemisphereRuleSize> hemisphere_rule_size(int nodes);

/// The product of Gauss's rule in sin^2(theta) and of equally spaced azimuths, which are Gauss's rule of periodic functions:
/// for the measure of HemisphereNode, which is uniform in both. Exact for polynomials in the first two coordinates of the
/// direction up to degree min(4 heights, azimuths) - 1, and in sin^2(theta) alone up to 2 heights - 1. The azimuths are half
/// a step off the frame's first axis, which often runs along an edge of what is seen.
/// The order is such that any number of nodes from the first on is spread over the hemisphere.
std::vector<HemisphereNode> gauss_hemisphere(HemisphereRuleSize size);

}  // namespace embrun
