#pragma once

#include "geometry/implicit_surface.h"
#include "geometry/implicit_surface_field.h"
#include "geometry/surface_hit.h"
#include "math/ray.h"

namespace embrun {

// Ray against the implicit surface. All lengths are grid units until the very end.
//
// The ray walks the top grid by cubes that hold no near cell. In a near cell the model of the field along the
// ray, a parabola within proven bounds, says where the field cannot cross; where it can, the field is evaluated
// exactly, and each evaluation proves a whole interval free of crossings from the value, the slope and the
// bounds on the second derivative (FieldOnLine). So the crossing that is returned is the first one.

/// A ray in grid units, and the part of it that lies in one cell.
struct GridRay {
  Vec3 origin;
  Vec3 direction;
  Vec3 inverse_direction;
};

/// Upper model of F along a ray, F being g going in and -g going out: F <= p0 + p1 t + p2 t^2 + slack.
struct Parabola {
  float p0, p1, p2;

  EMBRUN_FN float at(float t) const { return p0 + t * (p1 + t * p2); }
};

/// The bracket's width at which a crossing is found: 3e-4 of a cell, 6e-4 R0. The crossing returned is far nearer.
inline constexpr float crossing_tolerance = 3e-4f;
/// How far from a hit, in influence radii, the bounds on the field's curvature are asked for.
inline constexpr float clearance_reach = 0.3f;
/// The least clearance, in grid units, that stands for more than the rounding of a ray's origin.
inline constexpr float least_clearance = 0.012f;
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

/// F at t of a ray, and -down <= F'' <= up as far as is asked about.
struct LineExpansion {
  float t, value, slope, up, down;
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
  for (int i = 0; i < 200; ++i) {
    const Vec3 y = origin + direction * t;
    const float end = min_of(high, sure);
    FieldOnLine g;
    if (i == 0 && at_low != nullptr) {
      g = *at_low;
    } else {
      g = field_on_line<kernel, branch, equal_radii, BoundsFor::segment>(s, cell, y, direction, low - t, end - t);
    }
    LineExpansion f{t, sign * g.value, sign * g.slope, max_of(sign > 0.0f ? g.up : g.down, 1e-12f),
                    max_of(sign > 0.0f ? g.down : g.up, 1e-12f)};

    // Where radii differ, what matters is small against the scale on which the field changes.
    const float tolerance =
        equal_radii ? crossing_tolerance : crossing_tolerance * min_of(1.0f, 1.0f / max_of(fabsf(f.slope), 1e-6f));
    // Around t, F stays under value + slope s + up s^2 / 2: the interval where that is negative is free.
    const float disc = f.slope * f.slope - 2.0f * f.up * f.value;
    float from = infinity, to = 0.0f;
    if (f.value < 0.0f) {
      const float root = sqrtf(disc);
      from = t - (f.slope > 0.0f ? (f.slope + root) / f.up : -2.0f * f.value / (root - f.slope));
      to = min_of(t + (f.slope > 0.0f ? -2.0f * f.value / (f.slope + root) : (root - f.slope) / f.up), end + tolerance);
      // And over value + slope s - down s^2 / 2, which may prove a crossing.
      const float lower_disc = f.slope * f.slope + 2.0f * f.down * f.value;
      if (f.slope > 0.0f && lower_disc >= 0.0f) {
        const float proven = t - 2.0f * f.value / (f.slope + sqrtf(lower_disc));
        if (proven <= end) sure = proven;
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
      const bool monotone = f.slope > 2.0f * max_of(f.up, f.down) * max_of(f.t - low, sure - f.t);
      if (width <= tolerance || monotone) {
        t_hit = newton > low && newton < sure ? newton : 0.5f * (low + sure);
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
      } else if (branch == SurfaceBranch::main) {
        t = likely_crossing(model, low, high);
      } else {
        t = guess > low && guess <= high ? guess : low;
      }
    }
  }
  // Hundreds of near-tangencies in one cell: take the last one as a touch that is no crossing.
  return false;
}

/// The parabola of the cell's quadratic along the ray, times sign.
EMBRUN_FN Parabola model_along(const SurfaceCell& cell, Vec3 o, Vec3 d, float sign) {
  const float* c = cell.quadratic;
  const float hx = 2.0f * c[4] * o.x + c[7] * o.y + c[8] * o.z;
  const float hy = c[7] * o.x + 2.0f * c[5] * o.y + c[9] * o.z;
  const float hz = c[8] * o.x + c[9] * o.y + 2.0f * c[6] * o.z;
  const float value = c[0] + c[1] * o.x + c[2] * o.y + c[3] * o.z + 0.5f * (hx * o.x + hy * o.y + hz * o.z);
  const float slope = (c[1] + hx) * d.x + (c[2] + hy) * d.y + (c[3] + hz) * d.z;
  const float curve =
      c[4] * d.x * d.x + c[5] * d.y * d.y + c[6] * d.z * d.z + c[7] * d.x * d.y + c[8] * d.x * d.z + c[9] * d.y * d.z;
  return {sign * value, sign * slope, sign * curve};
}

/// What is known of where the ray starts.
struct RayStart {
  bool on_surface = false;  ///< it starts on the surface, in this cell
  float clear_main = 0.0f;  ///< no crossing of the main field's surface before this t
  float clear_recovered = 0.0f;
};

/// A crossing inside one cell, before normals.
struct CellCrossing {
  float t;
  SurfaceBranch branch;
};

/// First crossing of the main field's side change within [low, high]; `origin` is relative to the cell's centre
/// and t = 0 there; `model` is that of model_along.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool main_crossing(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                   const Vec3& direction, float sign, const Parabola& model, float low, float high,
                                   bool starts_on_surface, float& t) {
  const float slack = sign > 0.0f ? cell.upper : cell.lower;
  if (!first_possible(model, slack, low, high)) return false;
  const float guess = likely_crossing(model, low, high);
  return first_crossing<kernel, SurfaceBranch::main, equal_radii>(s, cell, origin, direction, sign, model, slack, low,
                                                                  high, guess, starts_on_surface, nullptr, t);
}

/// The same for the recovered particles' field, which has no model. `at_low`: the field at `low`, or null.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool recovered_crossing(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                        const Vec3& direction, float sign, float low, float high,
                                        bool starts_on_surface, const FieldOnLine* at_low, float& t) {
  const RecoveredSpan span = recovered_span<kernel, equal_radii>(s, cell, origin, direction);
  float guess = span.ball_exit > low ? min_of(span.ball_exit, high) : low;
  if (sign > 0.0f) {
    if (span.most < 0.9999f) return false;
    low = max_of(low, span.begin);
    high = min_of(high, span.end);
    if (low > high) return false;
    guess = clamp(span.ball_entry < infinity ? span.ball_entry : span.densest, low, high);
  }
  const Parabola none{0.0f, 0.0f, 0.0f};
  return first_crossing<kernel, SurfaceBranch::recovered, equal_radii>(s, cell, origin, direction, sign, none, 1.0f,
                                                                       low, high, guess, starts_on_surface, at_low, t);
}

