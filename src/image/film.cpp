#include "image/film.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"

namespace embrun {
namespace {

constexpr std::int64_t max_film_pixels = std::int64_t{1} << 28;

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

std::string window_text(const PixelWindow& w) {
  return size_text(w.width, w.height) + " at " + std::to_string(w.x) + "," + std::to_string(w.y);
}

/// True when `inner` lies inside `outer`; sums in 64 bits, since a user's crop may be anything.
bool contains(const PixelWindow& outer, const PixelWindow& inner) {
  const auto end = [](int start, int extent) { return static_cast<std::int64_t>(start) + extent; };
  return inner.x >= outer.x && inner.y >= outer.y && end(inner.x, inner.width) <= end(outer.x, outer.width) &&
         end(inner.y, inner.height) <= end(outer.y, outer.height);
}

void add(FilmPixel& a, const FilmPixel& b) {
  for (int c = 0; c < 3; ++c) {
    a.radiance[c] += b.radiance[c];
    a.radiance_squares[c] += b.radiance_squares[c];
    a.albedo[c] += b.albedo[c];
    a.normal[c] += b.normal[c];
  }
  a.depth += b.depth;
  a.samples += b.samples;
  a.hits += b.hits;
  a.bad_samples += b.bad_samples;
}

}  // namespace

Film make_film(int width, int height) { return make_film(width, height, {0, 0, width, height}); }

Film make_film(int width, int height, PixelWindow crop) {
  if (width < 1 || height < 1 || static_cast<std::int64_t>(width) * height > max_film_pixels) {
    throw Error("picture size " + size_text(width, height) + ": sides must be at least 1, pixels at most 2^28");
  }
  if (crop.width < 1 || crop.height < 1 || !contains({0, 0, width, height}, crop)) {
    throw Error("crop " + window_text(crop) + " is empty or sticks out of the picture of " + size_text(width, height));
  }
  Film film;
  film.display_width = width;
  film.display_height = height;
  film.window = crop;
  film.pixels.resize(static_cast<std::size_t>(crop.width) * static_cast<std::size_t>(crop.height));
  return film;
}

void merge(Film& into, const Film& part) {
  if (into.display_width != part.display_width || into.display_height != part.display_height) {
    throw Error("cannot merge films of pictures of " + size_text(into.display_width, into.display_height) + " and " +
                size_text(part.display_width, part.display_height));
  }
  if (!contains(into.window, part.window)) {
    throw Error("cannot merge films: window " + window_text(part.window) + " sticks out of " +
                window_text(into.window));
  }
  const PixelWindow& w = part.window;
  for (int y = w.y; y < w.y + w.height; ++y) {
    for (int x = w.x; x < w.x + w.width; ++x) {
      add(into.pixels[into.pixel_index(x, y)], part.pixels[part.pixel_index(x, y)]);
    }
  }
}

std::uint64_t bad_samples(const Film& film) {
  std::uint64_t count = 0;
  for (const FilmPixel& p : film.pixels) {
    count += p.bad_samples;
  }
  return count;
}

std::uint64_t good_samples(const Film& film) {
  std::uint64_t count = 0;
  for (const FilmPixel& p : film.pixels) {
    count += p.samples;
  }
  return count;
}

ImageLayers resolve(const Film& film) {
  const int width = film.window.width;
  const int height = film.window.height;
  Image beauty = make_image(width, height, 3, "beauty", {"R", "G", "B"});
  Image albedo = make_image(width, height, 3, "albedo", {"R", "G", "B"});
  Image normal = make_image(width, height, 3, "normal", {"X", "Y", "Z"});
  Image depth = make_image(width, height, 1, "depth", {"Z"});
  Image samples = make_image(width, height, 1, "samples", {"N"});
  Image variance = make_image(width, height, 3, "variance", {"R", "G", "B"});
  for (std::size_t i = 0; i < film.pixels.size(); ++i) {
    const FilmPixel& p = film.pixels[i];
    const double n = p.samples;
    for (std::size_t c = 0; c < 3 && p.samples > 0; ++c) {
      const double mean = p.radiance[c] / n;
      beauty.pixels[3 * i + c] = static_cast<float>(mean);
      albedo.pixels[3 * i + c] = static_cast<float>(static_cast<double>(p.albedo[c]) / n);
      normal.pixels[3 * i + c] = static_cast<float>(static_cast<double>(p.normal[c]) / n);
      if (p.samples > 1) {
        // s^2 / N, s^2 = (sum of squares - N mean^2) / (N - 1); rounding may leave it just below 0.
        const double spread = p.radiance_squares[c] - n * mean * mean;
        variance.pixels[3 * i + c] = static_cast<float>(std::max(0.0, spread / (n - 1.0) / n));
      }
    }
    depth.pixels[i] = p.hits > 0 ? static_cast<float>(p.depth / p.hits) : infinity;
    samples.pixels[i] = static_cast<float>(p.samples);
  }
  ImageLayers result;
  result.display_width = film.display_width;
  result.display_height = film.display_height;
  result.window = film.window;
  for (Image* image : {&beauty, &albedo, &normal, &depth, &samples, &variance}) {
    result.layers.push_back(std::move(*image));
  }
  return result;
}

double relative_error(const ImageLayers& layers) {
  const Image& beauty = layers.layer("beauty");
  const Image& variance = layers.layer("variance");
  const double weights[3] = {0.2126, 0.7152, 0.0722};
  double mean = 0, squares = 0;
  for (std::size_t i = 0; i < beauty.pixel_count(); ++i) {
    // The channels' noise comes from the same paths: standard errors add up.
    double error = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      mean += weights[c] * static_cast<double>(beauty.pixels[3 * i + c]);
      error += weights[c] * std::sqrt(static_cast<double>(variance.pixels[3 * i + c]));
    }
    squares += error * error;
  }
  const double count = static_cast<double>(beauty.pixel_count());
  return mean > 0 ? std::sqrt(squares / count) / (mean / count) : 0.0;
}

}  // namespace embrun
