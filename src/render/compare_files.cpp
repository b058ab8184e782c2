#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string_view>

#include "base/error.h"
#include "embrun/compare.h"
#include "image/false_color.h"
#include "image/flip.h"
#include "image/metrics.h"
#include "image/noise_split.h"
#include "image/ssim.h"
#include "image/tone_curve.h"
#include "io/atomic_file.h"
#include "io/file_bytes.h"
#include "io/image_read.h"
#include "io/image_write.h"

namespace embrun {
namespace {

constexpr const char* differences[] = {"display", "flip", "relative"};

/// A picture file as it is compared, with three channels.
struct PictureFile {
  std::string path;
  bool has_radiance = false;  ///< else display values
  Image values;               ///< radiance or display values
  Image display;
  std::optional<Image> variance;      ///< of the radiance
  std::optional<PixelWindow> window;  ///< of an EXR: what part of its picture it shows
  std::string why_no_variance;
  std::string seed;  ///< that an EXR of ours was rendered with; else empty
};

// ---- reading -----------------------------------------------------------------------------------------------------

/// Throws Error that names the first value which is not finite.
void check_finite(const Image& image, const std::string& path, const std::string& what) {
  std::size_t bad = 0, first = 0;
  const auto channels = static_cast<std::size_t>(image.channels);
  for (std::size_t i = image.pixel_count(); i-- > 0;) {
    const float* pixel = &image.pixels[i * channels];
    if (std::all_of(pixel, pixel + channels, [](float v) { return std::isfinite(v); })) continue;
    ++bad;
    first = i;
  }
  if (bad == 0) return;
  const auto width = static_cast<std::size_t>(image.width);
  throw Error(
      fmt::format("{}: {} {} not finite (NaN or infinite){}, the first at column {}, row {}; such pictures "
                  "cannot be compared",
                  path, bad, bad == 1 ? "pixel is" : "pixels are", what, first % width, first / width));
}

Image in_three_channels(const Image& image) {
  if (image.channels == 3) return image;
  Image out = make_image(image.width, image.height, 3, image.name);
  for (std::size_t i = 0; i < out.pixels.size(); ++i) out.pixels[i] = image.pixels[i / 3];
  return out;
}

bool starts_with(std::span<const std::byte> bytes, std::string_view magic) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()), std::min(bytes.size(), magic.size()));
  return head == magic;
}

/// The variance layer, if it tells the noise of the beauty layer.
void read_variance(PictureFile& picture, std::span<const std::byte> bytes) {
  ImageMetadata metadata;
  ImageLayers layers = read_exr_layers(bytes, picture.path, &metadata);
  picture.window = layers.window;
  for (const auto& [key, value] : metadata)
    if (key == "seed") picture.seed = value;
  const auto denoised = [](const auto& entry) { return entry.first == "denoised"; };
  const Image* variance = layers.find("variance");
  const Image* samples = layers.find("samples");
  if (variance == nullptr || (variance->channels != 3 && variance->channels != 1)) {
    picture.why_no_variance = "it has no variance layer";
  } else if (std::any_of(metadata.begin(), metadata.end(), denoised)) {
    picture.why_no_variance = "it was denoised, and its variance layer tells the noise before that";
  } else if (samples != nullptr &&
             std::any_of(samples->pixels.begin(), samples->pixels.end(), [](float n) { return n < 2; })) {
    picture.why_no_variance = "a variance needs at least two samples in each pixel";
  } else {
    check_finite(*variance, picture.path, " in the layer \"variance\"");
    picture.variance = in_three_channels(*variance);
  }
}

PictureFile read_picture(const std::string& path, const ToneSettings& tone) {
  const std::vector<std::byte> bytes = read_file_bytes(path);
  PictureFile picture;
  picture.path = path;
  picture.has_radiance = !starts_with(bytes, "\x89PNG") && !starts_with(bytes, "\xff\xd8\xff");
  picture.values = read_image(bytes, path, {}, picture.has_radiance ? PixelEncoding::srgb : PixelEncoding::raw);
  check_finite(picture.values, path, "");
  picture.values = in_three_channels(picture.values);
  picture.display = picture.has_radiance ? display_values(picture.values, tone) : picture.values;
  if (starts_with(bytes, "\x76\x2f\x31\x01")) {
    read_variance(picture, bytes);
  } else {
    picture.why_no_variance = "only EXR files have a variance layer";
  }
  return picture;
}

