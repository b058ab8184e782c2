#pragma once

#include <cstddef>
#include <vector>

#include "image/image.h"

namespace embrun {

/// Mean over all pixels and channels.
double mean_value(const Image& image);
/// Mean squared difference, and its root. The images must have the same size and channels (checked, as below).
double mean_squared_error(const Image& a, const Image& b);
double root_mean_squared_error(const Image& a, const Image& b);
/// Peak signal-to-noise ratio in dB of values with a peak of 1: -10 log10(MSE); infinite for 0.
double peak_signal_to_noise(double mean_squared_error);
/// Mean of (a - reference)^2 / (reference^2 + 0.01) over all pixels and channels [Rousselle2011]: errors count by what
/// they are to their surroundings, and the 0.01 keeps black from counting without limit.
double relative_mean_squared_error(const Image& a, const Image& reference);

/// A ratio with its standard error.
struct Estimate {
  double value = 0;
  double standard_error = 0;
};

/// mean(a) / mean(b). The standard error comes from the spread of the block differences, so it needs no variance
/// layers; it includes whatever real local differences there are.
Estimate mean_ratio(const Image& a, const Image& b, int block_size = 8);

/// One block of two pictures compared.
struct BlockDifference {
  int x = 0, y = 0;  ///< top left pixel
  double mean_a = 0, mean_b = 0;
  double relative = 0;        ///< (mean_a - mean_b) / scale
  double standard_error = 0;  ///< of `relative`, from the variance layers; 0 when none were given
};

/// Compares two pictures block by block (pixels averaged over channels; blocks at the right and lower edges that are
/// not whole are left out). The scale of the relative difference is the mean of both blocks; two black blocks do
/// not differ.
/// `variance_a`, `variance_b`: variance of each pixel's value per channel (the variance layer), or null for none;
/// channels of one pixel are taken as fully correlated (noise of light, not of colour), which errs upwards.
std::vector<BlockDifference> compare_blocks(const Image& a, const Image& b, const Image* variance_a = nullptr,
                                            const Image* variance_b = nullptr, int block_size = 8);

/// The p-quantile (0 <= p <= 1) of |relative|, linear between order statistics; 0 when there is no block.
double block_quantile(const std::vector<BlockDifference>& blocks, double p);
/// Root mean square of `relative`, and of `standard_error`.
double block_rms(const std::vector<BlockDifference>& blocks);
double block_noise_rms(const std::vector<BlockDifference>& blocks);

/// The share of blocks whose difference is explained by noise and a true difference of at most `tolerance`:
/// |relative| <= tolerance + sigmas * standard_error. With sigmas = 2, a block without any true difference passes
/// with probability >= 0.95 at tolerance 0 (normal distribution), and with certainty in the limit of no noise.
double share_within(const std::vector<BlockDifference>& blocks, double tolerance, double sigmas = 2.0);

/// An estimate of the p-quantile of the true |relative|, with the noise taken out: the t for which a share p of the
/// blocks would lie at or below the observed quantile, had each a normal true difference whose p-quantile is t, plus
/// its own noise. 0 when the noise alone explains the observed quantile.
double noise_free_quantile(const std::vector<BlockDifference>& blocks, double p);

}  // namespace embrun
