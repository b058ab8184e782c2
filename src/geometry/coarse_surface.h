#pragma once

#include "geometry/implicit_surface_trace.h"
#include "geometry/lattice_surface.h"

namespace embrun {

/// A level of detail of a fluid: the union of a surface on a lattice and, for the particles that are too few for it, of the
/// particles' own of the first order (spray: balls that melt into each other).
struct CoarseSurfaceView {
  LatticeSurfaceView bulk;
  ImplicitSurfaceView spray{};
  bool has_spray = false;
};

EMBRUN_LOCAL_FN bool coarse_surface_contains(const CoarseSurfaceView& s, const Vec3& point) {
  return lattice_contains(s.bulk, point) || (s.has_spray && implicit_surface_contains(s.spray, point));
}

/// Where a ray leaves one of the two bodies, from a point in it at ray.t_min.
EMBRUN_LOCAL_FN bool leave_coarse_body(const CoarseSurfaceView& s, bool spray, const Ray& ray, SurfaceHit& hit) {
  if (spray) return intersect_implicit_surface(s.spray, ray, Side::inside, hit);
  return intersect_lattice_surface(s.bulk, ray, Side::inside, hit);
}

/// First crossing with t in (ray.t_min, ray.t_max), as intersect_implicit_surface has it.
EMBRUN_LOCAL_FN bool intersect_coarse_surface(const CoarseSurfaceView& s, const Ray& given, Side side,
                                              SurfaceHit& hit) {
  Ray ray = given;
  ray.clearance = {};  // of which of the two it tells is not known
  const Vec3 start = ray.at(ray.t_min);
  if (side == Side::unknown) side = coarse_surface_contains(s, start) ? Side::inside : Side::outside;
  if (!s.has_spray) return intersect_lattice_surface(s.bulk, ray, side, hit);
  if (side == Side::outside) {
    bool found = intersect_lattice_surface(s.bulk, ray, side, hit);
    if (found) ray.t_max = hit.t;
    SurfaceHit drop;
    if (intersect_implicit_surface(s.spray, ray, side, drop)) {
      hit = drop;
      found = true;
    }
    return found;
  }
  // From inside the ray leaves one body after the other, until it is in none. A start that rounding put out of both is on the
  // bulk's surface if that is near.
  const float g = lattice_value(s.bulk, start);
  bool spray = g <= 0.0f && (g < -0.01f || implicit_surface_contains(s.spray, start));
  for (int i = 0; i < 256; ++i) {
    if (!leave_coarse_body(s, spray, ray, hit)) return false;
    const bool in_other =
        spray ? lattice_contains(s.bulk, hit.position) : implicit_surface_contains(s.spray, hit.position);
    if (!in_other) return true;
    ray.t_min = hit.t;
    spray = !spray;
  }
  return true;
}

}  // namespace embrun
