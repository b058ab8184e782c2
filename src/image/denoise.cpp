#include "image/denoise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "math/vec.h"

namespace embrun {
namespace {

/// One channel with a border of repeated edge pixels, so that patches may hang over the edge.
struct Plane {
  int border = 0;
  std::size_t stride = 0;
  std::vector<float> values;

  Plane() = default;
  Plane(int width, int height, int margin)
      : border(margin),
        stride(static_cast<std::size_t>(width + 2 * margin)),
        values(stride * static_cast<std::size_t>(height + 2 * margin), 0.0f) {}

  float* row(int y) { return values.data() + static_cast<std::size_t>(y + border) * stride + border; }
  const float* row(int y) const { return values.data() + static_cast<std::size_t>(y + border) * stride + border; }
};

using Planes = std::array<Plane, 3>;

void fill_border(Plane& plane, int width, int height) {
  for (int y = -plane.border; y < height + plane.border; ++y) {
    float* row = plane.row(y);
    if (y < 0 || y >= height) {
      std::memcpy(row, plane.row(std::clamp(y, 0, height - 1)), sizeof(float) * static_cast<std::size_t>(width));
    }
    std::fill(row - plane.border, row, row[0]);
    std::fill(row + width, row + width + plane.border, row[width - 1]);
  }
}

/// A channel of an image as a plane; values that are not finite become `substitute`.
Plane plane_of(const Image& image, int channel, int margin, float substitute = 0.0f) {
  Plane plane(image.width, image.height, margin);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float v = image.at(x, y, std::min(channel, image.channels - 1));
      plane.row(y)[x] = is_finite(v) ? v : substitute;
    }
  }
  fill_border(plane, image.width, image.height);
  return plane;
}

/// What the weights are made of.
struct Guide {
  int width = 0, height = 0;
  Planes colour;
  Planes variance;  ///< of the colour, smoothed
  Planes excess;    ///< the fireflies' light, spread: to be added to the filtered colour
  bool has_albedo = false, has_normal = false, has_depth = false;
  Planes albedo;
  Planes normal;
  Plane closeness;        ///< 1 / depth; 0 at infinity
  Plane depth_tolerance;  ///< squared, in units of closeness
};

// --- preparing ---

/// Calls f(x, y) for every pixel, rows in parallel.
template <class F>
void for_each_pixel(int width, int height, const F& f) {
  parallel_for(static_cast<std::size_t>(height), 8, [&](std::size_t begin, std::size_t end) {
    for (auto y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < width; ++x) {
        f(x, y);
      }
    }
  });
}

/// Mean over the (2 r + 1)^2 neighbourhood; r at most the plane's border.
Plane box_mean(const Plane& plane, int width, int height, int r) {
  Plane across(width, height, plane.border);
  Plane result(width, height, plane.border);
  const float share = 1.0f / static_cast<float>(2 * r + 1);
  for_each_pixel(width, height, [&](int x, int y) {
    float sum = 0;
    for (int i = -r; i <= r; ++i) {
      sum += plane.row(y)[x + i];
    }
    across.row(y)[x] = sum * share;
  });
  fill_border(across, width, height);
  for_each_pixel(width, height, [&](int x, int y) {
    float sum = 0;
    for (int i = -r; i <= r; ++i) {
      sum += across.row(y + i)[x];
    }
    result.row(y)[x] = sum * share;
  });
  fill_border(result, width, height);
  return result;
}

/// Noise of a plane from its own differences, where no variance is known: the mean square of the second difference
/// 4 u - (its four neighbours), whose variance is 20 times that of independent noise (after [Immerkaer1996]). Edges
/// count as noise.
Plane variance_from_differences(const Plane& u, int width, int height) {
  Plane squares(width, height, u.border);
  for_each_pixel(width, height, [&](int x, int y) {
    const float d = 4.0f * u.row(y)[x] - u.row(y)[x - 1] - u.row(y)[x + 1] - u.row(y - 1)[x] - u.row(y + 1)[x];
    squares.row(y)[x] = d * d / 20.0f;
  });
  fill_border(squares, width, height);
  return box_mean(squares, width, height, 2);
}