/// First crossing of the union's surface within [low, high] of one near cell; `model` is that of model_along.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool cell_crossing(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                   const Vec3& direction, bool inside, const Parabola& model, float low, float high,
                                   const RayStart& start, CellCrossing& hit) {
  // On the sheet that the ray is known to keep clear of, it starts inside or outside, not on the surface.
  const bool main_start = start.on_surface && start.clear_main == 0.0f;
  const bool recovered_start = start.on_surface && start.clear_recovered == 0.0f;
  const bool has_main = cell.list_blocks > 0;
  const bool has_recovered = cell.recovered_blocks > 0;
  if (!inside) {
    bool found = false;
    if (has_main && main_crossing<kernel, equal_radii>(s, cell, origin, direction, 1.0f, model,
                                                       max_of(low, start.clear_main), high, main_start, hit.t)) {
      hit.branch = SurfaceBranch::main;
      found = true;
      high = hit.t;
    }
    float t;
    if (has_recovered &&
        recovered_crossing<kernel, equal_radii>(s, cell, origin, direction, 1.0f, max_of(low, start.clear_recovered),
                                                high, recovered_start, nullptr, t)) {
      hit = {t, SurfaceBranch::recovered};
      found = true;
    }
    return found;
  }
  // Inside: the ray leaves where both fields are under their thresholds. Follow one, then the other; where a field is
  // under its threshold already, its crossing is found at once.
  hit = {low, SurfaceBranch::main};
  for (int i = 0; i < 16; ++i) {
    float t = low;
    if (has_main) {
      if (!main_crossing<kernel, equal_radii>(s, cell, origin, direction, -1.0f, model, max_of(low, start.clear_main),
                                              high, main_start && i == 0, t)) {
        return false;
      }
      if (i > 0 && t <= low + crossing_tolerance) return true;
      hit = {t, SurfaceBranch::main};
      low = t;
    }
    if (!has_recovered) return true;
    low = max_of(low, start.clear_recovered);
    if (low > high) return false;
    const bool may_start = recovered_start && i == 0;
    FieldOnLine r;
    const FieldOnLine* at_low = nullptr;
    bool starts = false;
    // Without the main field the ray is known to be inside the recovered one, unless it starts on its surface.
    if (has_main || i > 0 || may_start) {
      const Vec3 y = origin + direction * low;
      if (!may_start && field_value<kernel, SurfaceBranch::recovered, equal_radii>(s, cell, y) <= 0.0f) return true;
      r = field_on_line<kernel, SurfaceBranch::recovered, equal_radii, BoundsFor::line>(s, cell, y, direction, 0.0f,
                                                                                        0.0f);
      starts = fabsf(r.value) < rounding_on_surface && r.slope > 0.0f;
      if (r.value <= 0.0f && !(may_start && starts)) return true;
      at_low = &r;
    }
    if (!recovered_crossing<kernel, equal_radii>(s, cell, origin, direction, -1.0f, low, high, starts, at_low, t)) {
      return false;
    }
    hit = {t, SurfaceBranch::recovered};
    low = t;
    if (!has_main) return true;
  }
  return true;
}

