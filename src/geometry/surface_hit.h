#pragma once

#include "math/ray.h"
#include "math/rgb.h"
#include "math/vec.h"

namespace embrun {

/// Where a ray is with respect to a closed surface when it starts.
enum class Side { unknown, outside, inside };

/// A crossing of a closed surface. Both normals are unit vectors that point out of the body.
struct SurfaceHit {
  float t = infinity;
  Vec3 position;
  Vec3 geometric_normal;  ///< minus the gradient of the field: decides sides
  Vec3 shading_normal;    ///< what reflects and refracts
  bool entering = false;  ///< from outside to inside

  // The field that made the crossing, where it is one: enough to say how far a ray that leaves here cannot come back.
  // Within `reach` metres of the position -fall <= g'' <= rise in every direction (1/m^2). Reach 0: not known.
  std::int16_t sheet = 0;
  float gradient = 0;  ///< |grad g|, 1/m; g grows inwards
  float rise = 0, fall = 0, reach = 0;

  // Of a mesh: which of its triangles, and the weights of the second and third corner.
  std::uint32_t triangle = 0;
  float weight_b = 0, weight_c = 0;

  // Of splats: the surface's own colour, and the radius of the splat that was met (0: it is none).
  Rgb color{1, 1, 1};
  float splat_radius = 0;
};

/// How far a ray from the hit along `direction` stays on the side it leaves to: g has the slope of the gradient and at
/// most so much curvature. A tenth is left off for the rounding of the position.
EMBRUN_FN Clearance clearance_after(const SurfaceHit& hit, Vec3 direction, int instance) {
  const float away = dot(direction, hit.geometric_normal);
  const float bend = max_of(away > 0.0f ? hit.rise : hit.fall, 1e-30f);
  return {min_of(1.8f * fabsf(away) * hit.gradient / bend, hit.reach), hit.sheet, static_cast<std::int16_t>(instance)};
}

}  // namespace embrun
