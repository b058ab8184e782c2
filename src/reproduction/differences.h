#pragma once

#include <string>

#include "reproduction/picture_store.h"

namespace embrun {

/// How far a picture is from its reference, as `embrun compare` has it.
struct PictureDifference {
  double mse = 0;                                ///< of display values, of all samples
  double bias = 0, bias_low = 0, bias_high = 0;  ///< what of it more samples would leave, and its 95 % interval
  double flip = 0;

  double noise() const { return mse - bias; }
};

/// Compares pictures of the store. `difference_file`: a false-colour picture of the differences, or empty.
PictureDifference compare_pictures(const PictureStore& store, const std::string& picture, const std::string& reference,
                                   const std::string& difference_file = {});

/// Where the colours of difference_file are brightest.
inline constexpr double difference_scale = 0.2;

}  // namespace embrun
