#pragma once

#include "geometry/kernels.h"
#include "math/lanes.h"

namespace embrun {

// The kernels of kernels.h for many particles at once, F being Lanes, with what the proofs of the surface tracer need:
// bounds on the second derivative. Lengths in units of b: q = u^2 is the squared distance.

/// A kernel along a line: value and derivative at a point, and bounds -down <= f'' <= up.
template <class F>
struct LineLanes {
  F value, slope, up, down;
};

/// How far the second derivatives of a kernel, in any direction, may fall below 0 and rise above it.
template <class F>
struct CurvatureLanes {
  F down, up;
};

/// exp(x) for x in [-80, 80], relative error at most 1e-6: 2^k by the exponent's bits, the rest by a polynomial.
template <class F>
EMBRUN_FN F exp_of(F x) {
  const F y = max_of(x, F(-80.0f)) * 1.44269504f;
  // Adding and taking off 1.5 * 2^23 rounds to the nearest integer.
  const F rounded = (y + 12582912.0f) - 12582912.0f;
  const F f = (y - rounded) * 0.69314718f;
  F p = f * (1.0f / 720.0f) + (1.0f / 120.0f);
  p = p * f + (1.0f / 24.0f);
  p = p * f + (1.0f / 6.0f);
  p = p * f + 0.5f;
  p = p * f + 1.0f;
  p = p * f + 1.0f;
  return p * power_of_two(rounded);
}

template <Kernel kernel>
struct KernelLanes;

// Each also has what the build samples by the hundred at a time: rough_value, within rough_error of the kernel, and
// value_beyond_core, the same for u >= `core`.

template <>
struct KernelLanes<Kernel::metaball> {
  static constexpr float core = 1.0f / 3.0f;
  /// |f'| u <= 3/4, times the error of rough_rsqrt_of.
  static constexpr float rough_error = 0.75f * 6.6e-4f;
  template <class F>
  static EMBRUN_FN F value_beyond_core(F q) {
    const F outer = max_of(1.0f - rough_sqrt_of(q), F(0.0f));
    return 1.5f * outer * outer;
  }
  template <class F>
  static EMBRUN_FN F rough_value(F q) {
    const F u = rough_sqrt_of(max_of(q, F(1e-12f)));
    const F outer = max_of(1.0f - u, F(0.0f));
    const F inner = max_of(1.0f - 3.0f * u, F(0.0f));
    return 1.5f * outer * outer - 0.5f * inner * inner;
  }
  template <class F>
  static EMBRUN_FN F value(F q) {
    const F u = sqrt_of(q);
    const F outer = max_of(1.0f - u, F(0.0f));
    const F core = max_of(1.0f - 3.0f * u, F(0.0f));
    return 1.5f * outer * outer - 0.5f * core * core;
  }
  /// `ahead`: (p_i - x) . d; `aside`: the squared distance h^2 of the line from the centre. The bounds hold on the whole line. Outside the core f'' = 3(1 - h^2/u^3), h the line's distance from the centre:
  /// at most 3(1 - h^2), at least -3(1/h - 1), which the chord 2.25(1 - h^2) bounds; in the core it is -6.
  template <class F>
  static EMBRUN_FN LineLanes<F> on_line(F q, F ahead, F aside) {
    const F u = sqrt_of(max_of(q, F(1e-12f)));
    const F inverse = 1.0f / u;
    const F outer = max_of(1.0f - u, F(0.0f));
    const F core = max_of(1.0f - 3.0f * u, F(0.0f));
    const F beside = max_of(1.0f - aside, F(0.0f));
    return {1.5f * outer * outer - 0.5f * core * core, 3.0f * (outer - core) * inverse * ahead, 3.0f * beside,
            min_of(F(6.0f), 6.75f * beside)};
  }
  /// The same with bounds for the part of the line from `begin` to `end` (distances from the point) only, which are
  /// far tighter where that is short: f'' outside the core grows with u, so its extremes are at the part's nearest
  /// and farthest point from the centre.
  template <class F>
  static EMBRUN_FN LineLanes<F> on_segment(F q, F ahead, F aside, F begin, F end) {
    LineLanes<F> f = on_line(q, ahead, aside);
    const F zero = F(0.0f), one = F(1.0f);
    const F to_begin = begin - ahead, to_end = end - ahead;
    const F gap = max_of(max_of(to_begin, 0.0f - to_end), zero);
    const F q_near = aside + gap * gap;
    const F q_far = min_of(aside + max_of(to_begin * to_begin, to_end * to_end), one);
    const F nearest = max_of(q_near, F(1.0f / 9.0f)), farthest = max_of(q_far, F(1e-12f));
    const F near_cube = nearest * sqrt_of(nearest), far_cube = farthest * sqrt_of(farthest);
    // One division for both; more than it rounds is added.
    const F share = 3.0f * aside / (near_cube * far_cube);
    const F down = select_less(q_near, F(1.0f / 9.0f), F(6.0f), share * far_cube - (3.0f - 1e-5f));
    const F up = (3.0f + 1e-5f) - share * near_cube;
    f.down = select_less(q_near, one, min_of(max_of(down, zero), f.down), zero);
    f.up = select_less(q_near, one, max_of(up, zero), zero);
    return f;
  }
  /// Bounds within the distance h of a point at u = sqrt(q). Outside the core the eigenvalues of the second derivative
  /// are 3 (radial) and -3(1/u - 1) (across); in it all are -6.
  template <class F>
  static EMBRUN_FN CurvatureLanes<F> curvature_within(F u, F h) {
    const F nearest = max_of(u - h, F(1.0f / 3.0f));
    // More than it rounds is added.
    const F down = max_of(3.0f / nearest - (3.0f - 1e-5f), F(0.0f));
    return {down, select_less(nearest, F(1.0f), F(3.0f), F(0.0f))};
  }
  /// f and -f'(u)/u.
  template <class F>
  static EMBRUN_FN void value_and_pull(F q, F& value, F& pull, F& inverse) {
    const F u = sqrt_of(max_of(q, F(1e-12f)));
    inverse = 1.0f / u;
    const F outer = max_of(1.0f - u, F(0.0f));
    const F core = max_of(1.0f - 3.0f * u, F(0.0f));
    value = 1.5f * outer * outer - 0.5f * core * core;
    pull = 3.0f * (outer - core) * inverse;
  }
};

template <>
struct KernelLanes<Kernel::zhu_bridson> {
  static constexpr float core = 0.0f, rough_error = 0.0f;
  template <class F>
  static EMBRUN_FN F value_beyond_core(F q) {
    return value(q);
  }
  template <class F>
  static EMBRUN_FN F rough_value(F q) {
    return value(q);
  }
  template <class F>
  static EMBRUN_FN F value(F q) {
    const F w = max_of(1.0f - q, F(0.0f));
    return w * w * w;
  }
  /// f'' = -6 w^2 + 24 w (q - h^2) with w = 1 - q: within +-6 (1 - h^2)^2.
  template <class F>
  static EMBRUN_FN LineLanes<F> on_line(F q, F ahead, F aside) {
    const F w = max_of(1.0f - q, F(0.0f));
    const F beside = max_of(1.0f - aside, F(0.0f));
    const F bound = 6.0f * beside * beside;
    return {w * w * w, 6.0f * w * w * ahead, bound, bound};
  }
  template <class F>
  static EMBRUN_FN LineLanes<F> on_segment(F q, F ahead, F aside, F, F) {
    return on_line(q, ahead, aside);
  }
  /// Radial (1 - q)(30 q - 6), at most 4.8; across -6 (1 - q)^2; both at least -6 (1 - q)^2.
  template <class F>
  static EMBRUN_FN CurvatureLanes<F> curvature_within(F u, F h) {
    const F nearest = max_of(u - h, F(0.0f));
    const F w = max_of(1.0f - nearest * nearest, F(0.0f));
    return {6.0f * w * w, select_less(nearest, F(1.0f), F(4.8f), F(0.0f))};
  }
  template <class F>
  static EMBRUN_FN void value_and_pull(F q, F& value, F& pull, F& inverse) {
    const F w = max_of(1.0f - q, F(0.0f));
    value = w * w * w;
    pull = 6.0f * w * w;
    inverse = rsqrt_of(max_of(q, F(1e-12f)));
  }
};

template <>
struct KernelLanes<Kernel::blinn> {
  static constexpr float core = 0.0f, rough_error = 0.0f;
  template <class F>
  static EMBRUN_FN F value_beyond_core(F q) {
    return value(q);
  }
  template <class F>
  static EMBRUN_FN F rough_value(F q) {
    return value(q);
  }
  template <class F>
  static EMBRUN_FN F value(F q) {
    const F w = above_cut(q);
    return blinn_scale * max_of(exp_of(w) - 1.0f - w, F(0.0f));
  }
  /// With g = exp(w) at q and g_h at h^2, the line's squared distance from the centre, f'' = (4k^2 (q - h^2) - 2k) Sc g
  /// + 2k Sc: at most 4k exp(-1.5) Sc g_h + 2k Sc, where q - h^2 = 1.5/k; at least -2k Sc (g_h - 1), where q = h^2.
  template <class F>
  static EMBRUN_FN LineLanes<F> on_line(F q, F ahead, F aside) {
    const F zero = F(0.0f);
    const F w = above_cut(q), w_beside = above_cut(aside);
    const F gauss = exp_of(w), beside = exp_of(w_beside);
    constexpr float k = blinn_exponent;
    const F down = 2.0f * k * blinn_scale * (beside - 1.0f);
    const F up = 2.0f * k * blinn_scale * (2.0f * 0.2231302f * beside + 1.0f);
    return {blinn_scale * max_of(gauss - 1.0f - w, zero), 2.0f * k * blinn_scale * (gauss - 1.0f) * ahead,
            select_less(zero, w_beside, up, zero), down};
  }
  template <class F>
  static EMBRUN_FN LineLanes<F> on_segment(F q, F ahead, F aside, F, F) {
    return on_line(q, ahead, aside);
  }
  /// Radial (4k^2 u^2 - 2k) Sc g + 2k Sc, which rises up to k u^2 = 1.5 and falls beyond; across -2k Sc (g - 1), below
  /// the radial one.
  template <class F>
  static EMBRUN_FN CurvatureLanes<F> curvature_within(F u, F h) {
    const F zero = F(0.0f);
    const F nearest = max_of(u - h, zero);
    const F w = above_cut(nearest * nearest);
    constexpr float k = blinn_exponent;
    const F w_most = min_of(w, F(blinn_depth - 1.5f));
    const F radial = (2.0f * (blinn_depth - w_most) - 1.0f) * exp_of(w_most) + 1.0f;
    return {2.0f * k * blinn_scale * (exp_of(w) - 1.0f), select_less(zero, w, 2.0f * k * blinn_scale * radial, zero)};
  }
  template <class F>
  static EMBRUN_FN void value_and_pull(F q, F& value, F& pull, F& inverse) {
    const F w = above_cut(q);
    const F gauss = exp_of(w);
    value = blinn_scale * max_of(gauss - 1.0f - w, F(0.0f));
    pull = 2.0f * blinn_exponent * blinn_scale * (gauss - 1.0f);
    inverse = rsqrt_of(max_of(q, F(1e-12f)));
  }

 private:
  template <class F>
  static EMBRUN_FN F above_cut(F q) {
    return max_of(blinn_depth - q * blinn_exponent, F(0.0f));
  }
};

}  // namespace embrun
