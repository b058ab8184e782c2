#pragma once

#include <cstdint>

#include "math/ray.h"
#include "math/vec.h"

// Splats: discs and ellipses that stand for a surface known by points.

namespace embrun {

/// A flat disc or ellipse. Its outline is where splat_reach() is 1.
struct Splat {
  Vec3 center;
  float radius = 0;  ///< of an ellipse the greater half axis a
  Vec3 normal;       ///< unit, out of the body
  /// Of an ellipse: along the lesser half axis b, of length sqrt(1/b^2 - 1/a^2), 1/m. 0: a disc.
  Vec3 squeeze;
};

/// What a linear field of normals adds to a splat's own, per metre along the two tangents of Frame(normal): the symmetric
/// matrix (ss st; st tt) of the surface's curvature there [Botsch2004].
struct SplatBend {
  float ss = 0, st = 0, tt = 0;
};

inline constexpr std::uint32_t splats_per_block = 8;

/// Splats side by side, for loops over all of them at once. A lane without normal stands for none and is never met.
struct alignas(32) SplatBlock {
  float x[splats_per_block] = {}, y[splats_per_block] = {}, z[splats_per_block] = {};
  float normal_x[splats_per_block] = {}, normal_y[splats_per_block] = {}, normal_z[splats_per_block] = {};
  float radius[splats_per_block] = {};
  float squeeze_x[splats_per_block] = {}, squeeze_y[splats_per_block] = {}, squeeze_z[splats_per_block] = {};

  EMBRUN_FN Splat splat(std::uint32_t i) const {
    return {{x[i], y[i], z[i]},
            radius[i],
            {normal_x[i], normal_y[i], normal_z[i]},
            {squeeze_x[i], squeeze_y[i], squeeze_z[i]}};
  }
  EMBRUN_FN void set(std::uint32_t i, const Splat& s) {
    x[i] = s.center.x;
    y[i] = s.center.y;
    z[i] = s.center.z;
    normal_x[i] = s.normal.x;
    normal_y[i] = s.normal.y;
    normal_z[i] = s.normal.z;
    radius[i] = s.radius;
    squeeze_x[i] = s.squeeze.x;
    squeeze_y[i] = s.squeeze.y;
    squeeze_z[i] = s.squeeze.z;
  }
};

/// Where a ray meets a splat.
struct SplatMeeting {
  float t;
  float along;  ///< cosine of the ray's direction and the normal: negative where the front is met
  /// 1 at the centre, 0 on the outline: (r - d) / r at distance d from the centre of a disc of radius r.
  float share;
};

/// The square of the distance of a point of the splat's plane from its centre (given as the difference of the two), in
/// units of the outline's there.
EMBRUN_FN float squared_splat_reach(const Splat& splat, Vec3 from_center) {
  const float inverse = 1.0f / splat.radius;
  return length_squared(from_center) * (inverse * inverse) + square(dot(from_center, splat.squeeze));
}

/// The meeting of a line and a splat, or false. Every search ends here, and the compiler keeps one copy of it, so that
/// all find the same bits.
EMBRUN_LOCAL_FN __attribute__((noinline)) bool meet_splat(const Splat& splat, const Ray& ray, SplatMeeting& meeting) {
  const float along = dot(ray.direction, splat.normal);
  const Vec3 to_center = splat.center - ray.origin;
  const float t = dot(to_center, splat.normal) / along;
  const float squared = squared_splat_reach(splat, ray.direction * t - to_center);
  if (!(squared <= 1.0f) || !is_finite(t)) return false;
  meeting = {t, along, 1.0f - sqrtf(squared)};
  return true;
}

/// Bit i: the line may meet lane i of the block with t in [near, far]. As far as rounding goes meet_splat() may yet
/// say no, but a lane whose bit is 0 is not met there. The loop is the compiler's to vectorise.
EMBRUN_FN std::uint32_t lanes_to_meet(const SplatBlock& block, const Ray& ray, float near, float far) {
  const Vec3 o = ray.origin, d = ray.direction;
  std::int32_t maybe[splats_per_block];
  for (std::uint32_t i = 0; i < splats_per_block; ++i) {
    const float along = d.x * block.normal_x[i] + d.y * block.normal_y[i] + d.z * block.normal_z[i];
    const float cx = block.x[i] - o.x, cy = block.y[i] - o.y, cz = block.z[i] - o.z;
    const float inverse_along = 1.0f / along;
    const float t = (cx * block.normal_x[i] + cy * block.normal_y[i] + cz * block.normal_z[i]) * inverse_along;
    const float px = d.x * t - cx, py = d.y * t - cy, pz = d.z * t - cz;
    const float squeezed = px * block.squeeze_x[i] + py * block.squeeze_y[i] + pz * block.squeeze_z[i];
    const float inverse = 1.0f / block.radius[i];
    const float squared = (px * px + py * py + pz * pz) * (inverse * inverse) + squeezed * squeezed;
    // The rounding of t, the ray being as oblique as it is, and what it makes of the distance from the centre.
    const float reach = fabsf(cx) + fabsf(cy) + fabsf(cz);
    const float slack = 1e-6f * (reach + fabsf(t)) * (1.0f + fabsf(inverse_along));
    const float widened = 1.0f + slack * inverse;
    // Not short-circuited, for the compiler's sake. What is not a number is never met.
    maybe[i] = static_cast<int>(squared <= widened * widened) & static_cast<int>(t >= near - slack) &
               static_cast<int>(t <= far + slack);
  }
  std::uint32_t bits = 0;
  for (std::uint32_t i = 0; i < splats_per_block; ++i) bits |= static_cast<std::uint32_t>(maybe[i]) << i;
  return bits;
}

/// Shows the query those splats of a block that it may meet; number(lane) is what it knows them by. Bits of `wanted` are
/// those of lanes that count.
template <class Query, class Number>
EMBRUN_FN void offer_block(const SplatBlock& block, Query& query, const Number& number, std::uint32_t wanted = ~0u) {
  std::uint32_t lanes = lanes_to_meet(block, query.ray(), query.near(), query.limit()) & wanted;
  for (std::uint32_t lane = 0; lanes != 0; ++lane, lanes >>= 1)
    if ((lanes & 1u) != 0) query.consider(block.splat(lane), number(lane));
}

/// The normal of a splat at a point of its plane (given as the difference from its centre).
EMBRUN_FN Vec3 bent_normal(const Splat& splat, const SplatBend& bend, Vec3 from_center) {
  const Frame frame(splat.normal);
  const float s = dot(from_center, frame.s), t = dot(from_center, frame.t);
  return normalize(splat.normal + (bend.ss * s + bend.st * t) * frame.s + (bend.st * s + bend.tt * t) * frame.t);
}

/// The least box that holds a splat.
EMBRUN_FN Box3 bounds_of(const Splat& splat) {
  const float a = splat.radius;
  const float squeezed = length(splat.squeeze);
  Vec3 reach;
  // The half axes are conjugate: along an axis of the coordinates they reach as far as the root of their squares' sum.
  if (squeezed > 0.0f) {
    const Vec3 lesser = splat.squeeze / squeezed, greater = cross(splat.normal, lesser);
    const float b = 1.0f / sqrtf(squeezed * squeezed + 1.0f / (a * a));
    for (int axis = 0; axis < 3; ++axis) reach[axis] = sqrtf(square(a * greater[axis]) + square(b * lesser[axis]));
  } else {
    for (int axis = 0; axis < 3; ++axis) reach[axis] = a * sqrtf(max_of(1.0f - square(splat.normal[axis]), 0.0f));
  }
  return {splat.center - reach, splat.center + reach};
}

}  // namespace embrun