void check_fit(const PictureFile& a, const PictureFile& b) {
  if (a.values.width != b.values.width || a.values.height != b.values.height) {
    throw Error(fmt::format("{} has {}x{} pixels, {} has {}x{}: only pictures of one size can be compared", a.path,
                            a.values.width, a.values.height, b.path, b.values.width, b.values.height));
  }
  if (a.window && b.window && (a.window->x != b.window->x || a.window->y != b.window->y)) {
    throw Error(
        fmt::format("{} shows the part of its picture that begins at {},{}, {} the one at {},{}: they cannot be "
                    "compared",
                    a.path, a.window->x, a.window->y, b.path, b.window->x, b.window->y));
  }
}

/// The picture of the same scene with other noise, or none.
std::optional<PictureFile> read_half(const PictureFile& of, const std::string& path, const char* name,
                                     const ToneSettings& tone) {
  if (path.empty()) return std::nullopt;
  PictureFile half = read_picture(path, tone);
  check_fit(of, half);
  if (half.has_radiance != of.has_radiance) {
    throw Error(fmt::format(
        "{}: one of {} and its half holds radiance, the other display values: give files of one kind", path, of.path));
  }
  if (half.values.pixels == of.values.pixels) {
    throw Error(
        fmt::format("{}: the half of {} ({}) is the same picture: render it with another --seed", path, of.path, name));
  }
  return half;
}

// ---- figures -----------------------------------------------------------------------------------------------------

/// A picture and what tells its noise.
struct Side {
  PictureFile picture;
  std::optional<PictureFile> half;
  std::optional<Image> display_variance;   ///< without a half
  std::optional<Image> radiance_variance;  ///< from either
  std::string source;                      ///< half, variance or ""

  NoisyPicture noisy() const {
    return {&picture.display, half ? &half->display : nullptr, display_variance ? &*display_variance : nullptr};
  }
};

Side make_side(PictureFile picture, const std::string& half, const char* name, const ToneSettings& tone) {
  Side side;
  side.picture = std::move(picture);
  side.half = read_half(side.picture, half, name, tone);
  if (side.half) {
    side.source = "half";
    side.radiance_variance = variance_of_halves(side.picture.values, side.half->values);
  } else if (side.picture.variance) {
    side.source = "variance";
    side.radiance_variance = side.picture.variance;
    side.display_variance = display_variance(side.picture.values, *side.picture.variance, tone);
  }
  return side;
}

/// Says where two pictures share a seed that the estimate of their noise takes for independent.
void note_common_seeds(Comparison& result, const Side& a, const Side& b) {
  const auto same = [&](const PictureFile& x, const PictureFile& y) { return !x.seed.empty() && x.seed == y.seed; };
  const auto note = [&](const PictureFile& x, const PictureFile& y, const char* remedy) {
    if (!same(x, y)) return;
    result.notes.push_back(
        fmt::format("{} and {} were rendered with the same seed, so their noise may be alike, which "
                    "makes the bias too small: {}",
                    x.path, y.path, remedy));
  };
  if (!a.half || !b.half) note(a.picture, b.picture, "give halves of both, or another seed to one");
  if (b.half) note(a.picture, *b.half, "a file and the other's half need seeds of their own");
  if (a.half) note(*a.half, b.picture, "a file and the other's half need seeds of their own");
}

