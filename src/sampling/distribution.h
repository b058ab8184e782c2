#pragma once

#include "math/vec.h"
#include "sampling/sampler.h"

namespace embrun {

/// A choice among `count` items: cdf[i] is the probability of the items before i, cdf[0] = 0, cdf[count] = 1.
/// A plain view of an array that someone else owns (built by build_cdf).
struct Distribution1D {
  const float* cdf = nullptr;
  int count = 0;
};

/// The item chosen, its probability, and what is left of the random number: uniform in [0, 1) again.
struct DiscreteSample {
  int index = 0;
  float probability = 0;
  float remainder = 0;
};

EMBRUN_FN float probability_of(const Distribution1D& d, int index) { return d.cdf[index + 1] - d.cdf[index]; }

/// Inverts the cumulative distribution by bisection, so that stratified numbers give stratified choices. Items of
/// probability 0 are never chosen.
EMBRUN_LOCAL_FN DiscreteSample sample_discrete(const Distribution1D& d, float u) {
  int low = 0, high = d.count;  // cdf[low] <= u < cdf[high]
  while (high - low > 1) {
    const int middle = (low + high) >> 1;
    if (d.cdf[middle] <= u)
      low = middle;
    else
      high = middle;
  }
  const float probability = probability_of(d, low);
  return {low, probability, min_of((u - d.cdf[low]) / probability, 0x1.fffffep-1f)};
}

/// A choice of a cell of a width x height table: first the row, then the column in it. `columns` holds `height`
/// cumulative arrays of width + 1 entries, one after the other.
struct Distribution2D {
  Distribution1D rows;
  const float* columns = nullptr;
  int width = 0;

  EMBRUN_FN Distribution1D row(int y) const { return {columns + static_cast<long>(y) * (width + 1), width}; }
};

struct CellSample {
  int x = 0, y = 0;
  float probability = 0;  ///< of this cell
  Sample2 remainder;      ///< uniform in the unit square: place within the cell
};

EMBRUN_FN CellSample sample_cell(const Distribution2D& d, Sample2 u) {
  const DiscreteSample y = sample_discrete(d.rows, u.y);
  const DiscreteSample x = sample_discrete(d.row(y.index), u.x);
  return {x.index, y.index, x.probability * y.probability, {x.remainder, y.remainder}};
}

EMBRUN_FN float cell_probability(const Distribution2D& d, int x, int y) {
  return probability_of(d.rows, y) * probability_of(d.row(y), x);
}

}  // namespace embrun
