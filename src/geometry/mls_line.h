#pragma once

#include "geometry/mls_field.h"

// The first zero of a moving least squares field along a stretch of a line, proven by bounds of its second derivative.

namespace embrun {

// F has zeros where the cloud has no surface as well: beyond its borders, and amid points of opposite normals.

/// There is a surface where |x - a(x)| is at most so many times the mean support. Over a half plane of points of even density
/// it is 0.2122 h on the border itself: 2 / pi of the mean distance h / 3. A little more keeps uneven sampling from making
/// holes.
inline constexpr float mls_open_reach = 0.4f;
/// A body has no border, and what is wanted is that nothing gets through.
inline constexpr float mls_closed_reach = 0.5f;
/// Points that weigh less in all make no surface; one alone weighs 1 where it is.
inline constexpr float mls_least_weight = 0.1f;
/// |N| / W is at least this: normals that cancel each other say nothing.
inline constexpr float mls_least_agreement = 0.1f;
/// The search goes on by at least this share of the least support: two zeros nearer to each other may be missed.
inline constexpr float mls_least_step = 1e-4f;

/// Bounds are of little use for longer parts of a ray than this share of the least support.
inline constexpr float mls_longest_proof = 0.5f;

/// A stretch of a line: x = origin of the points + t direction, t in [0, end].
struct MlsStretch {
  Vec3 direction;
  Vec3 usual;  ///< the mean of the points' normals, unit
  float end = 0;
  float least_support = 0, greatest_support = 0;
  float reach = 0;  ///< mls_open_reach or mls_closed_reach
};

/// A zero of F.
struct MlsCrossing {
  float t = 0;
  MlsValue value;
  Vec3 gradient;
  bool entering = false;  ///< from F > 0 to F < 0
};

// The functions below take a `Field`, which has
//   template <class Sums, class... Ask> void add(Sums& sums, float from, float to, const Ask&... ask) const;
// It calls sums.add(points, ask...) for one or more MlsPoints, in which all points are that are felt in [from, to] of the stretch.

template <class Field>
EMBRUN_LOCAL_FN MlsValue mls_value(const Field& field, const MlsStretch& stretch, float t) {
  MlsValueSums sums;
  field.add(sums, t, t, MlsQuestion{stretch.direction * t, stretch.direction, stretch.usual, 0.0f});
  return sums.value(stretch.direction);
}

/// The zero in [low, high], where F has `sign` at low and the other one at high: Newton's method from `guess`, kept in the bracket.
/// False: there is no surface.
template <class Field>
EMBRUN_LOCAL_FN bool settle_mls_crossing(const Field& field, const MlsStretch& stretch, float low, float high,
                                         float guess, int sign, MlsCrossing& crossing) {
  const float tolerance = 2e-7f * stretch.least_support;
  float t = guess;
  for (int i = 0; i < 60; ++i) {
    crossing.value = mls_value(field, stretch, t);
    const float g = static_cast<float>(sign) * crossing.value.field;
    const float slope = static_cast<float>(sign) * crossing.value.slope;
    (g < 0.0f ? high : low) = t;
    float next = slope < 0.0f ? t - g / slope : 0.5f * (low + high);
    if (!(next >= low && next <= high)) next = 0.5f * (low + high);
    const bool done = fabsf(next - t) <= tolerance || g == 0.0f;
    t = next;
    if (done) break;
  }
  const MlsValue& v = crossing.value;
  crossing.t = t;
  crossing.entering = sign > 0;
  if (!(v.weight >= mls_least_weight) || length_squared(v.away) > square(stretch.reach * v.support) ||
      length_squared(v.normal) < square(mls_least_agreement * v.weight))
    return false;
  MlsGradientSums sums;
  field.add(sums, t, t, stretch.direction * t, v);
  crossing.gradient = sums.gradient.sum() + v.weight * v.normal;
  // Out of the body F grows: where it falls along the normals there is no surface.
  return dot(crossing.gradient, v.normal) > 0.0f;
}

/// How far ahead there is no surface, as all points that are felt lie on one side: where usual . (x - p_i) > c h_i for each of
/// them, |x - a| is too large with c = reach; and with c = tan(b), b the largest angle of a normal with `usual`, F has
/// no zero.
EMBRUN_FN float clear_of_points(const MlsStretch& stretch, const MlsBounds& bounds) {
  const float rate = dot(stretch.usual, stretch.direction);
  float c = stretch.reach;
  if (bounds.agreement > 0.0f)
    c = min_of(c, sqrtf(max_of(1.0f - square(bounds.agreement), 0.0f)) / bounds.agreement + 1e-4f);
  const float room = max_of(bounds.low, -bounds.high) - c;
  if (room <= 0.0f) return 0.0f;
  const float closing = bounds.low > 0.0f ? -rate : rate;
  return closing > 0.0f ? room * stretch.least_support / closing : infinity;
}

/// Where the search is.
struct MlsMarch {
  float t = 0;
  float length = 0;   ///< that is asked about next
  float last_t = 0;   ///< the last place where F was looked at,
  int last_sign = 0;  ///< and its sign there; 0: something between there and t was passed over
};

/// Goes on for as far as F is proven to keep its sign. `g` is |F|, `slope` its derivative.
EMBRUN_FN void go_on_freely(const MlsStretch& stretch, float curvature, float g, float slope, MlsMarch& march) {
  const float step = mls_least_step * stretch.least_support, length = march.length;
  // That is as long as g + slope s - curvature s^2 / 2 does.
  const float root = sqrtf(slope * slope + 2.0f * curvature * g);
  const float free = slope < 0.0f ? 2.0f * g / (root - slope) : (slope + root) / max_of(curvature, 1e-30f);
  march.t += max_of(min_of(free, length), step);
  march.length = free >= length ? 1.7f * length : max_of(1.7f * free, 4.0f * step);
  march.length = min_of(march.length, mls_longest_proof * stretch.least_support);
}

/// A step along a stretch. True: `crossing` is the surface, and the march stands behind it.
template <class Field>
EMBRUN_LOCAL_FN bool march_mls(const Field& field, const MlsStretch& stretch, MlsMarch& march, MlsCrossing& crossing) {
  const float step = mls_least_step * stretch.least_support;
  const float longest = mls_longest_proof * stretch.least_support;
  march.length = min_of(march.length, stretch.end - march.t);
  const float t = march.t, length = march.length;
  const MlsQuestion ask{stretch.direction * t, stretch.direction, stretch.usual, length};
  MlsLineSums sums;
  field.add(sums, t, t + length, ask);
  const MlsBounds bounds = sums.bounds(ask);

  // Nothing near: on, and farther the next time.
  const float clear = bounds.weight < mls_least_weight ? infinity : clear_of_points(stretch, bounds);
  if (clear > min_of(length, step)) {
    march.t += min_of(clear, length);
    march.length = clear >= length ? 2.0f * length : longest;
    march.last_sign = 0;
    return false;
  }
  if (length > longest) {
    march.length = 0.35f * longest;
    return false;
  }
  const MlsValue f = sums.value.value(stretch.direction);
  if (f.weight < mls_least_weight) {
    // By small steps to where there is a field, or to where there is none for sure.
    if (length > step) {
      march.length = max_of(0.25f * length, step);
    } else {
      march.t += length;
      march.length = 2.0f * length;
    }
    march.last_sign = 0;
    return false;
  }

  const int sign = f.field < 0.0f ? -1 : 1;
  const float from = march.last_t;
  const bool changed = march.last_sign == -sign;
  march.last_t = t;
  march.last_sign = sign;
  // A step that was no proof, or rounding, went over a zero.
  if (changed && settle_mls_crossing(field, stretch, from, t, 0.5f * (from + t), -sign, crossing)) return true;

  const float g = fabsf(f.field), slope = sign > 0 ? f.slope : -f.slope;
  // By Kantorovich's theorem there is one zero within twice Newton's step, and his method leads to it [Ortega1968].
  if (slope < 0.0f && 2.0f * bounds.curvature * g <= slope * slope && 2.0f * g <= -slope * length) {
    const float newton = -g / slope;
    const bool surface = settle_mls_crossing(field, stretch, t, t + 2.0f * newton, t + newton, sign, crossing);
    march.t = max_of(crossing.t, t) + step;
    march.length = longest;
    march.last_sign = 0;
    return surface;
  }
  go_on_freely(stretch, bounds.curvature, g, slope, march);
  return false;
}

}  // namespace embrun
