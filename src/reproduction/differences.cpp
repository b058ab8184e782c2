#include "reproduction/differences.h"

#include "embrun/compare.h"

namespace embrun {

PictureDifference compare_pictures(const PictureStore& store, const std::string& picture, const std::string& reference,
                                   const std::string& difference_file) {
  CompareOptions all;
  all.diff_file = difference_file;
  all.diff_scale = difference_scale;
  const Comparison whole = compare_files(store.mean_file(picture).string(), store.mean_file(reference).string(), all);
  CompareOptions halves;
  halves.half_a = store.half_file(picture, 2).string();
  halves.half_b = store.half_file(reference, 2).string();
  const Comparison split =
      compare_files(store.half_file(picture, 1).string(), store.half_file(reference, 1).string(), halves);
  PictureDifference result;
  result.mse = whole.mse;
  result.flip = whole.flip;
  const IntervalEstimate bias = split.mse_bias.value_or(IntervalEstimate{});
  result.bias = bias.value;
  result.bias_low = bias.low;
  result.bias_high = bias.high;
  return result;
}

}  // namespace embrun
