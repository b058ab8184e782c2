#pragma once

// How far two pictures of the same scene are from each other, and how much of that is noise.

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace embrun {

struct CompareOptions {
  /// Radiance (EXR, PFM, HDR) becomes display values as in a PNG file rendered with these, but unrounded.
  std::string tone = "filmic";
  double exposure = 0;  ///< stops
  /// The same scenes rendered again with a seed that neither A nor B has: tells the noise without bias. May be empty.
  std::string half_a, half_b;
  double pixels_per_degree = 67.02064327658226;  ///< of FLIP: how finely the eye sees the pixels

  /// Picture of the differences, or empty: .png in false colours; .exr, .pfm, .hdr the values themselves.
  std::string diff_file;
  std::string diff_of = "display";   ///< display (root mean square over the channels), flip, relative
  std::optional<double> diff_scale;  ///< value of the brightest colour; default: round, above 99.5 % of the values
};

/// An estimate with its 95 % confidence interval.
struct IntervalEstimate {
  double value = 0, low = 0, high = 0;
};

/// Figures of two pictures, A and the reference B.
struct Comparison {
  std::string a, b;
  int width = 0, height = 0;
  std::string display_a, display_b;  ///< where the display values come from: the tone curve, or the file

  // Of display values in [0, 1].
  double mse = 0, rmse = 0;       ///< over all pixels and channels
  double psnr = 0;                ///< dB; infinite for equal pictures
  std::optional<double> ssim;     ///< none for pictures below 11 pixels
  double flip = 0, flip_p95 = 0;  ///< mean, and the value that 95 % of the pixels do not exceed

  // MSE = bias + noise, if the noise of at least one picture is known; the other then counts as free of noise.
  std::string noise_from_a, noise_from_b;  ///< "half", "variance" or "": unknown
  std::optional<IntervalEstimate> mse_bias, mse_noise;

  // Of radiance; none when a picture holds display values (PNG, JPEG).
  std::optional<double> relative_mse;                  ///< of (a - b)^2 / (b^2 + 0.01)
  std::optional<double> mean_ratio, mean_ratio_error;  ///< mean of A over mean of B, and its standard error
  // Of the differences of blocks of 8 x 8 pixels over their mean; none when no block fits.
  std::optional<double> block_share;  ///< share of the blocks within 2.5 %
  std::optional<double>
      block_share_noise;            ///< within 2.5 % and a standard error of the noise, where both noises are known
  std::optional<double> block_rms;  ///< root mean square
  std::optional<double> block_noise_rms;  ///< what of it is noise
  std::optional<double> block_p95;        ///< 95 % of the blocks differ by no more

  std::optional<double> diff_scale;  ///< of the picture of differences, if one was written
  std::vector<std::string> notes;    ///< what is to be known of these figures, a sentence each
};

/// Throws when an option is out of range or unknown.
void check_options(const CompareOptions& options);

/// Compares two picture files of one size: EXR, PFM, HDR, PNG or JPEG, told by their content. Throws for files that
/// cannot be read, hold values that are not finite or do not fit together.
Comparison compare_files(const std::string& a, const std::string& b, const CompareOptions& options = {});

/// Names of the figures, those of the JSON object: mse, rmse, psnr, ssim, flip, ...
std::vector<std::string> metric_names();
/// The figure of that name; none where it is not known. Throws for an unknown name, and lists them.
std::optional<double> metric(const Comparison& comparison, const std::string& name);

/// Several lines for people, ending with a line feed.
std::string to_text(const Comparison& comparison);
/// A JSON object; figures that are not known, and the infinite PSNR of equal pictures, are null.
std::string to_json(const Comparison& comparison);

}  // namespace embrun