/// Takes fireflies out: a pixel much brighter than all but two of its 24 neighbours, by its own account mostly noise,
/// gets the brightness of the third brightest, and the variance that goes with it. A glint that all samples agree on
/// stays. Returns what was taken off: light all the same, often the only sample of many pixels that found it.
Planes take_fireflies(Planes& colour, Planes& variance, int width, int height) {
  constexpr float most = 64.0f;  // times the neighbours' brightness: what is beyond is lost, or it would make a blob
  Plane kept(width, height, colour[0].border);   // share of the colour that stays
  Plane taken(width, height, colour[0].border);  // share that is returned
  const auto brightness = [&](int x, int y) { return colour[0].row(y)[x] + colour[1].row(y)[x] + colour[2].row(y)[x]; };
  for_each_pixel(width, height, [&](int x, int y) {
    std::array<float, 3> brightest{};
    for (int j = std::max(y - 2, 0); j <= std::min(y + 2, height - 1); ++j) {
      for (int i = std::max(x - 2, 0); i <= std::min(x + 2, width - 1); ++i) {
        const float b = i == x && j == y ? 0.0f : brightness(i, j);
        if (b > brightest[2]) {
          brightest[2] = b;
          std::sort(brightest.begin(), brightest.end(), std::greater<>());
        }
      }
    }
    const float own = brightness(x, y);
    const float error = sqrtf(variance[0].row(y)[x]) + sqrtf(variance[1].row(y)[x]) + sqrtf(variance[2].row(y)[x]);
    const bool is_firefly = brightest[2] > 0.0f && own > 1.5f * brightest[2] && error > 0.25f * (own - brightest[2]);
    kept.row(y)[x] = is_firefly ? brightest[2] / own : 1.0f;
    taken.row(y)[x] = is_firefly ? min_of(own - brightest[2], most * brightest[2]) / own : 0.0f;
  });
  Planes excess;
  for (std::size_t c = 0; c < 3; ++c) {
    excess[c] = Plane(width, height, colour[c].border);
    for_each_pixel(width, height, [&](int x, int y) {
      excess[c].row(y)[x] = colour[c].row(y)[x] * taken.row(y)[x];
      colour[c].row(y)[x] *= kept.row(y)[x];
      variance[c].row(y)[x] *= square(kept.row(y)[x]);
    });
    fill_border(colour[c], width, height);
    fill_border(variance[c], width, height);
  }
  return excess;
}

/// Three box means over the whole border: close to a Gaussian.
Plane wide_blur(Plane plane, int width, int height) {
  fill_border(plane, width, height);
  for (int pass = 0; pass < 3; ++pass) {
    plane = box_mean(plane, width, height, plane.border);
  }
  return plane;
}

/// Spreads the excess over some twenty pixels around in proportion to the noise there (its standard deviation), so
/// that what is clean, such as a sky, stays so. The sum is kept, but for the picture's edges.
void spread_excess(Planes& excess, const Planes& variance, int width, int height) {
  for (std::size_t c = 0; c < 3; ++c) {
    Plane deviation(width, height, excess[c].border);
    for_each_pixel(width, height, [&](int x, int y) { deviation.row(y)[x] = sqrtf(variance[c].row(y)[x]); });
    const Plane around = wide_blur(deviation, width, height);
    for_each_pixel(width, height, [&](int x, int y) {
      const float noise = around.row(y)[x];
      excess[c].row(y)[x] = noise > 0.0f ? excess[c].row(y)[x] / noise : 0.0f;
    });
    excess[c] = wide_blur(std::move(excess[c]), width, height);
    for_each_pixel(width, height, [&](int x, int y) { excess[c].row(y)[x] *= deviation.row(y)[x]; });
  }
}