/// Brings a crossing to its exact place and fills in its normals, side and what is known of the field there.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN void fill_hit(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                              const Vec3& direction, CellCrossing& crossing, bool inside, SurfaceHit& hit) {
  const bool main = crossing.branch == SurfaceBranch::main;
  // Far enough to be of use, near enough for the bounds to be tight; with mixed radii there is no one such distance.
  const float reach =
      equal_radii ? clearance_reach / (main ? s.inverse_influence : s.recovered_inverse_influence) : 0.0f;
  FieldNormals n;
  for (int i = 0; i < 4; ++i) {
    const Vec3 y = origin + direction * crossing.t;
    n = main ? field_normals<kernel, SurfaceBranch::main, equal_radii>(s, cell, y, reach)
             : field_normals<kernel, SurfaceBranch::recovered, equal_radii>(s, cell, y, reach);
    // A last step of Newton's; the normals of where it starts do if it is short.
    const float slope = -dot(n.gradient, direction);
    const float step = (inside ? slope < 0.0f : slope > 0.0f) ? -n.value / slope : 0.0f;
    const float longest = min_of(0.1f, 0.5f / max_of(fabsf(slope), 1e-6f));
    crossing.t = max_of(crossing.t + clamp(step, -longest, longest), 0.0f);
    if (fabsf(step) <= crossing_tolerance) break;
  }
  const float gradient = length(n.gradient);
  const float weighted = length(n.weighted);
  const Vec3 against = inside ? direction : -direction;
  hit.geometric_normal = gradient > 1e-12f ? n.gradient * (1.0f / gradient) : against;
  hit.shading_normal =
      s.normal == NormalMode::weighted && weighted > 1e-12f ? n.weighted * (1.0f / weighted) : hit.geometric_normal;
  hit.entering = !inside;
  const float per_metre = 1.0f / s.cell_size;
  hit.sheet = main ? 0 : 1;
  hit.gradient = gradient * per_metre;
  hit.rise = n.rise * per_metre * per_metre;
  hit.fall = n.fall * per_metre * per_metre;
  hit.reach = reach * s.cell_size;
}

