#pragma once

#include <cstdint>

#include "geometry/ball.h"

// Many balls as one thing. A set of balls with an inside is one solid: where balls overlap nothing is met, and a ray
// knows which side of the solid it starts on. A set without (opaque) is the shells of its balls, met from either side.

namespace embrun {

/// A view of a set of balls.
struct BallSet {
  const BallBlock* blocks = nullptr;
  std::uint32_t count = 0;  ///< of blocks
  float slack = 0;  ///< metres by which rays start off surfaces of the scene, as far as their place has no part in it
  bool solid = false;

  EMBRUN_FN Ball ball(std::uint32_t index) const {
    return blocks[index / balls_per_block].ball(index % balls_per_block);
  }
};

/// How far off the surface of a ball, near `point`, a new ray has to start to be safely on its side, metres: some times
/// the rounding of a position there.
EMBRUN_FN float ball_offset(Vec3 point, float radius) {
  const float reach = max_of(fabsf(point.x), max_of(fabsf(point.y), fabsf(point.z)));
  return 1e-6f * (reach + 2.0f * radius);
}

/// Surfaces that are nearer to each other than that are one place, at `t` of the ray: a ray that leaves one may start on
/// the wrong side of the other.
EMBRUN_FN float ball_tolerance(const Ray& ray, float t, float slack) {
  return 2.0f * (slack + ball_offset(ray.at(t), 0.0f)) + 4e-7f * t;
}
EMBRUN_FN float tolerance_at(float tolerance, float radius) { return min_of(tolerance, 0.1f * radius); }

/// The least parameter that counts as after `t_min`.
EMBRUN_FN float just_after(float t_min) { return t_min + max_of(2.5e-7f * t_min, 1e-12f); }

/// The stretch of a line in a ball.
struct BallSpan {
  float enter, exit;
};

/// What a ray from outside a set meets of one of its balls; false: nothing. `tolerance` is that at the ray's start.
EMBRUN_FN bool meet_ball(BallSpan span, float radius, float t_min, bool solid, float tolerance, float& t,
                         bool& entering) {
  entering = true;
  t = span.enter;
  if (span.enter > t_min) return true;
  if (!(span.exit > t_min)) return false;
  // The start is in the ball. If only by the offset from another surface, as in the crease between two balls, it is met
  // at once, or left behind. (The product is the square of the radius less that of the distance.)
  if (solid && (span.exit - t_min) * (t_min - span.enter) < 2.0f * radius * tolerance_at(tolerance, radius)) {
    t = just_after(t_min);
    return 0.5f * (span.enter + span.exit) > t_min;
  }
  entering = false;
  t = span.exit;
  return true;
}

/// Where a ray that starts inside a solid of balls leaves it, found ball by ball: the end of the chain of spans that
/// overlap. Gaps within the tolerance are none.
struct SolidExit {
  float end;               ///< so far; the ray's t_min at first
  std::uint32_t ball = 0;  ///< whose exit that is
  bool found = false;      ///< a ball held the start

  /// Takes a span into account; false where it begins too late to belong to the chain as far as that is known.
  EMBRUN_FN bool extend(BallSpan span, std::uint32_t index, float tolerance) {
    if (!(span.enter <= end + tolerance)) return false;
    if (span.exit > end) {
      end = span.exit;
      ball = index;
      found = true;
    }
    return true;
  }
};

/// The ball that a point is in, or else nearest to, as far as that is within the tolerance.
struct TouchedBall {
  float depth = -infinity;  ///< negative outside
  std::uint32_t ball = 0;

  EMBRUN_FN void consider(const Ball& candidate, std::uint32_t index, Vec3 point, float tolerance) {
    const float d = candidate.radius - length(point - candidate.center);
    if (!(d > depth) || d < -tolerance_at(tolerance, candidate.radius) || candidate.radius == 0.0f) return;
    depth = d;
    ball = index;
  }
  EMBRUN_FN bool found() const { return depth > -infinity; }
};

/// First crossing of a set of balls with t in (t_min, t_max) by looking at each one: for a backend without a better way.
/// `inside`: the ray starts inside the solid. False leaves `hit` alone.
EMBRUN_LOCAL_FN bool intersect_each_ball(const BallSet& set, const Ray& ray, bool inside, SurfaceHit& hit) {
  const float tolerance = ball_tolerance(ray, ray.t_min, set.slack);
  const auto span_of = [&](std::uint32_t i, BallSpan& span) {
    const Ball ball = set.ball(i);
    const float middle = dot(ball.center - ray.origin, ray.direction);
    const float squared = square(ball.radius) - length_squared(ball.center - ray.origin - middle * ray.direction);
    if (!(squared > 0.0f)) return false;
    span = {middle - sqrtf(squared), middle + sqrtf(squared)};
    return true;
  };
  const std::uint32_t count = set.count * balls_per_block;
  BallSpan span;
  if (inside) {
    SolidExit exit{ray.t_min};
    TouchedBall touched;
    // Each round follows the chain by a ball at least, or is the last.
    for (float before = -infinity; exit.end > before && exit.end < ray.t_max;) {
      before = exit.end;
      for (std::uint32_t i = 0; i < count; ++i) {
        if (!exit.found) touched.consider(set.ball(i), i, ray.at(ray.t_min), tolerance);
        if (span_of(i, span)) exit.extend(span, i, tolerance_at(tolerance, set.ball(i).radius));
      }
    }
    if (exit.found && !(exit.end < ray.t_max)) return false;
    if (exit.found || touched.found()) {
      fill_ball_hit(set.ball(exit.found ? exit.ball : touched.ball), ray, exit.found ? exit.end : just_after(ray.t_min),
                    false, hit);
      return true;
    }
  }
  float nearest = ray.t_max;
  for (std::uint32_t i = 0; i < count; ++i) {
    float t;
    bool entering;
    if (!span_of(i, span) || !meet_ball(span, set.ball(i).radius, ray.t_min, set.solid, tolerance, t, entering) ||
        !(t < nearest))
      continue;
    nearest = t;
    fill_ball_hit(set.ball(i), ray, t, entering, hit);
  }
  return nearest < ray.t_max;
}

}  // namespace embrun
