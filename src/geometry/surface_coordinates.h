#pragma once

#include "geometry/box.h"
#include "geometry/patch.h"

// Coordinates (u, v) of surfaces, for textures, and where u grows, for what is brushed. They are those of Mitsuba 3's
// shapes, so that its scenes look as they do there.

namespace embrun {

struct SurfaceCoordinates {
  Vec2 uv;
  Vec3 tangent;  ///< along growing u, of any length; zero where there is none
};

/// Of a ball, by its unit normal in a frame whose z axis is the pole: u is the longitude from x over a full turn, in
/// [0, 1), v the angle from the pole over a half turn.
EMBRUN_FN SurfaceCoordinates ball_coordinates(Vec3 normal) {
  const float longitude = atan2f(normal.y, normal.x) * (0.5f * inv_pi);
  const float angle = atan2f(sqrtf(normal.x * normal.x + normal.y * normal.y), normal.z);
  return {{longitude < 0.0f ? longitude + 1.0f : longitude, angle * inv_pi}, {-normal.y, normal.x, 0.0f}};
}

/// Of a rectangle: [0, 1] x [0, 1] along its axes; metres from its centre along an axis that has no end.
EMBRUN_FN SurfaceCoordinates patch_coordinates(const Patch& patch, Vec3 position) {
  const Vec3 offset = position - patch.center;
  const auto along = [&](Vec3 axis, float half) {
    const float distance = dot(offset, axis);
    return half < infinity ? 0.5f * (distance / half + 1.0f) : distance;
  };
  return {{along(patch.axis_u, patch.half_u), along(patch.axis_v, patch.half_v)}, patch.axis_u};
}

/// Of a box: [0, 1] x [0, 1] on each face, which an outward normal along an axis names.
EMBRUN_FN SurfaceCoordinates box_coordinates(const Box3& box, Vec3 position, Vec3 normal) {
  // The axes of u and v on the faces -x, +x, -y, +y, -z, +z; negative ones run backwards, counted from 1.
  constexpr int u_axes[6] = {2, 2, 3, -1, -2, 2}, v_axes[6] = {3, -3, 1, -3, 1, 1};
  int face = 0;
  for (int axis = 0; axis < 3; ++axis)
    if (fabsf(normal[axis]) > 0.5f) face = 2 * axis + (normal[axis] > 0.0f ? 1 : 0);
  const auto along = [&](int signed_axis) {
    const int axis = (signed_axis < 0 ? -signed_axis : signed_axis) - 1;
    const float share = (position[axis] - box.low[axis]) / (box.high[axis] - box.low[axis]);
    return signed_axis < 0 ? 1.0f - share : share;
  };
  SurfaceCoordinates coordinates{{along(u_axes[face]), along(v_axes[face])}, {}};
  const int u_axis = u_axes[face];
  coordinates.tangent[(u_axis < 0 ? -u_axis : u_axis) - 1] = u_axis < 0 ? -1.0f : 1.0f;
  return coordinates;
}

/// Of a triangle a, b, c whose corners have their own, at weights `b1` of b and `b2` of c. The tangent is zero where the
/// corners' coordinates lie on a line.
EMBRUN_FN SurfaceCoordinates triangle_coordinates(const Vec3 (&corners)[3], const Vec2 (&uv)[3], float b1, float b2) {
  const auto blend = [&](float a, float b, float c) { return (1.0f - b1 - b2) * a + b1 * b + b2 * c; };
  SurfaceCoordinates coordinates;
  coordinates.uv = {blend(uv[0].x, uv[1].x, uv[2].x), blend(uv[0].y, uv[1].y, uv[2].y)};
  const float v1 = uv[1].y - uv[0].y, v2 = uv[2].y - uv[0].y;
  const float area = (uv[1].x - uv[0].x) * v2 - (uv[2].x - uv[0].x) * v1;
  if (area != 0.0f)
    coordinates.tangent =
        ((corners[1] - corners[0]) * v2 - (corners[2] - corners[0]) * v1) * (area < 0.0f ? -1.0f : 1.0f);
  return coordinates;
}

}  // namespace embrun
