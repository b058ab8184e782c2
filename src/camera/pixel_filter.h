#pragma once

#include <cstdint>

#include "math/vec.h"
#include "sampling/sampler.h"

namespace embrun {

/// Shape of a pixel's response. Samples are drawn in proportion to the filter, so each counts in its own pixel only,
/// with weight 1 [Ernst2006]; no sample touches two pixels.
enum class FilterKind : uint8_t {
  box,              ///< exactly one pixel
  tent,             ///< reaches `radius` pixels from the centre
  gaussian,         ///< standard deviation radius / 3, cut at `radius`
  blackman_harris,  ///< reaches `radius`; smooth and nearly without side lobes
};

struct PixelFilter {
  FilterKind kind = FilterKind::box;
  float radius = 0.5f;  ///< pixels; ignored by `box`

  bool operator==(const PixelFilter&) const = default;
};

/// Offset from the left edge of the tent of half width 1, in [-1, 1].
EMBRUN_FN float sample_tent(float u) { return u < 0.5f ? sqrtf(2.0f * u) - 1.0f : 1.0f - sqrtf(2.0f * (1.0f - u)); }

/// Inverts the cumulative Blackman-Harris window [Harris1978] on [-1, 1] by bisection and Newton steps.
EMBRUN_LOCAL_FN float sample_blackman_harris(float u) {
  // Window a0 + a1 cos(pi x) + a2 cos(2 pi x) + a3 cos(3 pi x), over its integral 2 a0.
  constexpr float a0 = 0.35875f, a1 = 0.48829f, a2 = 0.14128f, a3 = 0.01168f;
  float low = -1.0f, high = 1.0f, x = 2.0f * u - 1.0f;
  for (int step = 0; step < 12; ++step) {
    const float integral =
        a0 * (x + 1.0f) + inv_pi * (a1 * sinf(pi * x) + a2 * 0.5f * sinf(2 * pi * x) + a3 / 3.0f * sinf(3 * pi * x));
    const float error = integral / (2.0f * a0) - u;
    if (error > 0.0f)
      high = x;
    else
      low = x;
    const float density = (a0 + a1 * cosf(pi * x) + a2 * cosf(2 * pi * x) + a3 * cosf(3 * pi * x)) / (2.0f * a0);
    const float newton = x - error / density;
    x = newton >= low && newton <= high ? newton : 0.5f * (low + high);
  }
  return x;
}

/// Offset of a film sample from the pixel's centre, in pixels.
EMBRUN_LOCAL_FN Sample2 sample_filter(const PixelFilter& filter, Sample2 u) {
  switch (filter.kind) {
    case FilterKind::box: break;
    case FilterKind::tent: return {filter.radius * sample_tent(u.x), filter.radius * sample_tent(u.y)};
    case FilterKind::gaussian: {
      // Polar form of the normal distribution, cut at three deviations.
      const float tail = 1.0f - expf(-4.5f);
      const float r = filter.radius * (1.0f / 3.0f) * sqrtf(-2.0f * logf(1.0f - u.x * tail));
      return {r * cosf(2.0f * pi * u.y), r * sinf(2.0f * pi * u.y)};
    }
    case FilterKind::blackman_harris:
      return {filter.radius * sample_blackman_harris(u.x), filter.radius * sample_blackman_harris(u.y)};
  }
  return {u.x - 0.5f, u.y - 0.5f};
}

}  // namespace embrun
