#pragma once

#include <span>
#include <vector>

#include "sampling/distribution.h"

namespace embrun {

/// Cumulative probabilities (weights.size() + 1 entries, the last exactly 1) of non-negative, finite weights;
/// uniform when all are 0. `total`, if given, receives the sum of the weights.
std::vector<float> build_cdf(std::span<const float> weights, double* total = nullptr);

/// Owns the arrays of a Distribution2D.
class DistributionTable {
 public:
  DistributionTable() = default;
  /// `weights` are width x height, row after row, non-negative and finite.
  DistributionTable(std::span<const float> weights, int width, int height);

  Distribution2D view() const { return {{rows_.data(), height_}, columns_.data(), width_}; }
  bool empty() const { return height_ == 0; }

 private:
  std::vector<float> rows_, columns_;
  int width_ = 0, height_ = 0;
};

}  // namespace embrun
