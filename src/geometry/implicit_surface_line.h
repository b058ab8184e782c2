#pragma once

#include "geometry/implicit_surface.h"
#include "geometry/implicit_surface_field.h"

namespace embrun {

// The first crossing of one field along a ray within one cell. Lengths are grid units. A model of the field along the
// ray, a parabola within proven bounds, says where the field cannot cross; where it can, the field is evaluated exactly,
// and each evaluation proves a whole interval free of crossings from the value, the slope and the bounds on the second
// derivative (FieldOnLine). So the crossing that is returned is the first one.

/// Upper model of F along a ray, F being g going in and -g going out: F <= p0 + p1 t + p2 t^2 + slack.
struct Parabola {
  float p0, p1, p2;

  EMBRUN_FN float at(float t) const { return p0 + t * (p1 + t * p2); }
};

/// The bracket's width at which a crossing is found: 3e-4 of a cell, 6e-4 R0. The crossing returned is far nearer.
inline constexpr float crossing_tolerance = 3e-4f;
/// How far from 0 the relative field may be at a point that is meant to lie on the surface.
inline constexpr float rounding_on_surface = 4e-3f;

/// First t >= low at which the parabola is >= -slack; false if there is none up to high.
EMBRUN_FN bool first_possible(const Parabola& p, float slack, float& low, float high) {
  if (low > high) return false;
  const float here = p.at(low) + slack;
  if (here >= 0.0f) return true;
  const float slope = p.p1 + 2.0f * p.p2 * low;
  // Most cells are settled by the ends alone: between them only a hill can be higher.
  const bool hill = p.p2 < 0.0f && slope > 0.0f && p.p1 + 2.0f * p.p2 * high < 0.0f;
  if (!hill && p.at(high) + slack < 0.0f) return false;
  // here + slope dt + p2 dt^2 = 0, smallest dt > 0.
  const float disc = slope * slope - 4.0f * p.p2 * here;
  if (disc < 0.0f) return false;
  const float root = sqrtf(disc);
  low += slope > 0.0f ? -2.0f * here / (slope + root) : (root - slope) / (2.0f * p.p2);
  return low <= high;
}

/// Where to look first: the parabola's first zero in [low, high], else its highest point there.
EMBRUN_FN float likely_crossing(const Parabola& p, float low, float high) {
  float t = low;
  if (first_possible(p, 0.0f, t, high)) return t;
  if (p.p2 < 0.0f) return clamp(-p.p1 / (2.0f * p.p2), low, high);
  return p.at(high) > p.at(low) ? high : low;
}

/// The step from where a function has `value` and the slope `slope` to its zero, if it is a parabola of second derivative
/// `curve`; Newton's where that parabola has none.
EMBRUN_FN float step_to_zero(float value, float slope, float curve) {
  const float disc = slope * slope - 2.0f * curve * value;
  return disc > 0.0f ? -2.0f * value / (slope + copysignf(sqrtf(disc), slope)) : -value / slope;
}

/// F at t of a ray, and -down <= F'' <= up from where is asked about to `end`.
struct LineExpansion {
  float t, value, slope, up, down, end;
};

/// First t in [low, high] at which F = sign * g reaches 0 from below, g the field of one branch. `origin` is relative
/// to the cell's centre; F <= model + slack. `guess` is where to look first; but a ray that starts on the surface is
/// looked at there before (F may be a rounding error above 0), and with `at_low` the field at `low` is known.
template <Kernel kernel, SurfaceBranch branch, bool equal_radii>
EMBRUN_LOCAL_FN bool first_crossing(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                    const Vec3& direction, float sign, const Parabola& model, float slack, float low,
                                    float high, float guess, bool starts_on_surface, const FieldOnLine* at_low,
                                    float& t_hit) {
  float sure = infinity;  // F has reached 0 by here
  float t = starts_on_surface || at_low != nullptr ? low : guess;
  float last_width = infinity;
  // What the last evaluation that did not reach back to `low` proved: no crossing in (free_from, free_to).
  LineExpansion skipped{};
  float free_from = infinity, free_to = 0.0f;
  // How far ahead of `low` bounds are asked for there: less where something small ahead makes steps short.
  float horizon = infinity;
  for (int i = 0; i < 200; ++i) {
    const Vec3 y = origin + direction * t;
    const float end = min_of(high, sure);
    const bool from_low = t == low;
    const float bound_end = from_low ? min_of(end, low + horizon) : end;
    FieldOnLine g;
    if (i == 0 && at_low != nullptr) {
      g = *at_low;
    } else {
      g = field_on_line<kernel, branch, equal_radii, BoundsFor::segment>(s, cell, y, direction, low - t, bound_end - t);
    }
    LineExpansion f{t,
                    sign * g.value,
                    sign * g.slope,
                    max_of(sign > 0.0f ? g.up : g.down, 1e-12f),
                    max_of(sign > 0.0f ? g.down : g.up, 1e-12f),
                    bound_end};

    // Where radii differ, what matters is small against the scale on which the field changes.
    const float tolerance =
        equal_radii ? crossing_tolerance : crossing_tolerance * min_of(1.0f, 1.0f / max_of(fabsf(f.slope), 1e-6f));
    // Around t, F stays under value + slope s + up s^2 / 2: the interval where that is negative is free.
    const float disc = f.slope * f.slope - 2.0f * f.up * f.value;
    float from = infinity, to = 0.0f;
    if (f.value < 0.0f) {
      const float root = sqrtf(disc);
      from = t - (f.slope > 0.0f ? (f.slope + root) / f.up : -2.0f * f.value / (root - f.slope));
      to = min_of(t + (f.slope > 0.0f ? -2.0f * f.value / (f.slope + root) : (root - f.slope) / f.up),
                  bound_end < end ? bound_end : end + tolerance);
      // And over value + slope s - down s^2 / 2, which may prove a crossing.
      const float lower_disc = f.slope * f.slope + 2.0f * f.down * f.value;
      if (f.slope > 0.0f && lower_disc >= 0.0f) {
        const float proven = t - 2.0f * f.value / (f.slope + sqrtf(lower_disc));
        if (proven <= bound_end) sure = proven;
      }
    } else if (starts_on_surface && i == 0 && f.value < rounding_on_surface) {
      // The ray starts on the surface: rounding put it across. It leaves within the smaller root of the bound.
      if (f.slope >= 0.0f) {
        t_hit = t;
        return true;
      }
      from = low;
      if (disc > 0.0f) {
        const float root = sqrtf(disc);
        to = max_of(low + 2.0f * f.value / (root - f.slope), t + (root - f.slope) / f.up);
      } else {
        to = low + tolerance;
      }
    } else {
      sure = min_of(sure, t);
      if (f.slope > 0.0f && disc > 0.0f) {
        const float root = sqrtf(disc);
        from = t - (f.slope + root) / f.up;
        to = t - 2.0f * f.value / (f.slope + root);
      }
    }
    const bool gap = !(from <= low);
    if (gap) {
      skipped = f;
      free_from = from;
      free_to = to;
    } else {
      if (from_low) {
        const float asked = bound_end - low, step = to - low;
        horizon = step < 0.25f * asked ? 0.25f * asked : step >= 0.99f * asked ? 4.0f * asked : horizon;
      }
      low = max_of(low, to);
      if (free_from <= low) {
        // The interval that was skipped joins on: go on from what is known there.
        low = max_of(low, free_to);
        f = skipped;
        free_from = infinity;
      }
    }

    if (low > high) return false;
    const float newton = f.slope > 0.0f ? f.t - f.value / f.slope : infinity;
    if (sure < infinity) {
      const float width = sure - low;
      // Found: within the tolerance, or where the slope cannot turn before it, so that the crossing is the only one
      // there and Newton's steps lead to it (fill_hit takes the last ones).
      const bool monotone = sure <= f.end && f.slope > 2.0f * max_of(f.up, f.down) * max_of(f.t - low, sure - f.t);
      if (width <= tolerance || monotone) {
        // F is at 0 or above at `low` already where Newton's step leads back beyond it.
        const float zero = f.slope > 0.0f ? f.t + step_to_zero(f.value, f.slope, 2.0f * model.p2) : infinity;
        t_hit = zero < sure ? max_of(zero, low) : 0.5f * (low + sure);
        return t_hit <= high;
      }
      // A crossing is in (low, sure]. Newton, unless it leaves the bracket or has stopped gaining.
      t = newton > low && newton < sure && width < 0.5f * last_width ? newton : gap ? low : 0.5f * (low + sure);
      last_width = width;
    } else {
      if (!first_possible(model, slack, low, high)) return false;
      // Evaluating at `low` always moves it on; a likelier place does when its free interval reaches back to it.
      if (gap) {
        t = low;
      } else if (newton > low && newton <= high) {
        t = newton;
      } else if (free_from < infinity) {
        t = low;
      } else if (branch == SurfaceBranch::main) {
        t = likely_crossing(model, low, high);
      } else {
        t = guess > low && guess <= high ? guess : low;
      }
    }
  }
  // Hundreds of near-tangencies in one cell: one that is known to cross does so here, others are touches.
  t_hit = 0.5f * (low + sure);
  return t_hit <= high;
}

}  // namespace embrun
