#pragma once

#include "geometry/surface_settings.h"
#include "math/vec.h"

namespace embrun {

// The kernels f of the field D(x) = sum_i f(|x - p_i| / b_i), as functions of u = r/b >= 0.
// All fall monotonically from f(0) = 1, are positive inside their support, 0 beyond, and continuous.

/// Metaball: 1 - 3u^2 up to 1/3, then (3/2)(1 - u)^2. C1; support 1.
/// The two pieces are one expression without a branch, since 1.5(1-u)^2 - 0.5(1-3u)^2 = 1 - 3u^2.
EMBRUN_FN float metaball_value(float u) {
  const float outer = max_of(0.0f, 1.0f - u);
  const float core = max_of(0.0f, 1.0f - 3.0f * u);
  return 1.5f * outer * outer - 0.5f * core * core;
}
EMBRUN_FN float metaball_derivative(float u) {
  return 3.0f * max_of(0.0f, 1.0f - 3.0f * u) - 3.0f * max_of(0.0f, 1.0f - u);
}

/// (1 - u^2)^3 [ZhuBridson2005]. C2; support 1. Takes u^2: it needs no square root.
EMBRUN_FN float zhu_bridson_value_of_square(float u_squared) {
  const float w = max_of(0.0f, 1.0f - u_squared);
  return w * w * w;
}
EMBRUN_FN float zhu_bridson_derivative(float u) {
  const float w = max_of(0.0f, 1.0f - u * u);
  return -6.0f * u * w * w;
}

/// exp(-beta r^2) [Blinn1982], unbounded, is cut where it falls to c = 1e-3. Its tangent in u^2 there is taken off,
/// so that the cut leaves neither a step nor a kink (bounds on f'' hold across it), and the rest is scaled to f(0) = 1:
/// f = S c (exp(w) - 1 - w) with w = max(0, ln(1/c) - k u^2) and S = 1/(1 - c (1 + ln(1/c))). k = beta b^2 is such that
/// f(1/3) = 2/3 exactly. It differs from the uncut one by less than 0.0034. C1; support beyond b:
/// sqrt(ln(1/c)/k) = 1.3816 b.
inline constexpr float blinn_depth = 6.9077553f;      ///< ln(1/c)
inline constexpr float blinn_scale = 1.00797079e-3f;  ///< S c
inline constexpr float blinn_exponent = 3.6190801f;   ///< k
inline constexpr float blinn_support = 1.3815588f;

EMBRUN_FN float blinn_value_of_square(float u_squared) {
  const float w = max_of(0.0f, blinn_depth - blinn_exponent * u_squared);
  return blinn_scale * max_of(0.0f, expf(w) - 1.0f - w);
}
EMBRUN_FN float blinn_derivative(float u) {
  const float w = max_of(0.0f, blinn_depth - blinn_exponent * u * u);
  return -2.0f * blinn_exponent * blinn_scale * u * (expf(w) - 1.0f);
}

/// f(u), u >= 0.
EMBRUN_FN float kernel_value(Kernel kernel, float u) {
  switch (kernel) {
    case Kernel::metaball: return metaball_value(u);
    case Kernel::zhu_bridson: return zhu_bridson_value_of_square(u * u);
    case Kernel::blinn: return blinn_value_of_square(u * u);
  }
  return 0.0f;
}

/// f'(u) = df/du, u >= 0; never positive.
EMBRUN_FN float kernel_derivative(Kernel kernel, float u) {
  switch (kernel) {
    case Kernel::metaball: return metaball_derivative(u);
    case Kernel::zhu_bridson: return zhu_bridson_derivative(u);
    case Kernel::blinn: return blinn_derivative(u);
  }
  return 0.0f;
}

/// The u beyond which f is 0: a particle is felt up to kernel_support * b.
EMBRUN_FN float kernel_support(Kernel kernel) { return kernel == Kernel::blinn ? blinn_support : 1.0f; }

/// Integral of f over space for b = 1: 4 pi int_0^support f(u) u^2 du.
/// Metaball 4/405 + 16/405 = 4/81 inside and outside of u = 1/3; Zhu-Bridson 16/315; Blinn
/// S (sqrt(pi)/(4 k^(3/2)) erf(sqrt(k) U) - U c/(2k) - c (1 + k U^2) U^3/3 + c k U^5/5) with support U.
EMBRUN_FN float kernel_integral(Kernel kernel) {
  switch (kernel) {
    case Kernel::metaball: return 4.0f * pi * (4.0f / 81.0f);
    case Kernel::zhu_bridson: return 4.0f * pi * (16.0f / 315.0f);
    case Kernel::blinn: return 4.0f * pi * 0.0613336488f;
  }
  return 0.0f;
}

}  // namespace embrun
