#pragma once

#include "math/vec.h"

namespace embrun {

// A shading normal may disagree with the true surface: the weighted normal of a fluid's surface is not the gradient of
// its field, and interpolated normals are not a facet's. Sides are always those of the true surface; what the shading
// normal would send across is bent by the least turn that puts it right. Nothing is dropped and no weight changes, so
// a white furnace stays white, and every step is continuous in its arguments, so there are no seams.

/// Smallest cosine to the true surface, and of a direction to its shading normal, after bending.
inline constexpr float min_side_cosine = 1e-5f;
/// Directions that leave lower than this are raised to it, or to where the true normal would send them if that is lower. A
/// path that is bent to the surface itself gets nowhere: within a drop, totally reflected, it meets the surface at once and is
/// bent again, until its depth is used up, and the drop has black specks.
inline constexpr float grazing_cosine = 0.1f;

/// Largest angle of a shading normal to the true one, as a cosine: 60 degrees. Where particles crowd on both sides of a
/// point, the weighted normal may be anything, even face the other way.
inline constexpr float min_normals_cosine = 0.5f;

struct BentVector {
  Vec3 v;             ///< unit length
  bool bent = false;  ///< it had to be turned
};

/// The unit vector nearest to `v` with dot(result, axis) >= least; `v` and `axis` are unit vectors.
/// For v = -axis every turn is equally short: an arbitrary one is taken.
EMBRUN_FN BentVector bend_to_side(Vec3 v, Vec3 axis, float least = min_side_cosine) {
  const float cosine = dot(v, axis);
  if (cosine >= least) return {v, false};
  Vec3 tangent = v - axis * cosine;
  // Near -axis the tangent is all rounding: made perpendicular once more, it is at least on the right side.
  tangent = length_squared(tangent) < 1e-12f ? Frame(axis).s : normalize(tangent);
  tangent = normalize(tangent - axis * dot(tangent, axis));
  return {tangent * sqrtf(1.0f - least * least) + axis * least, true};
}

/// Normals at a surface point. `geometric` decides sides; `shading` shapes reflection and refraction and should lie
/// near it (see min_normals_cosine). Unit vectors; both may point to either side, together.
struct SurfaceNormals {
  Vec3 geometric;
  Vec3 shading;
};

/// The normals as a viewer in direction `w` meets them: `geometric` on the viewer's side, and `shading` bent to the nearest
/// normal that is near it, and from there to the nearest that does not face away from the viewer.
struct FacingNormals {
  Vec3 geometric;
  Vec3 shading;
  bool bent = false;       ///< the shading normal was bent
  bool from_front = true;  ///< `w` is on the side that the original geometric normal points to
};

EMBRUN_FN FacingNormals face_towards(const SurfaceNormals& normals, Vec3 w) {
  const bool front = dot(w, normals.geometric) >= 0.0f;
  const float sign = front ? 1.0f : -1.0f;
  const BentVector near = bend_to_side(normals.shading * sign, normals.geometric * sign, min_normals_cosine);
  const BentVector shading = bend_to_side(near.v, w);
  return {normals.geometric * sign, shading.v, near.bent || shading.bent, front};
}

/// The least cosine to the true surface where the true normal would give `own`: a little less, for rounding.
EMBRUN_FN float least_cosine(float own) { return clamp(0.999f * own, min_side_cosine, grazing_cosine); }

/// Keeps the reflection `wi` of `wo` on the viewer's side of the true surface.
EMBRUN_FN BentVector bend_reflection(Vec3 wi, Vec3 wo, const FacingNormals& normals) {
  return bend_to_side(wi, normals.geometric, least_cosine(dot(wo, normals.geometric)));
}
/// Sends the refraction `wi` of `wo` across the true surface, behind which the index is `relative_index` times as high.
EMBRUN_FN BentVector bend_transmission(Vec3 wi, Vec3 wo, float relative_index, const FacingNormals& normals) {
  const float cosine = dot(wo, normals.geometric);
  // Squared, and less what it may be off.
  const float own = 1.0f - (1.0f - cosine * cosine) / (relative_index * relative_index) - 1e-6f;
  return bend_to_side(wi, -normals.geometric, least_cosine(sqrtf(max_of(own, 0.0f))));
}

}  // namespace embrun
