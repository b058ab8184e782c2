#include "sampling/distribution_builder.h"

#include <cmath>

#include "base/error.h"

namespace embrun {

std::vector<float> build_cdf(std::span<const float> weights, double* total) {
  EMBRUN_CHECK(!weights.empty());
  double sum = 0;
  for (const float w : weights) {
    EMBRUN_CHECK(w >= 0 && std::isfinite(w));
    sum += w;
  }
  if (total) *total = sum;

  std::vector<float> cdf(weights.size() + 1);
  double running = 0;
  for (size_t i = 0; i < weights.size(); ++i) {
    cdf[i] = static_cast<float>(running);
    running += sum > 0 ? weights[i] / sum : 1.0 / static_cast<double>(weights.size());
  }
  // Items of weight 0 at the end keep probability 0: everything after the last positive weight is exactly 1.
  size_t last = weights.size() - 1;
  while (sum > 0 && weights[last] == 0) --last;
  for (size_t i = last + 1; i < cdf.size(); ++i) cdf[i] = 1.0f;
  return cdf;
}

DistributionTable::DistributionTable(std::span<const float> weights, int width, int height)
    : width_(width), height_(height) {
  EMBRUN_CHECK(width > 0 && height > 0);
  EMBRUN_CHECK(weights.size() == static_cast<size_t>(width) * static_cast<size_t>(height));
  const auto row_length = static_cast<size_t>(width);
  std::vector<float> row_weights(static_cast<size_t>(height));
  columns_.reserve((row_length + 1) * row_weights.size());
  for (size_t y = 0; y < row_weights.size(); ++y) {
    double sum = 0;
    const std::vector<float> cdf = build_cdf(weights.subspan(y * row_length, row_length), &sum);
    columns_.insert(columns_.end(), cdf.begin(), cdf.end());
    row_weights[y] = static_cast<float>(sum);
  }
  rows_ = build_cdf(row_weights);
}

}  // namespace embrun
