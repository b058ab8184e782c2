#pragma once

#include "math/vec.h"

namespace embrun {

// A shading normal may disagree with the true surface: the weighted normal of a fluid's surface is not the gradient of
// its field, and interpolated normals are not a facet's. Sides are always those of the true surface; what the shading
// normal would send across is bent by the least turn that puts it right. Nothing is dropped and no weight changes, so
// a white furnace stays white, and every step is continuous in its arguments, so there are no seams.

/// Smallest cosine to the true surface, and of a direction to its shading normal, after bending.
inline constexpr float min_side_cosine = 1e-5f;

struct BentVector {
  Vec3 v;             ///< unit length
  bool bent = false;  ///< it had to be turned
};

/// The unit vector nearest to `v` with dot(result, axis) >= min_side_cosine; `v` and `axis` are unit vectors.
/// For v = -axis every turn is equally short: an arbitrary one is taken.
EMBRUN_FN BentVector bend_to_side(Vec3 v, Vec3 axis) {
  const float cosine = dot(v, axis);
  if (cosine >= min_side_cosine) return {v, false};
  Vec3 tangent = v - axis * cosine;
  // Near -axis the tangent is all rounding: made perpendicular once more, it is at least on the right side.
  tangent = length_squared(tangent) < 1e-12f ? Frame(axis).s : normalize(tangent);
  tangent = normalize(tangent - axis * dot(tangent, axis));
  return {tangent * sqrtf(1.0f - min_side_cosine * min_side_cosine) + axis * min_side_cosine, true};
}

/// Normals at a surface point. `geometric` decides sides; `shading` shapes reflection and refraction and should lie
/// within 90 degrees of it. Unit vectors; both may point to either side, together.
struct SurfaceNormals {
  Vec3 geometric;
  Vec3 shading;
};

/// The normals as a viewer in direction `w` meets them: `geometric` on the viewer's side, and `shading` bent, if it
/// faces away from the viewer, to the nearest normal that does not.
struct FacingNormals {
  Vec3 geometric;
  Vec3 shading;
  bool bent = false;       ///< the shading normal was bent
  bool from_front = true;  ///< `w` is on the side that the original geometric normal points to
};

EMBRUN_FN FacingNormals face_towards(const SurfaceNormals& normals, Vec3 w) {
  const bool front = dot(w, normals.geometric) >= 0.0f;
  const float sign = front ? 1.0f : -1.0f;
  const BentVector shading = bend_to_side(normals.shading * sign, w);
  return {normals.geometric * sign, shading.v, shading.bent, front};
}

/// Keeps a reflected direction on the viewer's side of the true surface.
EMBRUN_FN BentVector bend_reflection(Vec3 wi, const FacingNormals& normals) {
  return bend_to_side(wi, normals.geometric);
}
/// Sends a refracted direction across the true surface.
EMBRUN_FN BentVector bend_transmission(Vec3 wi, const FacingNormals& normals) {
  return bend_to_side(wi, -normals.geometric);
}

}  // namespace embrun