/// The squared difference in closeness that a plane surface through the pixel shows from one pixel to the next (the
/// smaller of both sides', so that a step does not count), and 1 % of the closeness; both with a fifth to spare.
Plane tolerance_of_depth(const Plane& closeness, int width, int height) {
  Plane result(width, height, closeness.border);
  for_each_pixel(width, height, [&](int x, int y) {
    const float here = closeness.row(y)[x];
    const auto step = [&](float before, float after) { return min_of(fabsf(here - before), fabsf(after - here)); };
    const float dx = step(closeness.row(y)[x - 1], closeness.row(y)[x + 1]);
    const float dy = step(closeness.row(y - 1)[x], closeness.row(y + 1)[x]);
    result.row(y)[x] = 1.44f * (dx * dx + dy * dy + square(0.01f * here)) + 1e-20f;
  });
  fill_border(result, width, height);
  return result;
}

const Image* feature(const ImageLayers& layers, const char* name, const Image& beauty) {
  const Image* image = layers.find(name);
  return image != nullptr && image->width == beauty.width && image->height == beauty.height && image->channels > 0
             ? image
             : nullptr;
}

/// Colour and variance with the fireflies out, features as planes.
Guide make_guide(const ImageLayers& layers, const Image& beauty, int margin) {
  Guide guide;
  guide.width = beauty.width;
  guide.height = beauty.height;
  const int w = beauty.width, h = beauty.height;
  const Image* variance = feature(layers, "variance", beauty);
  const Image* samples = feature(layers, "samples", beauty);
  const Image* albedo = feature(layers, "albedo", beauty);
  const Image* normal = feature(layers, "normal", beauty);
  const Image* depth = feature(layers, "depth", beauty);
  for (int channel = 0; channel < 3; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    guide.colour[c] = plane_of(beauty, channel, margin);
    const Plane guessed = variance_from_differences(guide.colour[c], w, h);
    guide.variance[c] = variance != nullptr ? plane_of(*variance, channel, margin) : guessed;
    for_each_pixel(w, h, [&](int x, int y) {
      float& v = guide.variance[c].row(y)[x];
      const bool unknown = samples != nullptr && !(samples->at(x, y) >= 2.0f);
      v = max_of(unknown ? guessed.row(y)[x] : v, 0.0f);
    });
    fill_border(guide.variance[c], w, h);
    if (albedo != nullptr) {
      guide.albedo[c] = plane_of(*albedo, channel, margin);
    }
    if (normal != nullptr) {
      guide.normal[c] = plane_of(*normal, channel, margin);
    }
  }
  guide.has_albedo = albedo != nullptr;
  guide.has_normal = normal != nullptr;
  guide.has_depth = depth != nullptr;
  if (depth != nullptr) {
    guide.closeness = plane_of(*depth, 0, margin, infinity);
    for (float& v : guide.closeness.values) {
      v = v > 0.0f ? 1.0f / v : 0.0f;
    }
    guide.depth_tolerance = tolerance_of_depth(guide.closeness, w, h);
  }
  guide.excess = take_fireflies(guide.colour, guide.variance, w, h);
  // The variance of few samples is itself noisy, and low where the value happens to be low; its local mean is not.
  for (Plane& plane : guide.variance) {
    plane = box_mean(plane, w, h, 1);
  }
  spread_excess(guide.excess, guide.variance, w, h);
  return guide;
}

// --- filtering ---

constexpr int tile_size = 64;
constexpr float least_noise = 1e-10f;  // variance below which pixels count as noise-free

/// Sums over one tile, and scratch rows that also hold the overhang of its patches.
struct Tile {
  int x0, y0, x1, y1;  ///< half-open
  int overhang;
  std::size_t stride;
  std::vector<float> distance, across;
  std::array<std::vector<float>, 3> sums;
  std::vector<float> weights;

  Tile(int left, int top, int right, int bottom, int patch_radius)
      : x0(left), y0(top), x1(right), y1(bottom), overhang(patch_radius) {
    stride = static_cast<std::size_t>(x1 - x0 + 2 * overhang);
    const std::size_t size = stride * static_cast<std::size_t>(y1 - y0 + 2 * overhang);
    distance.assign(size, 0.0f);
    across.assign(size, 0.0f);
    weights.assign(size, 0.0f);
    for (std::vector<float>& sum : sums) {
      sum.assign(size, 0.0f);
    }
  }
  float* row(std::vector<float>& values, int y) const {
    return values.data() + static_cast<std::size_t>(y - y0 + overhang) * stride + overhang - x0;
  }
};