void add_noise(Comparison& result, const Side& a, const Side& b) {
  result.noise_from_a = a.source;
  result.noise_from_b = b.source;
  for (const Side* side : {&a, &b}) {
    if (!side->source.empty()) continue;
    const bool other_known = !a.source.empty() || !b.source.empty();
    result.notes.push_back(fmt::format("the noise of {} is not known ({}){}", side->picture.path,
                                       side->picture.why_no_variance, other_known ? ": all of it counts as bias" : ""));
  }
  if (a.source.empty() && b.source.empty()) return;
  if (a.picture.display.pixel_count() < 2) {
    result.notes.push_back("one pixel tells no noise");
    return;
  }
  note_common_seeds(result, a, b);
  const SquaredErrorSplit split = split_squared_error(a.noisy(), b.noisy());
  result.mse_bias = {split.difference.value, split.difference.low, split.difference.high};
  result.mse_noise = {split.noise.value, split.noise.low, split.noise.high};
  if (a.source != "variance" && b.source != "variance") return;
  // A film's variance is that of independent samples. Stratified ones have less, by an unknown factor.
  result.mse_bias->high = split_squared_error({&a.picture.display}, {&b.picture.display}).difference.high;
  result.mse_noise->low = 0;
  result.notes.push_back(
      "variance layers tell the most that the noise can be, for stratified samples have less: the bias lies "
      "between what that leaves and the whole MSE. Renders with another seed (--half-a, --half-b) tell it "
      "exactly");
}

void add_radiance(Comparison& result, const Side& a, const Side& b) {
  const Image& va = a.picture.values;
  const Image& vb = b.picture.values;
  if (!a.picture.has_radiance || !b.picture.has_radiance) {
    result.notes.push_back("figures of radiance need two EXR, PFM or HDR files");
    return;
  }
  result.relative_mse = relative_mean_squared_error(va, vb);
  if (mean_value(vb) > 0) {
    const Estimate ratio = mean_ratio(va, vb);
    result.mean_ratio = ratio.value;
    result.mean_ratio_error = ratio.standard_error;
  }
  const bool noise_known = a.radiance_variance && b.radiance_variance;
  const auto blocks = compare_blocks(va, vb, noise_known ? &*a.radiance_variance : nullptr,
                                     noise_known ? &*b.radiance_variance : nullptr);
  if (blocks.empty()) return;
  constexpr double tolerance = 0.025;
  result.block_share = share_within(blocks, tolerance, 0.0);
  result.block_rms = block_rms(blocks);
  result.block_p95 = block_quantile(blocks, 0.95);
  if (noise_known) {
    result.block_share_noise = share_within(blocks, tolerance, 1.0);
    result.block_noise_rms = block_noise_rms(blocks);
  }
}

double quantile(std::vector<float> values, double p) {
  const auto place = static_cast<std::ptrdiff_t>(p * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return static_cast<double>(values[static_cast<std::size_t>(place)]);
}

/// Per pixel: root mean square over the channels of what `squared` gives for a channel's values.
template <class Squared>
Image rms_map(const Image& a, const Image& b, const Squared& squared) {
  Image map = make_image(a.width, a.height, 1);
  for (std::size_t i = 0; i < map.pixels.size(); ++i) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c)
      sum += squared(static_cast<double>(a.pixels[3 * i + c]), static_cast<double>(b.pixels[3 * i + c]));
    map.pixels[i] = static_cast<float>(std::sqrt(sum / 3));
  }
  return map;
}

Image difference_map(const Side& a, const Side& b, const Image& flip, const std::string& name) {
  if (name == "flip") return flip;
  if (name == "display")
    return rms_map(a.picture.display, b.picture.display, [](double x, double y) { return (x - y) * (x - y); });
  if (!a.picture.has_radiance || !b.picture.has_radiance)
    throw Error("relative differences need radiance: two EXR, PFM or HDR files");
  return rms_map(a.picture.values, b.picture.values,
                 [](double x, double y) { return (x - y) * (x - y) / (y * y + 0.01); });
}

