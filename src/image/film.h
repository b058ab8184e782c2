#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/host_device.h"
#include "image/image.h"
#include "math/rgb.h"
#include "math/vec.h"

namespace embrun {

/// What one camera path brings to its pixel. The camera draws the position in the pixel from the pixel filter
/// (filter importance sampling), so every sample has weight 1 and touches one pixel only.
struct FilmSample {
  Rgb radiance;            ///< linear, scene-referred; finite and not negative, or the sample is bad
  Rgb albedo;              ///< reflectance that guides the denoiser: of the first hit, or of the first that is
                           ///< not specular; 0 where nothing is hit
  Vec3 normal;             ///< unit shading normal of the same hit, world space; 0 where nothing is hit
  float depth = infinity;  ///< distance along the camera ray to the first hit, metres; infinity: nothing is hit
  bool valid = true;       ///< false: the path failed; counted as bad, added to nothing
};

/// Sums over the samples of one pixel. Plain data: a device film is an array of these.
///
/// Radiance and its squares are summed in double: sums of up to 10^6 samples keep a relative error below 1e-10,
/// which the difference in variance() needs. The features need less.
struct FilmPixel {
  double radiance[3] = {0, 0, 0};
  double radiance_squares[3] = {0, 0, 0};
  double depth = 0;             ///< over the samples that hit
  float albedo[3] = {0, 0, 0};  ///< over all good samples; a miss adds 0
  float normal[3] = {0, 0, 0};
  std::uint32_t samples = 0;      ///< good samples
  std::uint32_t hits = 0;         ///< good samples with a finite depth
  std::uint32_t bad_samples = 0;  ///< left out: not valid, or a radiance that is NaN, infinite or negative
};

/// True when the sample may be added: flagged valid, and its radiance finite and not negative.
EMBRUN_FN bool is_good(const FilmSample& s) {
  return s.valid && is_finite(s.radiance) && s.radiance.r >= 0.0f && s.radiance.g >= 0.0f && s.radiance.b >= 0.0f;
}

/// Adds a sample to its pixel. Returns false, and only counts it, when it is bad. Features that are not finite
/// count as 0 (a depth that is not finite, as a miss).
EMBRUN_FN bool add_sample(FilmPixel& pixel, const FilmSample& s) {
  if (!is_good(s)) {
    ++pixel.bad_samples;
    return false;
  }
  for (int c = 0; c < 3; ++c) {
    const double v = static_cast<double>(s.radiance[c]);
    pixel.radiance[c] += v;
    pixel.radiance_squares[c] += v * v;
    pixel.albedo[c] += is_finite(s.albedo[c]) ? s.albedo[c] : 0.0f;
    pixel.normal[c] += is_finite(s.normal[c]) ? s.normal[c] : 0.0f;
  }
  if (is_finite(s.depth)) {
    pixel.depth += static_cast<double>(s.depth);
    ++pixel.hits;
  }
  ++pixel.samples;
  return true;
}

/// The sums of a picture, or of a crop of it. The same samples added to each pixel in the same order give the same
/// bits, whatever the threads or the order of the pixels; different pixels may be added to concurrently.
struct Film {
  int display_width = 0, display_height = 0;  ///< size of the full picture
  PixelWindow window;                         ///< the part that this film holds
  std::vector<FilmPixel> pixels;              ///< window.width * window.height, row by row from the top

  std::size_t pixel_count() const { return pixels.size(); }
  /// Index into `pixels` of the picture's pixel (x, y), which must lie in the window.
  std::size_t pixel_index(int x, int y) const {
    return static_cast<std::size_t>(y - window.y) * static_cast<std::size_t>(window.width) +
           static_cast<std::size_t>(x - window.x);
  }
};

/// An empty film of the whole picture. Throws Error when a size is not positive or exceeds 2^28 pixels.
Film make_film(int width, int height);
/// An empty film of a crop of the picture. Throws Error also when the crop is empty or sticks out of the picture.
Film make_film(int width, int height, PixelWindow crop);

/// Adds a sample to pixels[pixel_index]; see add_sample(FilmPixel&, ...).
inline bool add_sample(Film& film, std::size_t pixel_index, const FilmSample& sample) {
  return add_sample(film.pixels[pixel_index], sample);
}

/// Adds the sums of `part`, a film of the same picture whose window lies inside that of `into` (another pass over
/// the same pixels, or one crop of a picture rendered in pieces). Merging in a fixed order gives the same bits each
/// time; merging n passes equals one film that got all their samples up to the rounding of the sums.
/// Throws Error when the pictures differ in size or the window sticks out.
void merge(Film& into, const Film& part);

/// Number of bad samples in all pixels.
std::uint64_t bad_samples(const Film& film);
/// Number of good samples in all pixels.
std::uint64_t good_samples(const Film& film);

/// Names of the layers that resolve() makes, in order.
inline constexpr const char* film_layer_names[] = {"beauty", "albedo", "normal", "depth", "samples", "variance"};

/// Turns the sums into layers:
/// - beauty (R G B): mean radiance;
/// - albedo (R G B), normal (X Y Z): means over all samples, so that an edge fades (normals are not renormalised);
/// - depth (Z): mean over the samples that hit, metres; infinite where none did;
/// - samples (N): good samples per pixel;
/// - variance (R G B): unbiased estimate of the variance of the beauty's value, s^2 / N, assuming independent
///   samples (for stratified samples it errs upwards); 0 where N < 2, which means unknown.
/// Pixels without a sample are 0 in every layer, but infinite in depth.
ImageLayers resolve(const Film& film);

/// Root mean square over the pixels of the standard error of the mean luminance, divided by the mean luminance:
/// the "relative error" of a render. 0 for a black picture.
double relative_error(const ImageLayers& layers);

}  // namespace embrun
