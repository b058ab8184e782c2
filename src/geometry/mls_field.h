#pragma once

#include "geometry/splat.h"
#include "math/lanes.h"

// The field of a moving least squares surface over oriented points [Adamson2003], [Wald2005], summed along a line.
//
// With weights w_i = phi(|x - p_i| / h_i), N = sum w_i n_i and A = sum w_i (x - p_i) it is F(x) = N . A, whose zeros are
// those of n(x) . (x - a(x)): a(x) = x - A / W is the weighted mean of the points, n(x) = N / |N| that of their normals,
// W = sum w_i. F > 0 outside. phi is Wendland's function (1 - r)^4 (4 r + 1), twice continuously differentiable [Wendland1995].

namespace embrun {

/// Points side by side, relative to an origin of the ray's own. The last register is filled up with points of no weight.
struct alignas(64) MlsPoints {
  static constexpr int capacity = 256;

  float x[capacity], y[capacity], z[capacity];
  float normal_x[capacity], normal_y[capacity], normal_z[capacity];
  float support[capacity], inverse[capacity];  ///< h, 1/h
  float cosine[capacity], across[capacity];    ///< of the normal and a stretch's usual one, and the sine
  std::uint32_t number[capacity];
  int count = 0;

  EMBRUN_FN bool full() const { return count == capacity; }
  EMBRUN_FN void add(const Splat& point, Vec3 origin, std::uint32_t index) {
    const Vec3 p = point.center - origin;
    x[count] = p.x;
    y[count] = p.y;
    z[count] = p.z;
    normal_x[count] = point.normal.x;
    normal_y[count] = point.normal.y;
    normal_z[count] = point.normal.z;
    support[count] = point.radius;
    inverse[count] = 1.0f / point.radius;
    number[count++] = index;
  }
  /// Finds `cosine` and `across`, for bounds; after fill_up().
  EMBRUN_FN void compare_normals(Vec3 usual) {
    for (int i = 0; i < (count + 15) / 16 * 16; ++i) {
      cosine[i] = normal_x[i] * usual.x + normal_y[i] * usual.y + normal_z[i] * usual.z;
      across[i] = sqrtf(max_of(1.0f - square(cosine[i]), 0.0f));
    }
  }
  EMBRUN_FN void fill_up() {
    for (int i = count; i % 16 != 0; ++i) {
      // So far away that nothing is felt of it, whatever the unit of length, and nothing overflows.
      x[i] = 1e12f * support[0];
      y[i] = z[i] = normal_x[i] = normal_y[i] = normal_z[i] = 0.0f;
      support[i] = support[0];
      inverse[i] = inverse[0];
    }
  }
};

/// Three sums.
struct MlsLanes3 {
  RegisterLanes x = 0.0f, y = 0.0f, z = 0.0f;

  EMBRUN_FN void add(RegisterLanes weight, RegisterLanes ax, RegisterLanes ay, RegisterLanes az) {
    x += weight * ax;
    y += weight * ay;
    z += weight * az;
  }
  EMBRUN_FN Vec3 sum() const { return {sum_lanes(x), sum_lanes(y), sum_lanes(z)}; }
};

/// A point of a line, and what lies between it and a point of the cloud.
struct MlsOffset {
  RegisterLanes x, y, z, squared;

  EMBRUN_FN MlsOffset(const MlsPoints& points, int i, Vec3 at) {
    x = at.x - load_lanes<RegisterLanes>(points.x + i);
    y = at.y - load_lanes<RegisterLanes>(points.y + i);
    z = at.z - load_lanes<RegisterLanes>(points.z + i);
    squared = x * x + y * y + z * z;
  }
  EMBRUN_FN RegisterLanes along(Vec3 d) const { return x * d.x + y * d.y + z * d.z; }
};

/// What is asked of the field along a line: at x, with the derivative along the unit vector d, and bounds from there to
/// x + length d. `usual` is a unit vector; where it is about the points' normals bounds are tight.
struct MlsQuestion {
  Vec3 x, d, usual;
  float length = 0;
};

/// Sums at a point.
struct MlsValue {
  float weight = 0;   ///< W
  float support = 0;  ///< sum w h
  float field = 0, slope = 0;
  Vec3 normal, away;  ///< N, A
};

/// Bounds on a stretch of the line.
struct MlsBounds {
  float weight = 0;     ///< W is at most this
  float curvature = 0;  ///< |F''| is at most this
  // Of the points that are felt somewhere on the stretch, if any is:
  float low = 0, high = 0;  ///< least and greatest usual . (x - p_i) / h_i
  float agreement = 0;      ///< least usual . n_i
};

/// Adds up MlsValue.
struct MlsValueSums {
  RegisterLanes weight = 0.0f, support = 0.0f;
  MlsLanes3 normal, away, normal_slope, away_slope;