/// t at which the ray leaves the box [low, high] and through which axis.
EMBRUN_FN float box_exit(const GridRay& ray, Vec3 low, Vec3 high, int& axis) {
  const float tx = ((ray.direction.x >= 0.0f ? high.x : low.x) - ray.origin.x) * ray.inverse_direction.x;
  const float ty = ((ray.direction.y >= 0.0f ? high.y : low.y) - ray.origin.y) * ray.inverse_direction.y;
  const float tz = ((ray.direction.z >= 0.0f ? high.z : low.z) - ray.origin.z) * ray.inverse_direction.z;
  axis = tx < ty ? (tx < tz ? 0 : 2) : (ty < tz ? 1 : 2);
  return axis == 0 ? tx : axis == 1 ? ty : tz;
}

/// The part [low, high] of a ray inside one cell that is near and not split; `origin` is relative to its centre.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool leaf_hit(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                              const Vec3& direction, bool inside, const Parabola& model, float low, float high,
                              const RayStart& start, float& t, SurfaceHit& hit) {
  CellCrossing crossing;
  if (!cell_crossing<kernel, equal_radii>(s, cell, origin, direction, inside, model, low, high, start, crossing)) {
    return false;
  }
  fill_hit<kernel, equal_radii>(s, cell, origin, direction, crossing, inside, hit);
  t = crossing.t;
  return true;
}

/// The same for a split cell, whose children are walked front to back. `center`: of the top cell.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool split_hit(const ImplicitSurfaceView& s, const SurfaceCell& top, const Vec3& center,
                               const GridRay& ray, bool inside, float low, float high, RayStart start, float& t,
                               SurfaceHit& hit) {
  for (int guard = 0; guard < 4096; ++guard) {
    // Descend to the leaf that holds the ray at `low`, from the top each time.
    const SurfaceCell* cell = &top;
    Vec3 middle = center;
    float half = 0.5f;
    const Vec3 p = ray.origin + ray.direction * low;
    while (cell->kind == SurfaceCellKind::split) {
      half *= 0.5f;
      const bool x = p.x > middle.x || (p.x == middle.x && ray.direction.x > 0.0f);
      const bool y = p.y > middle.y || (p.y == middle.y && ray.direction.y > 0.0f);
      const bool z = p.z > middle.z || (p.z == middle.z && ray.direction.z > 0.0f);
      middle += Vec3{x ? half : -half, y ? half : -half, z ? half : -half};
      cell = s.cell + cell->list + (x ? 1 : 0) + (y ? 2 : 0) + (z ? 4 : 0);
    }
    int axis;
    const Vec3 h{half, half, half};
    const float end = min_of(high, max_of(box_exit(ray, middle - h, middle + h, axis), low));
    if (cell->kind == SurfaceCellKind::near) {
      const Vec3 origin = ray.origin - middle;
      const Parabola model = model_along(*cell, origin, ray.direction, inside ? -1.0f : 1.0f);
      if (leaf_hit<kernel, equal_radii>(s, *cell, origin, ray.direction, inside, model, low, end, start, t, hit)) {
        return true;
      }
      start.on_surface = false;
    }
    low = end + 1e-6f + 1e-6f * half;
    if (end >= high || low >= high) return false;
  }
  return false;
}

/// The part [low, high] of a ray inside one near top cell.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool near_cell_hit(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& center,
                                   const GridRay& ray, bool inside, float low, float high, const RayStart& start,
                                   float& t, SurfaceHit& hit) {
  if (cell.kind == SurfaceCellKind::split) {
    return split_hit<kernel, equal_radii>(s, cell, center, ray, inside, low, high, start, t, hit);
  }
  const Vec3 origin = ray.origin - center;
  const Parabola model = model_along(cell, origin, ray.direction, inside ? -1.0f : 1.0f);
  return leaf_hit<kernel, equal_radii>(s, cell, origin, ray.direction, inside, model, low, high, start, t, hit);
}

