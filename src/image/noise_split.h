#pragma once

#include "image/image.h"
#include "image/tone_curve.h"

namespace embrun {

/// A rendered picture and what tells its noise: at most one of the two.
struct NoisyPicture {
  const Image* values = nullptr;
  const Image* half = nullptr;      ///< the same scene with other random numbers
  const Image* variance = nullptr;  ///< of each of `values`
};

/// An estimate with its 95 % confidence interval.
struct Interval {
  double value = 0;
  double low = 0, high = 0;
};

/// A mean squared error in two parts that sum to it.
struct SquaredErrorSplit {
  double total = 0;     ///< mean_squared_error() of the two pictures
  Interval difference;  ///< mean squared difference of the expected pictures: what more samples would leave. The value
                        ///< is unbiased and may come out below 0; the interval ends at 0
  Interval noise;       ///< what the noise of both adds
};

/// Splits the mean squared error of two pictures. With halves, (a - b)(a' - b') is unbiased for the squared difference,
/// whatever the noise's distribution, for the noise of the two factors is independent; a and b may share random
/// numbers, and so may a' and b'. A variance is subtracted instead, which takes the noise of a and b for independent,
/// and is as good as the variance is (that of a film errs upwards for stratified samples, and the difference then
/// downwards). A picture with neither counts as free of noise.
///
/// The intervals come from the spread of the estimate over blocks of 8 x 8 pixels (single pixels in pictures of less
/// than 64 blocks): noise must be independent from block to block. They include the real variation of the difference
/// over the picture, and so are somewhat too wide where it is large. Same size and channels (checked), at least two
/// pixels (checked).
SquaredErrorSplit split_squared_error(const NoisyPicture& a, const NoisyPicture& b);

/// Variance of a picture's display values (display_values()) from the variance of its radiance, both with three
/// channels: by three-point Gauss-Hermite quadrature of normal noise, the channels of a pixel fully correlated.
Image display_variance(const Image& radiance, const Image& variance, const ToneSettings& settings);

/// (a - b)^2 / 2: an unbiased estimate of the variance of each value of two pictures of the same noise.
Image variance_of_halves(const Image& a, const Image& b);

}  // namespace embrun