  EMBRUN_FN void add(const MlsPoints& points, const MlsQuestion& ask) {
    for (int i = 0; i < points.count; i += register_lanes) {
      const MlsOffset q(points, i, ask.x);
      add_lanes(points, i, ask, q, sqrt_of(q.squared));
    }
  }
  EMBRUN_FN void add_lanes(const MlsPoints& points, int i, const MlsQuestion& ask, const MlsOffset& q,
                           RegisterLanes distance) {
    const RegisterLanes inverse = load_lanes<RegisterLanes>(points.inverse + i);
    const RegisterLanes r = distance * inverse, rest = max_of(1.0f - r, 0.0f), rest2 = rest * rest;
    const RegisterLanes w = rest2 * rest2 * (4.0f * r + 1.0f);
    const RegisterLanes slope = -20.0f * (rest2 * rest) * (inverse * inverse) * q.along(ask.d);
    const RegisterLanes nx = load_lanes<RegisterLanes>(points.normal_x + i),
                        ny = load_lanes<RegisterLanes>(points.normal_y + i),
                        nz = load_lanes<RegisterLanes>(points.normal_z + i);
    weight += w;
    support += w * load_lanes<RegisterLanes>(points.support + i);
    normal.add(w, nx, ny, nz);
    away.add(w, q.x, q.y, q.z);
    normal_slope.add(slope, nx, ny, nz);
    away_slope.add(slope, q.x, q.y, q.z);
  }
  EMBRUN_FN MlsValue value(Vec3 d) const {
    MlsValue v;
    v.weight = sum_lanes(weight);
    v.support = sum_lanes(support);
    v.normal = normal.sum();
    v.away = away.sum();
    v.field = dot(v.normal, v.away);
    v.slope = dot(normal_slope.sum(), v.away) + dot(v.normal, away_slope.sum() + v.weight * d);
    return v;
  }
};

/// Adds up MlsBounds, and MlsValue with them.
///
/// F'' = N'' . A + 2 N' . A' + N . A'', and each product is split into its parts along `usual` and across it. For that w, w' and w''
/// of each point are bounded over the stretch: phi falls, |phi'| = 20 r (1 - r)^3 is largest at r = 1/4, and
/// w'' = -20/h^2 ((1 - r)^3 - 3 (1 - r)^2 (q . d)^2 / (r h^2)) lies between -20/h^2 (1 - r)^3 and
/// 20/h^2 min((1 - r)^2 (4 r - 1), the same with what (q . d)^2 may be), where (1 - r)^2 (4 r - 1) is largest at r = 1/2: 1/4.
struct MlsLineSums {
  MlsValueSums value;
  // Of the bounds of w, w' and w'': alone, times the point's distance along `usual`, times how far its normal is off `usual`,
  // times its whole distance.
  RegisterLanes alone[3] = {0.0f, 0.0f, 0.0f}, height[3] = {0.0f, 0.0f, 0.0f}, slant[3] = {0.0f, 0.0f, 0.0f},
                reach[3] = {0.0f, 0.0f, 0.0f};
  RegisterLanes low = 1e30f, high = -1e30f, agreement = 1.0f;

