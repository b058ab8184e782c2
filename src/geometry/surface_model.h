#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geometry/surface_settings.h"
#include "math/vec.h"

namespace embrun {

/// The surface of some particles in numbers: it is max(D/T, D'/T') = 1, liquid where that is larger, with
///   D(x)  = sum_i f(|x - p_i| / b_i)                over all particles, b_i = 2 n R_i
///   D'(x) = sum_r w_r f(|x - p_r| / b'_r)           over the recovered ones, b'_r = 2 R_r.
struct SurfaceModel {
  Kernel kernel = Kernel::metaball;
  int order = 3;
  NormalMode normal = NormalMode::weighted;
  float radius = 0;                      ///< R0 (the reference radius where radii differ), metres
  float influence_factor = 0;            ///< b_i / R_i = 2n
  float influence_radius = 0;            ///< b for R0, metres
  float mean_field = 0;                  ///< D_in: the mean of D inside, kernel integral * b^3 / s^3
  float threshold = 0;                   ///< T
  float recover_factor = 2;              ///< b'_r / R_r
  float recover_radius = 0;              ///< b' for R0, metres
  float recover_threshold = 0;           ///< T' = f(R0) at b' = 2 R0: a lone particle is a ball of radius R0
  std::vector<std::uint32_t> recovered;  ///< particles with w_r > 0, rising
  std::vector<float> recovered_weights;  ///< their w_r in (0, 1]
};

/// Turns settings and particles into the numbers of the surface (method section 1 with its errata).
///
/// T: automatic is D_in/2 for n >= 2 and f(R0) for n = 1; thesis is 2n - 1; or the number given.
/// With `radii` D_in is kernel integral * (2n)^3 * <R^3> / s^3: the field that particles mixed evenly at number
/// density s^-3 have on average; one T holds for all of them, since a fluid whose particles are spaced in proportion
/// to their radii has the same D everywhere. With settings.spacing = 0, s^3 = 8 <R^3>.
///
/// Recovered: thesis gives weight 1 to particles with D(p_i) < T; smooth gives `recover_weight(D(p_i)/T)`.
///
/// `radii` is empty (all settings.radius) or one a particle. Throws Error for what cannot make a surface: radius,
/// order, spacing, threshold or a particle's radius out of range.
SurfaceModel resolve_surface_model(std::span<const Vec3> positions, std::span<const float> radii,
                                   const SurfaceSettings& settings);

/// All of it but the recovered particles. The settings and radii must be in range.
SurfaceModel resolve_surface_constants(std::span<const float> radii, const SurfaceSettings& settings);

/// The smooth weight of a particle whose field is q = D(p_i)/T: 1 up to 0.6, 0 from 1.2, and v^2 (3 - 2v) with
/// v = (1.2 - q)/0.6 between: continuous with its slope, 7/27 = 0.259 at q = 1, which is under every kernel's T'
/// so that a particle just inside the main surface adds no ball to it.
float recover_weight(float q);

/// D at the particles themselves, each one's own f(0) = 1 included. `influence` holds b_i in metres of each
/// particle or one value for all.
std::vector<float> particle_field_values(std::span<const Vec3> positions, std::span<const float> influence,
                                         Kernel kernel);

}  // namespace embrun