/// Squared distance of the colours at p and p + (dx, dy) in units of their noise, less what the noise alone brings
/// [Rousselle2012, Rousselle2013], on rows [ya, yb) and columns [xa, xb).
void colour_distances(const Guide& g, float strength, int dx, int dy, int xa, int xb, int ya, int yb, Tile& tile) {
  const float tolerance = 3.0f * strength * strength;  // 3: the mean over the channels
  for (int y = ya; y < yb; ++y) {
    float* distance = tile.row(tile.distance, y);
    std::fill(distance + xa, distance + xb, 0.0f);
    for (std::size_t c = 0; c < 3; ++c) {
      const float* u = g.colour[c].row(y);
      const float* u_q = g.colour[c].row(y + dy) + dx;
      const float* v = g.variance[c].row(y);
      const float* v_q = g.variance[c].row(y + dy) + dx;
      for (int x = xa; x < xb; ++x) {
        const float d = u[x] - u_q[x];
        const float noise = v[x] + (v[x] < v_q[x] ? v[x] : v_q[x]);
        distance[x] += (d * d - noise) / (least_noise + tolerance * (v[x] + v_q[x]));
      }
    }
  }
}

/// Replaces each distance by the mean over its patch.
void average_over_patches(int xa, int xb, int ya, int yb, Tile& tile) {
  const int f = tile.overhang;
  const float share = 1.0f / static_cast<float>((2 * f + 1) * (2 * f + 1));
  for (int y = ya - f; y < yb + f; ++y) {
    const float* distance = tile.row(tile.distance, y);
    float* across = tile.row(tile.across, y);
    for (int x = xa; x < xb; ++x) {
      float sum = 0;
      for (int i = -f; i <= f; ++i) {
        sum += distance[x + i];
      }
      across[x] = sum;
    }
  }
  for (int y = ya; y < yb; ++y) {
    float* distance = tile.row(tile.distance, y);
    std::fill(distance + xa, distance + xb, 0.0f);
    for (int i = -f; i <= f; ++i) {
      const float* across = tile.row(tile.across, y + i);
      for (int x = xa; x < xb; ++x) {
        distance[x] += across[x] * share;
      }
    }
  }
}

/// Raises the distances of a row to those of the features, where these are larger.
void feature_distances(const Guide& g, float tolerance, int dx, int dy, int xa, int xb, int y, float* distance) {
  const float scale = 1.0f / (tolerance * tolerance);
  const auto raise_by = [&](const Planes& planes, float spread) {
    const float s = scale / (spread * spread);
    const float* p[3];
    const float* q[3];
    for (std::size_t c = 0; c < 3; ++c) {
      p[c] = planes[c].row(y);
      q[c] = planes[c].row(y + dy) + dx;
    }
    for (int x = xa; x < xb; ++x) {
      const float d = s * (square(p[0][x] - q[0][x]) + square(p[1][x] - q[1][x]) + square(p[2][x] - q[2][x]));
      distance[x] = distance[x] > d ? distance[x] : d;
    }
  };
  if (g.has_albedo) {
    raise_by(g.albedo, 0.06f);
  }
  if (g.has_normal) {
    raise_by(g.normal, 0.24f);
  }
  if (g.has_depth) {
    const float* p = g.closeness.row(y);
    const float* q = g.closeness.row(y + dy) + dx;
    const float* t = g.depth_tolerance.row(y);
    const float reach = static_cast<float>(dx * dx + dy * dy + 1);
    for (int x = xa; x < xb; ++x) {
      const float d = scale * square(p[x] - q[x]) / (t[x] * reach);
      distance[x] = distance[x] > d ? distance[x] : d;
    }
  }
}

