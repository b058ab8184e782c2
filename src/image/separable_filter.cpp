#include "image/separable_filter.h"

#include <algorithm>
#include <cstddef>

#include "base/error.h"
#include "base/parallel.h"

namespace embrun {
namespace {

constexpr std::size_t rows_per_task = 16;

int radius_of(const FilterTaps& taps) {
  EMBRUN_CHECK(taps.size() % 2 == 1);
  return static_cast<int>(taps.size() / 2);
}

Image filter_rows(const Image& image, const FilterTaps& taps) {
  const int radius = radius_of(taps);
  Image out = make_image(image.width, image.height, 1);
  parallel_for(static_cast<std::size_t>(image.height), rows_per_task, [&](std::size_t begin, std::size_t end) {
    std::vector<double> padded(static_cast<std::size_t>(image.width + 2 * radius));
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (std::size_t i = 0; i < padded.size(); ++i) {
        const int x = std::clamp(static_cast<int>(i) - radius, 0, image.width - 1);
        padded[i] = static_cast<double>(image.at(x, y));
      }
      for (int x = 0; x < image.width; ++x) {
        double sum = 0;
        for (std::size_t k = 0; k < taps.size(); ++k) sum += taps[k] * padded[static_cast<std::size_t>(x) + k];
        out.at(x, y) = static_cast<float>(sum);
      }
    }
  });
  return out;
}

Image filter_columns(const Image& image, const FilterTaps& taps) {
  const int radius = radius_of(taps);
  Image out = make_image(image.width, image.height, 1);
  parallel_for(static_cast<std::size_t>(image.height), rows_per_task, [&](std::size_t begin, std::size_t end) {
    std::vector<double> sums(static_cast<std::size_t>(image.width));
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      std::fill(sums.begin(), sums.end(), 0.0);
      for (std::size_t k = 0; k < taps.size(); ++k) {
        const float* row =
            &image.pixels[image.index(0, std::clamp(y + static_cast<int>(k) - radius, 0, image.height - 1))];
        for (std::size_t x = 0; x < sums.size(); ++x) sums[x] += taps[k] * static_cast<double>(row[x]);
      }
      for (std::size_t x = 0; x < sums.size(); ++x) out.at(static_cast<int>(x), y) = static_cast<float>(sums[x]);
    }
  });
  return out;
}

}  // namespace

Image filter_separably(const Image& image, const FilterTaps& along_x, const FilterTaps& along_y) {
  EMBRUN_CHECK(image.channels == 1);
  if (image.pixels.empty()) return image;
  return filter_columns(filter_rows(image, along_x), along_y);
}

}  // namespace embrun
