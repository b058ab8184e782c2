#pragma once

#include "geometry/surface_hit.h"
#include "math/ray.h"

namespace embrun {

/// A solid ball.
struct Ball {
  Vec3 center;
  float radius = 0;
};

/// First crossing of the ball's surface with t in (t_min, t_max); false leaves `hit` alone.
/// The quadratic is solved about the point of the ray nearest to the centre, so that far or small
/// balls keep their precision (Haines et al. 2019, "Precision Improvements for Ray/Sphere Intersection").
EMBRUN_FN bool intersect_ball(const Ball& ball, const Ray& ray, SurfaceHit& hit) {
  const Vec3 to_center = ball.center - ray.origin;
  const float t_middle = dot(to_center, ray.direction);
  const float half_chord_squared = square(ball.radius) - length_squared(to_center - t_middle * ray.direction);
  if (!(half_chord_squared > 0.0f)) return false;
  const float half_chord = sqrtf(half_chord_squared);
  float t = t_middle - half_chord;
  const bool entering = t > ray.t_min;
  if (!entering) t = t_middle + half_chord;
  if (!(t > ray.t_min && t < ray.t_max)) return false;
  hit.t = t;
  hit.geometric_normal = normalize(ray.at(t) - ball.center);
  hit.position = ball.center + hit.geometric_normal * ball.radius;
  hit.shading_normal = hit.geometric_normal;
  hit.entering = entering;
  return true;
}

EMBRUN_FN bool ball_contains(const Ball& ball, Vec3 point) {
  return length_squared(point - ball.center) < square(ball.radius);
}

}  // namespace embrun