/// Adds the pixels at (dx, dy) from those of a row, weighted by exp(-distance): their differences, so that equal
/// colours stay the same bits.
void accumulate(const Guide& g, int dx, int dy, int xa, int xb, int y, Tile& tile) {
  float* weight = tile.row(tile.distance, y);
  float* weights = tile.row(tile.weights, y);
  for (int x = xa; x < xb; ++x) {
    // exp(-d) as (1 - d/16)^16: the same bits on every machine, and 0 from d = 16 on.
    float w = max_of(1.0f - max_of(weight[x], 0.0f) * (1.0f / 16.0f), 0.0f);
    w *= w;
    w *= w;
    w *= w;
    weight[x] = w * w;
    weights[x] += weight[x];
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const float* u = g.colour[c].row(y);
    const float* u_q = g.colour[c].row(y + dy) + dx;
    float* sums = tile.row(tile.sums[c], y);
    for (int x = xa; x < xb; ++x) {
      sums[x] += weight[x] * (u_q[x] - u[x]);
    }
  }
}

/// Filters the tile's pixels. All sums run over the offsets in order, so the result depends on no other tile.
void filter_tile(const Guide& g, const DenoiseSettings& settings, Tile& tile, Image& result) {
  const int f = tile.overhang;
  for (int dy = -settings.radius; dy <= settings.radius; ++dy) {
    for (int dx = -settings.radius; dx <= settings.radius; ++dx) {
      const int xa = std::max(tile.x0, -dx), xb = std::min(tile.x1, g.width - dx);
      const int ya = std::max(tile.y0, -dy), yb = std::min(tile.y1, g.height - dy);
      if (xa >= xb || ya >= yb) {
        continue;
      }
      colour_distances(g, settings.strength, dx, dy, xa - f, xb + f, ya - f, yb + f, tile);
      average_over_patches(xa, xb, ya, yb, tile);
      for (int y = ya; y < yb; ++y) {
        feature_distances(g, settings.feature_tolerance, dx, dy, xa, xb, y, tile.row(tile.distance, y));
        accumulate(g, dx, dy, xa, xb, y, tile);
      }
    }
  }
  for (int y = tile.y0; y < tile.y1; ++y) {
    const float* weights = tile.row(tile.weights, y);  // at least 1: the pixel's own
    for (int c = 0; c < result.channels; ++c) {
      const auto channel = static_cast<std::size_t>(c);
      const float* sums = tile.row(tile.sums[channel], y);
      for (int x = tile.x0; x < tile.x1; ++x) {
        const float filtered = g.colour[channel].row(y)[x] + sums[x] / weights[x];
        result.at(x, y, c) = max_of(filtered, 0.0f) + g.excess[channel].row(y)[x];
      }
    }
  }
}

}  // namespace

Image denoise(const ImageLayers& layers, const DenoiseSettings& settings) {
  EMBRUN_CHECK(settings.radius >= 1 && settings.radius <= 16 && settings.patch_radius >= 0 &&
               settings.patch_radius <= 4 && settings.strength > 0 && settings.feature_tolerance > 0);
  Image result = layers.layer("beauty");
  EMBRUN_CHECK(result.channels == 1 || result.channels == 3);
  if (result.pixels.empty()) {
    return result;
  }
  const Guide guide = make_guide(layers, result, settings.radius + std::max(2, settings.patch_radius));
  const auto tiles_across = static_cast<std::size_t>((guide.width + tile_size - 1) / tile_size);
  const auto tiles_down = static_cast<std::size_t>((guide.height + tile_size - 1) / tile_size);
  parallel_for(tiles_across * tiles_down, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const int x0 = static_cast<int>(i % tiles_across) * tile_size;
      const int y0 = static_cast<int>(i / tiles_across) * tile_size;
      Tile tile(x0, y0, std::min(x0 + tile_size, guide.width), std::min(y0 + tile_size, guide.height),
                settings.patch_radius);
      filter_tile(guide, settings, tile, result);
    }
  });
  return result;
}

}  // namespace embrun