/// The word of a top-level cell.
EMBRUN_FN const std::uint32_t* surface_word(const ImplicitSurfaceView& s, int x, int y, int z) {
  const std::size_t tile =
      (static_cast<std::size_t>(z >> 2) * static_cast<std::size_t>(s.tiles[1]) + static_cast<std::size_t>(y >> 2)) *
          static_cast<std::size_t>(s.tiles[0]) +
      static_cast<std::size_t>(x >> 2);
  return s.words + tile * 64 + static_cast<std::size_t>((z & 3) * 16 + (y & 3) * 4 + (x & 3));
}

EMBRUN_FN const SurfaceCell* surface_record(const ImplicitSurfaceView& s, std::uint32_t word) {
  return s.cell + (word & ~cell_word::near);
}

EMBRUN_FN void prefetch(const void* address) {
#if !defined(__CUDACC__)
  __builtin_prefetch(address);
#else
  (void)address;
#endif
}

/// Whether a point (grid units) is in the body.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool contains_grid_point(const ImplicitSurfaceView& s, const Vec3& p) {
  int c[3];
  for (int a = 0; a < 3; ++a) {
    if (!(p[a] >= 0.0f && p[a] < static_cast<float>(s.cells[a]))) return false;
    c[a] = min_of(static_cast<int>(p[a]), s.cells[a] - 1);
  }
  const std::uint32_t word = *surface_word(s, c[0], c[1], c[2]);
  if ((word & cell_word::near) == 0) return (word & cell_word::inside) != 0;
  const SurfaceCell* cell = surface_record(s, word);
  Vec3 center{static_cast<float>(c[0]) + 0.5f, static_cast<float>(c[1]) + 0.5f, static_cast<float>(c[2]) + 0.5f};
  float half = 0.5f;
  while (cell->kind == SurfaceCellKind::split) {
    half *= 0.5f;
    const bool x = p.x >= center.x, y = p.y >= center.y, z = p.z >= center.z;
    center += Vec3{x ? half : -half, y ? half : -half, z ? half : -half};
    cell = s.cell + cell->list + (x ? 1 : 0) + (y ? 2 : 0) + (z ? 4 : 0);
  }
  if (cell->kind != SurfaceCellKind::near) return cell->kind == SurfaceCellKind::inside;
  const Vec3 y = p - center;
  if (cell->list_blocks > 0 && field_value<kernel, SurfaceBranch::main, equal_radii>(s, *cell, y) > 0.0f) return true;
  return cell->recovered_blocks > 0 && field_value<kernel, SurfaceBranch::recovered, equal_radii>(s, *cell, y) > 0.0f;
}

/// Where a ray starts to walk the grid at t = low: its cell, whose word is returned, and its side there. `start` is what
/// is known of the ray's start already.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN std::uint32_t start_walk(const ImplicitSurfaceView& s, const GridRay& ray, float low, Side side,
                                         int cell[3], bool& inside, RayStart& start) {
  const Vec3 first = ray.origin + ray.direction * low;
  for (int a = 0; a < 3; ++a) cell[a] = min_of(max_of(static_cast<int>(floorf(first[a])), 0), s.cells[a] - 1);
  const std::uint32_t word = *surface_word(s, cell[0], cell[1], cell[2]);
  start.on_surface = side != Side::unknown;
  inside = side == Side::inside;
  if ((word & cell_word::near) == 0) {
    inside = (word & cell_word::inside) != 0;
  } else if (side == Side::unknown) {
    inside = contains_grid_point<kernel, equal_radii>(s, first);
  }
  return word;
}

