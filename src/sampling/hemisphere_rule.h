#pragma once

#include <cstdint>

#include "math/vec.h"

namespace embrun {

/// A node of a quadrature rule for integrals over the hemisphere with the measure cos(theta) / pi per steradian, whose
/// integral is 1: the mean of the nodes' weights times the integrand's values stands for the integral.
struct HemisphereNode {
  Vec3 direction;    ///< unit, in a frame whose third axis is the pole; above the horizon
  float weight = 1;  ///< the mean over all nodes is 1
};

/// A view of a rule's nodes, which others own, in the order in which a pixel's samples take them.
struct HemisphereRule {
  const HemisphereNode* nodes = nullptr;
  std::uint32_t count = 0;

  /// The node of a sample; one turn after the other.
  EMBRUN_FN const HemisphereNode& node_of(std::uint32_t sample) const { return nodes[sample % count]; }
};

}  // namespace embrun
