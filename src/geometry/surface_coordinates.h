#pragma once

#include "geometry/box.h"
#include "geometry/cylinder.h"
#include "geometry/patch.h"

// Coordinates (u, v) of surfaces, for textures, and where u grows, for what is brushed. They are those of Mitsuba 3's
// shapes, so that its scenes look as they do there.

namespace embrun {

struct SurfaceCoordinates {
  Vec2 uv;
  Vec3 tangent;  ///< along growing u, of any length; zero where there is none
};

/// Longitude of the direction (x, y) from the x axis over a full turn, in [0, 1].
EMBRUN_FN float longitude_of(float x, float y) {
  const float turn = atan2f(y, x) * (0.5f * inv_pi);
  return turn < 0.0f ? turn + 1.0f : turn;
}

/// Of a ball, by its unit normal in a frame whose z axis is the pole: u is the longitude from x over a full turn, in
/// [0, 1], v the angle from the pole over a half turn.
EMBRUN_FN SurfaceCoordinates ball_coordinates(Vec3 normal) {
  const float angle = atan2f(sqrtf(normal.x * normal.x + normal.y * normal.y), normal.z);
  return {{longitude_of(normal.x, normal.y), angle * inv_pi}, {-normal.y, normal.x, 0.0f}};
}

/// Of a rectangle: [0, 1] x [0, 1] along its axes; metres from its centre along an axis that has no end. Of a round one: u
/// is the share of the radius, v the longitude from axis_u over a full turn.
EMBRUN_FN SurfaceCoordinates patch_coordinates(const Patch& patch, Vec3 position) {
  const Vec3 offset = position - patch.center;
  const float u = dot(offset, patch.axis_u), v = (patch.v_reversed ? -1.0f : 1.0f) * dot(offset, patch.axis_v);
  if (patch.round) {
    const float x = u / patch.half_u, y = v / patch.half_v, radius = sqrtf(x * x + y * y);
    return {{radius, longitude_of(x, y)}, radius > 0.0f ? offset : patch.axis_u};
  }
  const auto share = [](float distance, float half) {
    return half < infinity ? 0.5f * (distance / half + 1.0f) : distance;
  };
  return {{share(u, patch.half_u), share(v, patch.half_v)}, patch.axis_u};
}

/// Of a cylinder: u is the longitude about the axis over a full turn, v the share of the way along it.
EMBRUN_FN SurfaceCoordinates cylinder_coordinates(const Cylinder& cylinder, Vec3 position) {
  const Vec3 offset = position - cylinder.start;
  const Vec3 right = cross(cylinder.axis, cylinder.meridian) * (cylinder.u_reversed ? -1.0f : 1.0f);
  const float x = dot(offset, cylinder.meridian), y = dot(offset, right);
  return {{longitude_of(x, y), dot(offset, cylinder.axis) / cylinder.length}, right * x - cylinder.meridian * y};
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