void write_difference(Comparison& result, Image map, const CompareOptions& options) {
  ImageWriteOptions write;
  map.name.clear();
  if (image_format_of(options.diff_file) != ImageFormat::png) {
    write_image(options.diff_file, map, write, {{"software", "Embrun"}, {"difference", options.diff_of}});
    return;
  }
  const double scale = options.diff_scale.value_or(false_color_scale(map));
  result.diff_scale = scale;
  write.tone = {0, ToneCurve::srgb, false};
  write_image(options.diff_file, false_color_picture(map, scale), write,
              {{"software", "Embrun"},
               {"difference", fmt::format("{} of {} and {}", options.diff_of, result.a, result.b)},
               {"scale", fmt::format("black 0, pale yellow {:g} and above", scale)}});
}

void check_difference_file(const std::string& a, const std::string& b, const CompareOptions& options) {
  check_image_output(options.diff_file);
  for (const std::string& input : {a, b, options.half_a, options.half_b}) {
    std::error_code none;
    if (!input.empty() && std::filesystem::equivalent(input, options.diff_file, none))
      throw Error(fmt::format("{}: the picture of differences would replace a picture that is compared", input));
  }
}

std::string display_note(const PictureFile& picture, const ToneSettings& tone) {
  if (!picture.has_radiance) return "as stored";
  return fmt::format("{} tone curve, exposure {:+g} stops", name_of(tone.curve), static_cast<double>(tone.exposure));
}

}  // namespace

void check_options(const CompareOptions& o) {
  tone_curve_from_name(o.tone);
  if (!(std::abs(o.exposure) <= 100))
    throw Error(fmt::format("exposure {}: it must lie within -100 and 100 stops", o.exposure));
  if (!(o.pixels_per_degree >= 1 && o.pixels_per_degree <= 1000))
    throw Error(fmt::format("{} pixels per degree: give 1 to 1000", o.pixels_per_degree));
  if (std::none_of(std::begin(differences), std::end(differences), [&](const char* name) { return o.diff_of == name; }))
    throw Error(fmt::format("unknown difference \"{}\"; there are: display, flip, relative", o.diff_of));
  if (o.diff_scale && !(*o.diff_scale > 0 && std::isfinite(*o.diff_scale)))
    throw Error(fmt::format("scale {} of the differences: it must be positive", *o.diff_scale));
}

Comparison compare_files(const std::string& path_a, const std::string& path_b, const CompareOptions& options) {
  check_options(options);
  if (!options.diff_file.empty()) check_difference_file(path_a, path_b, options);
  const ToneSettings tone{static_cast<float>(options.exposure), tone_curve_from_name(options.tone), false};
  PictureFile picture_a = read_picture(path_a, tone), picture_b = read_picture(path_b, tone);
  check_fit(picture_a, picture_b);
  const Side a = make_side(std::move(picture_a), options.half_a, "A", tone);
  const Side b = make_side(std::move(picture_b), options.half_b, "B", tone);

  Comparison result;
  result.a = path_a;
  result.b = path_b;
  result.width = a.picture.values.width;
  result.height = a.picture.values.height;
  result.display_a = display_note(a.picture, tone);
  result.display_b = display_note(b.picture, tone);
  if (a.picture.has_radiance != b.picture.has_radiance)
    result.notes.push_back(
        "one file holds radiance, the other display values: give the tone curve and exposure that the "
        "second was made with");

  const Image& display_a = a.picture.display;
  const Image& display_b = b.picture.display;
  result.mse = mean_squared_error(display_a, display_b);
  result.rmse = std::sqrt(result.mse);
  result.psnr = peak_signal_to_noise(result.mse);
  result.ssim = structural_similarity(display_a, display_b);
  if (!result.ssim) result.notes.push_back("SSIM needs pictures of at least 11x11 pixels");
  const Image flip = flip_map(display_a, display_b, options.pixels_per_degree);
  result.flip = mean_value(flip);
  result.flip_p95 = quantile(flip.pixels, 0.95);
  add_noise(result, a, b);
  add_radiance(result, a, b);
  if (!options.diff_file.empty()) write_difference(result, difference_map(a, b, flip, options.diff_of), options);
  return result;
}

}  // namespace embrun
