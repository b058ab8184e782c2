#pragma once

#include <cstdint>

#include "math/vec.h"
#include "sampling/warp.h"

namespace embrun {

// Conventions of sample_phase and eval_phase:
// - Directions are unit vectors in scene coordinates, as for surfaces: `wo` points back to where the path came from
//   (the camera side), `wi` to where it goes on (the light side). Straight on is wi = -wo.
// - Measure: per steradian. A phase function integrates to 1 over the sphere, so its value is its density as well, and a
//   sample always has weight 1.
// - There is no cosine, and no failure: every sample is a direction.
// - The mean of the cosine between the directions of flight, dot(wi, -wo), is g; 0 for the kinds without g.

enum class PhaseKind : std::uint8_t {
  isotropic,
  henyey_greenstein,  ///< [HenyeyGreenstein1941], mean cosine g: forward above 0
  rayleigh,           ///< particles much smaller than the wavelength
};

/// Largest |g| of Henyey and Greenstein's function: beyond it single precision does not follow the peak.
inline constexpr double largest_phase_g = 0.9999;

struct PhaseFunction {
  PhaseKind kind = PhaseKind::isotropic;
  float g = 0;  ///< of henyey_greenstein, in [-largest_phase_g, largest_phase_g]
};

EMBRUN_FN bool operator==(PhaseFunction a, PhaseFunction b) { return a.kind == b.kind && a.g == b.g; }

struct PhaseSample {
  Vec3 wi;
  float pdf = 0;  ///< per steradian; the phase function's value as well
};

/// Henyey and Greenstein's function of mean cosine |g|, where `drop` is 1 - cos to the axis of its peak. A sum of positive
/// terms, so that the peak of a strongly forward medium keeps its precision.
EMBRUN_FN float henyey_greenstein(float abs_g, float drop) {
  const float square_distance = square(1.0f - abs_g) + 2.0f * abs_g * drop;
  return 0.25f * inv_pi * (1.0f - abs_g) * (1.0f + abs_g) / (square_distance * sqrtf(square_distance));
}

/// Value and density, per steradian.
EMBRUN_FN float eval_phase(const PhaseFunction& phase, Vec3 wo, Vec3 wi) {
  switch (phase.kind) {
    case PhaseKind::isotropic: break;
    case PhaseKind::henyey_greenstein:
      // |a - b|^2 / 2 = 1 - cos for unit vectors, without cancellation near the peak.
      return henyey_greenstein(fabsf(phase.g), 0.5f * length_squared(phase.g < 0.0f ? wi - wo : wi + wo));
    case PhaseKind::rayleigh: return 0.1875f * inv_pi * (1.0f + square(dot(wi, wo)));
  }
  return 0.25f * inv_pi;
}

/// Draws the direction in which light came, or a path goes on.
EMBRUN_FN PhaseSample sample_phase(const PhaseFunction& phase, Vec3 wo, Sample2 u) {
  float drop = 2.0f * u.x;  // 1 - cos to the axis
  Vec3 axis = -wo;
  PhaseSample sample;
  sample.pdf = 0.25f * inv_pi;
  switch (phase.kind) {
    case PhaseKind::isotropic: break;
    case PhaseKind::henyey_greenstein: {
      // The inverse of the distribution, with 1 - cos kept instead of cos.
      const float g = fabsf(phase.g);
      const float denominator = 1.0f - g + 2.0f * g * u.x;
      drop = min_of(2.0f * (1.0f - u.x) * (1.0f + g * u.x) * square((1.0f - g) / denominator), 2.0f);
      if (phase.g < 0.0f) axis = wo;
      sample.pdf = henyey_greenstein(g, drop);
      break;
    }
    case PhaseKind::rayleigh: {
      // cos^3 + 3 cos = 2 c, solved by Cardano's formula [Frisvad2011].
      const float c = 4.0f * u.x - 2.0f;
      const float root = cbrtf(c + sqrtf(1.0f + c * c));
      const float cosine = clamp(root - 1.0f / root, -1.0f, 1.0f);
      drop = 1.0f - cosine;
      sample.pdf = 0.1875f * inv_pi * (1.0f + square(cosine));
      break;
    }
  }
  const float radius = sqrtf(drop * (2.0f - drop));
  const float angle = 2.0f * pi * u.y;
  sample.wi = normalize(Frame(axis).to_world({radius * cosf(angle), radius * sinf(angle), 1.0f - drop}));
  return sample;
}

}  // namespace embrun