/// Walks the top grid from t = low to high (grid units from ray.origin).
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool walk_grid(const ImplicitSurfaceView& s, const GridRay& ray, float low, float high, Side side,
                               RayStart start, float& t, SurfaceHit& hit) {
  int c[3];
  bool inside;
  std::uint32_t word = start_walk<kernel, equal_radii>(s, ray, low, side, c, inside, start);

  const int sx = ray.direction.x >= 0.0f, sy = ray.direction.y >= 0.0f, sz = ray.direction.z >= 0.0f;
  const int octant = sx + 2 * sy + 4 * sz;
  for (;;) {
    const bool near = (word & cell_word::near) != 0;
    const int reach = near ? 1 : cell_word::skip(word, octant);
    // The forward cube of `reach` cells, and where the ray leaves it.
    const int lx = sx ? c[0] : c[0] + 1 - reach, ly = sy ? c[1] : c[1] + 1 - reach, lz = sz ? c[2] : c[2] + 1 - reach;
    const Vec3 corner{static_cast<float>(lx), static_cast<float>(ly), static_cast<float>(lz)};
    const float size = static_cast<float>(reach);
    int axis;
    const float end = max_of(box_exit(ray, corner, corner + Vec3{size, size, size}, axis), low);
    // The next cell: exactly one on along the axis of exit; on the others where the ray is, within the cube.
    const Vec3 p = ray.origin + ray.direction * end;
    c[0] = axis == 0 ? (sx ? lx + reach : lx - 1) : min_of(max_of(static_cast<int>(floorf(p.x)), lx), lx + reach - 1);
    c[1] = axis == 1 ? (sy ? ly + reach : ly - 1) : min_of(max_of(static_cast<int>(floorf(p.y)), ly), ly + reach - 1);
    c[2] = axis == 2 ? (sz ? lz + reach : lz - 1) : min_of(max_of(static_cast<int>(floorf(p.z)), lz), lz + reach - 1);
    const bool leaves = end >= high || static_cast<unsigned>(c[0]) >= static_cast<unsigned>(s.cells[0]) ||
                        static_cast<unsigned>(c[1]) >= static_cast<unsigned>(s.cells[1]) ||
                        static_cast<unsigned>(c[2]) >= static_cast<unsigned>(s.cells[2]);
    // Its word and record are on their way while this cell is looked into: the walk waits for memory most of all.
    std::uint32_t next = 0;
    if (!leaves) {
      next = *surface_word(s, c[0], c[1], c[2]);
      if ((next & cell_word::near) != 0) prefetch(surface_record(s, next));
    }
    if (near && near_cell_hit<kernel, equal_radii>(s, *surface_record(s, word), corner + Vec3{0.5f, 0.5f, 0.5f}, ray,
                                                   inside, low, min_of(end, high), start, t, hit)) {
      return true;
    }
    if (leaves) return false;
    start.on_surface = start.on_surface && !near;
    low = end;
    word = next;
  }
}

/// Brings the ray to grid units with its origin moved to where it enters the grid: t_world = (t + moved) * cell_size.
EMBRUN_FN bool to_grid(const ImplicitSurfaceView& s, const Ray& ray, GridRay& local, double& moved, float& low,
                       float& high) {
  const double scale = s.cells_per_metre;
  double enter = static_cast<double>(ray.t_min) * scale;
  double leave = static_cast<double>(ray.t_max) * scale;
  double o[3];
  for (int a = 0; a < 3; ++a) {
    o[a] = (static_cast<double>(ray.origin[a]) - s.origin[a]) * scale;
    const float d = ray.direction[a];
    const double top = static_cast<double>(s.cells[a]);
    if (fabsf(d) <= 1e-30f) {
      if (o[a] < 0.0 || o[a] > top) return false;
      // Such a component never leaves through its faces; 1e30 keeps 0 * it from being NaN.
      local.inverse_direction[a] = 1e30f;
      continue;
    }
    const double inverse = 1.0 / static_cast<double>(d);
    const double t0 = -o[a] * inverse, t1 = (top - o[a]) * inverse;
    enter = max_of(enter, min_of(t0, t1));
    leave = min_of(leave, max_of(t0, t1));
    local.inverse_direction[a] = static_cast<float>(inverse);
  }
  if (!(enter <= leave)) return false;
  moved = enter;
  low = 0.0f;
  high = static_cast<float>(leave - enter);
  for (int a = 0; a < 3; ++a) {
    local.origin[a] = static_cast<float>(o[a] + enter * static_cast<double>(ray.direction[a]));
    local.direction[a] = ray.direction[a];
  }
  return true;
}

