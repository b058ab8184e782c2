#pragma once

#include "backend/cpu/cpu_scene.h"
#include "backend/cpu/embree_ray.h"
#include "math/next_float.h"
#include "media/media_state.h"

// Rays against balls by Embree: its tree leads to blocks of balls, and what a query wants of a block is decided here.

namespace embrun::EMBRUN_ISA_NAMESPACE {

/// What is asked of the balls along a ray.
enum class BallQuestion { none, nearest, exit, touched };

/// A query under way. Embree hands its first member to every call for a block.
struct BallQuery {
  RTCIntersectContext embree;
  const Ray* ray;
  BallQuestion question = BallQuestion::nearest;
  float tolerance = 0;  ///< of `nearest`: without the part that is the set's own
  // Of `nearest`: solids that are not met, as the ray is inside them.
  std::uint64_t ignored = 0;
  // Of `exit`: spans that may belong to the chain once it has been followed further.
  static constexpr int most_waiting = 48;
  SolidExit exit{0};
  BallSpan waiting[most_waiting];
  std::uint32_t waiting_ball[most_waiting];
  int waiting_count = 0;
  bool dropped = false;  ///< there were more
  // Of `touched`.
  TouchedBall touched;

  explicit BallQuery(const Ray& r) : ray(&r) { rtcInitIntersectContext(&embree); }
};

EMBRUN_LOCAL_FN void extend_exit(BallQuery& query, BallSpan span, std::uint32_t ball, float radius, float covered) {
  if (span.exit <= query.exit.end || span.enter > covered) return;
  if (query.exit.extend(span, ball, tolerance_at(query.tolerance, radius))) return;
  if (query.waiting_count == BallQuery::most_waiting) {
    query.dropped = true;
    return;
  }
  query.waiting[query.waiting_count] = span;
  query.waiting_ball[query.waiting_count++] = ball;
}

/// Embree's call for a block of balls.
EMBRUN_LOCAL_FN void meet_block(const RTCIntersectFunctionNArguments* arguments) {
  BallQuery& query = *reinterpret_cast<BallQuery*>(arguments->context);
  if (arguments->valid[0] == 0 || query.question == BallQuestion::none) return;
  const CpuBallSet& balls = *static_cast<const CpuBallSet*>(arguments->geometryUserPtr);
  const std::uint32_t first = arguments->primID * balls_per_block;
  const BallBlock& block = balls.set.blocks[arguments->primID];
  const Ray& ray = *query.ray;
  if (query.question == BallQuestion::touched) {
    for (std::uint32_t lane = 0; lane < balls_per_block; ++lane)
      query.touched.consider(block.ball(lane), first + lane, ray.at(ray.t_min), query.tolerance);
    return;
  }
  if (query.question == BallQuestion::nearest && balls.solid >= 0 && (query.ignored & solid_bit(balls.solid)) != 0)
    return;

  auto& answer = *reinterpret_cast<RTCRayHit*>(arguments->rayhit);
  const float tolerance = query.tolerance + 2.0f * balls.set.slack;
  BlockChords chords;
  chords_of(block, ray, chords);
  for (std::uint32_t lane = 0; lane < balls_per_block; ++lane) {
    if (!(chords.half_squared[lane] > 0.0f)) continue;
    const float half = sqrtf(chords.half_squared[lane]), radius = block.radius[lane];
    const BallSpan span{chords.middle[lane] - half, chords.middle[lane] + half};
    if (query.question == BallQuestion::exit) {
      extend_exit(query, span, first + lane, radius, answer.ray.tfar);
      continue;
    }
    float t;
    bool entering;
    if (!meet_ball(span, radius, ray.t_min, balls.set.solid, tolerance, t, entering) || !(t < answer.ray.tfar))
      continue;
    answer.ray.tfar = t;
    answer.hit.primID = first + lane;
    answer.hit.u = entering ? 1.0f : 0.0f;
    answer.hit.geomID = arguments->geomID;
    answer.hit.instID[0] = arguments->context->instID[0];
  }
}

/// Asks the blocks of a set between two parameters of the ray.
EMBRUN_LOCAL_FN void ask_balls(const CpuBallSet& balls, BallQuery& query, float t_near, float t_far) {
  RTCRayHit rays = embree_ray(*query.ray, t_near, t_far);
  rtcIntersect1(balls.scene, &query.embree, &rays);
}

/// The ball that a point is in or touches.
EMBRUN_LOCAL_FN TouchedBall touched_ball(const CpuBallSet& balls, const Ray& at, float tolerance) {
  BallQuery query(at);
  query.question = BallQuestion::touched;
  query.tolerance = tolerance;
  ask_balls(balls, query, at.t_min, at.t_min);
  return query.touched;
}

enum class WayOut {
  found,
  beyond,  ///< not within the ray's extent
  lost,    ///< the ray does not start in the solid at all
};

/// Where a ray that starts inside a solid of balls leaves it.
EMBRUN_LOCAL_FN WayOut leave_balls(const CpuBallSet& balls, const Ray& ray, SurfaceHit& hit) {
  BallQuery query(ray);
  query.question = BallQuestion::exit;
  SolidExit& exit = query.exit;
  exit.end = ray.t_min;
  // Every round follows the chain of balls by one at least, or is the last.
  for (;;) {
    const float before = exit.end, covered = before + balls.step;
    query.tolerance = ball_tolerance(ray, before, balls.set.slack);
    query.waiting_count = 0;
    query.dropped = false;
    ask_balls(balls, query, before, covered);
    for (bool grown = true; grown;) {
      const float end = exit.end;
      for (int i = 0; i < query.waiting_count; ++i)
        exit.extend(query.waiting[i], query.waiting_ball[i], query.tolerance);
      grown = exit.end > end;
    }
    if (!(exit.end < ray.t_max)) return WayOut::beyond;
    if (exit.end == before || (exit.end < covered && !query.dropped)) break;
  }
  std::uint32_t ball = exit.ball;
  float t = exit.end;
  if (!exit.found) {
    // The offset from another surface has put the start out of the solid: it is left at once.
    const TouchedBall touched = touched_ball(balls, ray, query.tolerance);
    if (!touched.found()) return WayOut::lost;
    ball = touched.ball;
    t = just_after(ray.t_min);
  }
  fill_ball_hit(balls.set.ball(ball), ray, t, false, hit);
  return WayOut::found;
}

}  // namespace embrun::EMBRUN_ISA_NAMESPACE
