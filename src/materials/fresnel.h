#pragma once

#include "math/rgb.h"

namespace embrun {

// Throughout, `relative_index` is n_far / n_near: the refractive index of the side that light is refracted into over
// that of the side where the direction `w` lies. `w` points away from the surface, dot(w, n) > 0.

struct FresnelResult {
  float reflectance = 1;      ///< of unpolarised light, in [0, 1]; exactly 1 for total internal reflection
  float cos_transmitted = 0;  ///< cosine of the refracted direction to -n; 0 for total internal reflection
};

/// Exact Fresnel reflectance of a smooth dielectric for unpolarised light: the mean of the two polarisations
/// [BornWolf1999], section 1.5.2. `cos_incident` in [0, 1]. Index-matched sides give exactly 0 at every angle.
EMBRUN_FN FresnelResult fresnel_dielectric(float cos_incident, float relative_index) {
  // Snell's law in this form is exact when the indices agree: cos_t = cos_i.
  const float m = relative_index;
  const float cos2 = ((m - 1.0f) * (m + 1.0f) + cos_incident * cos_incident) / (m * m);
  if (cos2 < 0.0f) return {1.0f, 0.0f};
  const float cos_t = sqrtf(cos2);
  const float s_sum = cos_incident + m * cos_t;
  if (s_sum == 0.0f) return {0.0f, 0.0f};  // matched indices at exactly grazing incidence
  const float r_s = (cos_incident - m * cos_t) / s_sum;
  const float r_p = (m * cos_incident - cos_t) / (m * cos_incident + cos_t);
  return {min_of(0.5f * (r_s * r_s + r_p * r_p), 1.0f), cos_t};
}

/// Exact Fresnel reflectance of a metal of complex index eta + i k, relative to the medium before it, for unpolarised
/// light [BornWolf1999], section 14.2, each channel on its own. `cos_incident` in [0, 1]; eta and k not both 0.
EMBRUN_FN float fresnel_conductor(float cos_incident, float eta, float k) {
  const float cos2 = cos_incident * cos_incident, sin2 = 1.0f - cos2;
  // a + i b is the refracted wave's normal component, n cos of the complex angle.
  const float real = eta * eta - k * k - sin2;
  const float size = sqrtf(real * real + 4.0f * eta * eta * k * k);  // a^2 + b^2
  const float a = sqrtf(max_of(0.5f * (size + real), 0.0f));
  const float r_s = (size + cos2 - 2.0f * a * cos_incident) / (size + cos2 + 2.0f * a * cos_incident);
  const float p = cos2 * size + sin2 * sin2, q = 2.0f * a * cos_incident * sin2;
  const float r_p = p + q > 0.0f ? r_s * (p - q) / (p + q) : r_s;
  return min_of(0.5f * (r_s + r_p), 1.0f);
}
EMBRUN_FN Rgb fresnel_conductor(float cos_incident, Rgb eta, Rgb k) {
  return {fresnel_conductor(cos_incident, eta.r, k.r), fresnel_conductor(cos_incident, eta.g, k.g),
          fresnel_conductor(cos_incident, eta.b, k.b)};
}

/// Mirror image of `w` about `n`; both point away from the surface, and so does the result.
EMBRUN_FN Vec3 reflect_about(Vec3 w, Vec3 n) { return n * (2.0f * dot(w, n)) - w; }

/// Refracted direction (on the far side of the surface) for `w`, given the cosines that fresnel_dielectric returned or
/// was given. With matched indices it is exactly -w.
EMBRUN_FN Vec3 refract_through(Vec3 w, Vec3 n, float cos_incident, float cos_transmitted, float relative_index) {
  const float inverse = 1.0f / relative_index;
  return n * (cos_incident * inverse - cos_transmitted) - w * inverse;
}

}  // namespace embrun