  EMBRUN_FN void add(const MlsPoints& points, const MlsQuestion& ask) {
    const float rise = dot(ask.usual, ask.d) * ask.length;
    const RegisterLanes nothing = 0.0f;
    for (int i = 0; i < points.count; i += register_lanes) {
      const MlsOffset q(points, i, ask.x);
      const RegisterLanes away = sqrt_of(q.squared);
      value.add_lanes(points, i, ask, q, away);

      const RegisterLanes inverse = load_lanes<RegisterLanes>(points.inverse + i), inverse2 = inverse * inverse;
      const RegisterLanes here = q.along(ask.d), there = here + ask.length;
      const RegisterLanes farthest = max_of(max_of(here, 0.0f - here), max_of(there, 0.0f - there));
      const RegisterLanes nearest = min_of(max_of(0.0f - here, 0.0f), ask.length);
      const RegisterLanes r = sqrt_of(max_of(q.squared + nearest * (2.0f * here + nearest), 0.0f)) * inverse;
      const RegisterLanes rest = max_of(1.0f - r, 0.0f), rest2 = rest * rest, rest3 = rest2 * rest;
      const RegisterLanes steepest = max_of(r, 0.25f), steep = max_of(1.0f - steepest, 0.0f);
      const RegisterLanes bend =
          min_of(select_less(r, RegisterLanes(0.5f), RegisterLanes(0.25f), rest2 * (4.0f * r - 1.0f)),
                 3.0f * rest2 * (farthest * farthest * inverse2) / max_of(r, 1e-6f));
      RegisterLanes most[3];
      most[0] = rest2 * rest2 * (4.0f * r + 1.0f);
      most[1] = 20.0f * inverse * min_of(steep * steep * steep * steepest, rest3 * (farthest * inverse));
      most[2] = 20.0f * inverse2 * max_of(rest3, bend);

      const RegisterLanes foot = q.along(ask.usual), head = foot + rise;
      const RegisterLanes above = max_of(max_of(foot, 0.0f - foot), max_of(head, 0.0f - head));
      const RegisterLanes cosine = load_lanes<RegisterLanes>(points.cosine + i);
      const RegisterLanes across = load_lanes<RegisterLanes>(points.across + i);
      const RegisterLanes distance = min_of(away + ask.length, load_lanes<RegisterLanes>(points.support + i));
      for (int k = 0; k < 3; ++k) {
        alone[k] += most[k];
        height[k] += most[k] * above;
        slant[k] += most[k] * across;
        reach[k] += most[k] * distance;
      }
      low = min_of(low, select_less(nothing, rest, foot * inverse, RegisterLanes(1e30f)));
      high = max_of(high, select_less(nothing, rest, foot * inverse, RegisterLanes(-1e30f)));
      agreement = min_of(agreement, select_less(nothing, rest, cosine, RegisterLanes(1.0f)));
    }
  }

  EMBRUN_FN MlsBounds bounds(const MlsQuestion& ask) const {
    const float along = fabsf(dot(ask.usual, ask.d));
    float s[3], h[3], b[3], r[3];
    for (int k = 0; k < 3; ++k) {
      s[k] = sum_lanes(alone[k]);
      h[k] = sum_lanes(height[k]);
      b[k] = sum_lanes(slant[k]);
      r[k] = sum_lanes(reach[k]);
    }
    const float a0 = h[0], a1 = h[1] + s[0] * along, a2 = h[2] + 2.0f * s[1] * along;  // A along `usual`
    const float c0 = r[0], c1 = r[1] + s[0], c2 = r[2] + 2.0f * s[1];                  // and across
    MlsBounds result;
    result.weight = s[0];
    // A little more, for rounding.
    result.curvature = 1.001f * (s[2] * a0 + 2.0f * s[1] * a1 + s[0] * a2 + b[2] * c0 + 2.0f * b[1] * c1 + b[0] * c2);
    result.low = min_lane(low);
    result.high = max_lane(high);
    result.agreement = min_lane(agreement);
    return result;
  }
};

/// The gradient of F at x, the value there being known: sum c_i q_i (n_i . A + q_i . N) + W N with q_i = x - p_i and
/// grad w_i = c_i q_i.
struct MlsGradientSums {
  MlsLanes3 gradient;

  EMBRUN_FN void add(const MlsPoints& points, Vec3 x, const MlsValue& at) {
    for (int i = 0; i < points.count; i += register_lanes) {
      const MlsOffset q(points, i, x);
      const RegisterLanes inverse = load_lanes<RegisterLanes>(points.inverse + i);
      const RegisterLanes rest = max_of(1.0f - sqrt_of(q.squared) * inverse, 0.0f);
      const RegisterLanes facing = load_lanes<RegisterLanes>(points.normal_x + i) * at.away.x +
                                   load_lanes<RegisterLanes>(points.normal_y + i) * at.away.y +
                                   load_lanes<RegisterLanes>(points.normal_z + i) * at.away.z;
      gradient.add(-20.0f * (rest * rest * rest) * (inverse * inverse) * (facing + q.along(at.normal)), q.x, q.y, q.z);
    }
  }
};

}  // namespace embrun