/// What is known of the start of a ray that was brought to the grid; returns the side it starts on.
EMBRUN_FN Side known_start(const ImplicitSurfaceView& s, const Ray& ray, Side side, double moved, RayStart& known) {
  // A ray that was brought to the grid starts outside, whatever was said of its origin.
  if (side == Side::unknown || moved > static_cast<double>(ray.t_min) * s.cells_per_metre) return Side::unknown;
  // A clearance that is hardly more than the rounding of the origin is as good as none.
  const float clear = ray.clearance.distance / s.cell_size - static_cast<float>(moved);
  if (clear > least_clearance) (ray.clearance.sheet == 0 ? known.clear_main : known.clear_recovered) = clear;
  return side;
}

/// Gives a hit at t of a ray in grid units its place in the scene.
EMBRUN_FN void place_hit(const ImplicitSurfaceView& s, const GridRay& ray, double moved, float t, SurfaceHit& hit) {
  hit.t = static_cast<float>((moved + static_cast<double>(t)) * static_cast<double>(s.cell_size));
  for (int a = 0; a < 3; ++a) {
    hit.position[a] =
        static_cast<float>(s.origin[a] + static_cast<double>(s.cell_size) *
                                             (static_cast<double>(ray.origin[a]) +
                                              static_cast<double>(ray.direction[a]) * static_cast<double>(t)));
  }
}

template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool intersect_surface_as(const ImplicitSurfaceView& s, const Ray& ray, Side side, SurfaceHit& hit) {
  GridRay local;
  double moved;
  float low, high;
  if (!to_grid(s, ray, local, moved, low, high)) return false;
  RayStart known;
  const Side start = known_start(s, ray, side, moved, known);
  float t;
  if (!walk_grid<kernel, equal_radii>(s, local, low, high, start, known, t, hit)) return false;
  place_hit(s, local, moved, t, hit);
  return true;
}

/// First crossing of the surface with t in (ray.t_min, ray.t_max). `side` is where the ray starts: for a ray that
/// leaves the surface what its BSDF chose, so that a rounded origin does not decide; unknown asks the field.
/// `ray.clearance` must be of this surface (see clearance_after), or 0.
/// False when there is none; `hit` is then left alone.
EMBRUN_LOCAL_FN bool intersect_implicit_surface(const ImplicitSurfaceView& s, const Ray& ray, Side side,
                                                SurfaceHit& hit) {
  if (s.equal_radii) {
    switch (s.kernel) {
      case Kernel::metaball: return intersect_surface_as<Kernel::metaball, true>(s, ray, side, hit);
      case Kernel::zhu_bridson: return intersect_surface_as<Kernel::zhu_bridson, true>(s, ray, side, hit);
      case Kernel::blinn: return intersect_surface_as<Kernel::blinn, true>(s, ray, side, hit);
    }
  } else {
    switch (s.kernel) {
      case Kernel::metaball: return intersect_surface_as<Kernel::metaball, false>(s, ray, side, hit);
      case Kernel::zhu_bridson: return intersect_surface_as<Kernel::zhu_bridson, false>(s, ray, side, hit);
      case Kernel::blinn: return intersect_surface_as<Kernel::blinn, false>(s, ray, side, hit);
    }
  }
  return false;
}

/// Whether a point (scene coordinates) is inside the body.
EMBRUN_LOCAL_FN bool implicit_surface_contains(const ImplicitSurfaceView& s, const Vec3& point) {
  Vec3 p;
  for (int a = 0; a < 3; ++a) {
    p[a] = static_cast<float>((static_cast<double>(point[a]) - s.origin[a]) / static_cast<double>(s.cell_size));
  }
  if (s.equal_radii) {
    switch (s.kernel) {
      case Kernel::metaball: return contains_grid_point<Kernel::metaball, true>(s, p);
      case Kernel::zhu_bridson: return contains_grid_point<Kernel::zhu_bridson, true>(s, p);
      case Kernel::blinn: return contains_grid_point<Kernel::blinn, true>(s, p);
    }
  } else {
    switch (s.kernel) {
      case Kernel::metaball: return contains_grid_point<Kernel::metaball, false>(s, p);
      case Kernel::zhu_bridson: return contains_grid_point<Kernel::zhu_bridson, false>(s, p);
      case Kernel::blinn: return contains_grid_point<Kernel::blinn, false>(s, p);
    }
  }
  return false;
}

}  // namespace embrun
