#pragma once

#include "geometry/implicit_surface_line.h"
#include "geometry/surface_hit.h"
#include "math/vec.h"

namespace embrun {

// A ray in one cell near the surface: the first crossing of the union of the main and the recovered field, and the hit
// there. Lengths are grid units.

/// A ray in grid units, and the part of it that lies in one cell.
struct GridRay {
  Vec3 origin;
  Vec3 direction;
  Vec3 inverse_direction;
};

/// How far from a hit, in influence radii, the bounds on the field's curvature are asked for.
inline constexpr float clearance_reach = 0.3f;
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
  int sheet = -1;           ///< of which field, as SurfaceHit has it; -1: not known
  float clear_main = 0.0f;  ///< no crossing of the main field's surface before this t
  float clear_recovered = 0.0f;

  /// What is known comes from the particles that are felt in the cell where the ray starts, which ends at t.
  EMBRUN_FN void end_at(float t) {
    clear_main = min_of(clear_main, t);
    clear_recovered = min_of(clear_recovered, t);
  }
};

/// A ray that starts this close to a face of its cell may have left the surface in the next one, by rounding.
EMBRUN_FN void forget_beside_face(float from_low_face, float side, RayStart& start) {
  const float margin = 1e-3f * side;
  if (from_low_face < margin || from_low_face > side - margin) start.end_at(0.0f);
}

/// A crossing inside one cell.
struct CellCrossing {
  float t;
  SurfaceBranch branch;
  bool placed = false;   ///< t is exact, and the rest is known
  float curve = 0.0f;    ///< what F'' is thought to be
  FieldNormals normals;  ///< there
  float reach;           ///< grid units within which the normals' rise and fall hold
};

/// How far from a point of a surface the bounds on the field's curvature are asked for: far enough to be of use, near
/// enough for them to be tight; with mixed radii there is no one such distance.
template <SurfaceBranch branch, bool equal_radii>
EMBRUN_FN float bounded_reach(const ImplicitSurfaceView& s) {
  return equal_radii ? clearance_reach / equal_inverse_influence<branch>(s) : 0.0f;
}

/// Brings a crossing of one field near `c.t` to its exact place. With `bounds_known` the normals' rise and fall are left.
template <Kernel kernel, SurfaceBranch branch, bool equal_radii, bool bounds_known>
EMBRUN_LOCAL_FN void place_crossing(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                    const Vec3& direction, bool inside, CellCrossing& c) {
  const float rise = c.normals.rise, fall = c.normals.fall;
  if constexpr (!bounds_known) c.reach = bounded_reach<branch, equal_radii>(s);
  for (int i = 0; i < 10; ++i) {
    c.normals = field_normals<kernel, branch, equal_radii, !bounds_known>(s, cell, origin + direction * c.t, c.reach);
    // A last step of Newton's; the normals of where it starts do if it is short.
    const float slope = -dot(c.normals.gradient, direction);
    const float step = (inside ? slope < 0.0f : slope > 0.0f)
                           ? step_to_zero(c.normals.value, slope, inside ? -c.curve : c.curve)
                           : 0.0f;
    const float longest = min_of(0.1f, 0.5f / max_of(fabsf(slope), 1e-6f));
    c.t = max_of(c.t + clamp(step, -longest, longest), 0.0f);
    if (fabsf(step) <= crossing_tolerance) break;
  }
  if constexpr (bounds_known) {
    c.normals.rise = rise;
    c.normals.fall = fall;
  }
  c.placed = true;
}

/// Brings a crossing to its exact place on the field that it is of, unless that was done.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN void place_crossing_once(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                         const Vec3& direction, bool inside, CellCrossing& c) {
  if (c.placed) return;
  if (c.branch == SurfaceBranch::main)
    place_crossing<kernel, SurfaceBranch::main, equal_radii, false>(s, cell, origin, direction, inside, c);
  else
    place_crossing<kernel, SurfaceBranch::recovered, equal_radii, false>(s, cell, origin, direction, inside, c);
}

/// What one evaluation tells of the part of a ray in a cell.
enum class Settled {
  no_crossing,
  crossing,
  open,         ///< it did not tell
  out_of_reach  ///< nothing was evaluated: it could not have told
};
EMBRUN_FN bool is_settled(Settled s) { return s == Settled::no_crossing || s == Settled::crossing; }

/// Settles by one evaluation at `guess` whether and where F = sign * g crosses 0 first in [low, high], if it can, and
/// places the crossing. The bounds hold in all directions: looser and cheaper than those of first_crossing, they are nearly
/// always enough, since a model says where the crossing is. If it cannot, moves `low` to where F is known to
/// be below 0 up to, and `guess` to where to look next, or beyond `high`: wherever the model says. Where `low` is farther
/// back than the bounds reach, nothing is evaluated or moved. `curve`: what F'' is thought to be.
template <Kernel kernel, SurfaceBranch branch, bool equal_radii>
EMBRUN_LOCAL_FN Settled settle_at_guess(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                        const Vec3& direction, float sign, float curve, float& low, float high,
                                        float& guess, CellCrossing& crossing) {
  const float reach = bounded_reach<branch, equal_radii>(s);
  const float behind = guess - low, ahead = high - guess, at = guess;
  if (behind > reach) return Settled::out_of_reach;
  crossing.branch = branch;
  crossing.placed = false;
  crossing.curve = curve;
  const FieldOnLine g =
      field_around<kernel, branch, equal_radii>(s, cell, origin + direction * guess, direction, reach);
  const float value = sign * g.value, slope = sign * g.slope;
  const float up = max_of(sign > 0.0f ? g.up : g.down, 1e-12f);
  const float down = max_of(sign > 0.0f ? g.down : g.up, 1e-12f);
  guess = low;
  float first, last;  // the crossing is between these distances from the guess
  if (value < 0.0f) {
    // F(guess + x) < value + slope x + up x^2 / 2, which is below 0 from one root to the other.
    const float root = sqrtf(slope * slope - 2.0f * up * value);
    if ((slope > 0.0f ? (slope + root) / up : -2.0f * value / (root - slope)) < behind) return Settled::open;
    first = min_of(slope > 0.0f ? -2.0f * value / (slope + root) : (root - slope) / up, reach);
    if (first > ahead) return Settled::no_crossing;
    low = max_of(low, at + first);
    guess = infinity;
    // F is above value + slope x - down x^2 / 2, and rises up to where that is highest: it crosses once before.
    const float disc = slope * slope + 2.0f * down * value;
    if (slope <= 0.0f || disc < 0.0f) return Settled::open;
    last = -2.0f * value / (slope + sqrtf(disc));
    if (last > min_of(ahead, reach)) return Settled::open;
  } else {
    const float disc = slope * slope - 2.0f * up * value;
    if (slope > 0.0f) guess = max_of(low, at - value / slope);
    if (slope <= 0.0f || disc < 0.0f) return Settled::open;
    const float root = sqrtf(disc);
    first = -2.0f * value / (slope + root);
    if (-first > behind || -first > slope / down || (slope + root) / up < behind) return Settled::open;
    last = -2.0f * value / (slope + sqrtf(slope * slope + 2.0f * down * value));
  }
  const float step = clamp(step_to_zero(value, slope, curve), first, last);
  crossing.t = at + step;
  crossing.reach = reach - fabsf(step);
  crossing.normals.rise = g.up;
  crossing.normals.fall = g.down;
  place_crossing<kernel, branch, equal_radii, true>(s, cell, origin, direction, sign < 0.0f, crossing);
  return Settled::crossing;
}

/// First crossing of the main field's side change within [low, high]; `origin` is relative to the cell's centre
/// and t = 0 there; `model` is that of model_along.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool main_crossing(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                   const Vec3& direction, float sign, const Parabola& model, float low, float high,
                                   bool starts_on_surface, CellCrossing& crossing) {
  constexpr SurfaceBranch branch = SurfaceBranch::main;
  const float slack = sign > 0.0f ? cell.slack.upper() : cell.slack.lower();
  if (!first_possible(model, slack, low, high)) return false;
  float guess = likely_crossing(model, low, high);
  // A ray that has just left the surface runs along it: bounds for its direction alone take it farther.
  if (equal_radii && !starts_on_surface && guess > low) {
    const Settled settled = settle_at_guess<kernel, branch, equal_radii>(s, cell, origin, direction, sign,
                                                                         2.0f * model.p2, low, high, guess, crossing);
    if (is_settled(settled)) return settled == Settled::crossing;
    if (settled == Settled::open && !first_possible(model, slack, low, high)) return false;
    if (!(guess >= low && guess <= high)) guess = likely_crossing(model, low, high);
  }
  crossing.branch = branch;
  crossing.placed = false;
  crossing.curve = 2.0f * model.p2;
  return first_crossing<kernel, branch, equal_radii>(s, cell, origin, direction, sign, model, slack, low, high, guess,
                                                     starts_on_surface, nullptr, crossing.t);
}

/// The same for the recovered particles' field, which has no model. `at_low`: the field at `low`, or null.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool recovered_crossing(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                        const Vec3& direction, float sign, float low, float high,
                                        bool starts_on_surface, const FieldOnLine* at_low, CellCrossing& crossing) {
  constexpr SurfaceBranch branch = SurfaceBranch::recovered;
  if (sign > 0.0f && most_recovered<kernel, equal_radii>(s, cell, origin, direction, low, high) < 0.9999f) return false;
  const RecoveredSpan span = recovered_span<kernel, equal_radii>(s, cell, origin, direction);
  float guess = span.ball_exit > low ? min_of(span.ball_exit, high) : low;
  if (sign > 0.0f) {
    low = max_of(low, span.begin);
    high = min_of(high, span.end);
    if (low > high) return false;
    guess = clamp(span.ball_entry < infinity ? span.ball_entry : span.densest, low, high);
  }
  const float from = low;
  if (equal_radii && !starts_on_surface) {
    const Settled settled = settle_at_guess<kernel, branch, equal_radii>(s, cell, origin, direction, sign, 0.0f, low,
                                                                         high, guess, crossing);
    if (is_settled(settled)) return settled == Settled::crossing;
    if (!(guess >= low && guess <= high)) guess = low;
    if (low > from) at_low = nullptr;
  }
  crossing.branch = branch;
  crossing.placed = false;
  crossing.curve = 0.0f;
  const Parabola none{0.0f, 0.0f, 0.0f};
  return first_crossing<kernel, branch, equal_radii>(s, cell, origin, direction, sign, none, 1.0f, low, high, guess,
                                                     starts_on_surface, at_low, crossing.t);
}

/// Where the recovered field is farther from 0 than this at a crossing of the main one that is not exact yet, it is so at
/// the exact place too.
inline constexpr float close_to_surface = 0.3f;

/// First crossing of the union's surface within [low, high] of one near cell; `model` is that of model_along.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN bool cell_crossing(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                                   const Vec3& direction, bool inside, const Parabola& model, float low, float high,
                                   const RayStart& start, CellCrossing& hit) {
  // On the sheet that the ray is known to keep clear of, it starts inside or outside, not on the surface; and inside,
  // where the other sheet has to be left as well, that one is where its field says.
  const bool main_start = start.on_surface && start.clear_main == 0.0f && !(inside && start.sheet == 1);
  const bool recovered_start = start.on_surface && start.clear_recovered == 0.0f && !(inside && start.sheet == 0);
  const bool has_main = cell.list_bits != 0;
  const bool has_recovered = cell.recovered_eights > 0;
  // first_crossing may leave the last steps to fill_hit, but where the two fields cross close to each other their order
  // is told by the exact places alone.
  const auto place = [&](CellCrossing& c, float least, float most) {
    if (c.placed) return;
    place_crossing_once<kernel, equal_radii>(s, cell, origin, direction, inside, c);
    c.t = clamp(c.t, least, most);
  };
  CellCrossing other;
  if (!inside) {
    bool found = false;
    if (has_main && main_crossing<kernel, equal_radii>(s, cell, origin, direction, 1.0f, model,
                                                       max_of(low, start.clear_main), high, main_start, hit)) {
      found = true;
      if (has_recovered) place(hit, low, high);
      high = hit.t;
    }
    low = max_of(low, start.clear_recovered);
    if (has_recovered && (has_main || first_possible(model, cell.slack.upper(), low, high)) &&
        recovered_crossing<kernel, equal_radii>(s, cell, origin, direction, 1.0f, low, high, recovered_start, nullptr,
                                                other)) {
      hit = other;
      found = true;
    }
    return found;
  }
  // Inside: the ray leaves where both fields are under their thresholds. Follow one, then the other; where a field is
  // under its threshold already, its crossing is found at once.
  const float begin = low;
  hit = {low, SurfaceBranch::main, false, 0.0f, {}, 0.0f};
  for (int i = 0; i < 16; ++i) {
    if (has_main) {
      const float from = max_of(low, start.clear_main);
      if (!main_crossing<kernel, equal_radii>(s, cell, origin, direction, -1.0f, model, from, high,
                                              main_start && i == 0, other)) {
        return false;
      }
      // Where it is under its threshold from the start on, its end is behind and of no use.
      const bool ends_here = other.t > from;
      if (i > 0 && other.t <= low + crossing_tolerance) {
        // Both end here; the later one by their exact places is the surface.
        if (ends_here) place(other, -infinity, infinity);
        if (other.t > low && other.t <= min_of(low + 2.0f * crossing_tolerance, high)) hit = other;
        return true;
      }
      if (has_recovered && !other.placed && ends_here &&
          fabsf(field_value<kernel, SurfaceBranch::recovered, equal_radii>(s, cell, origin + direction * other.t)) <
              close_to_surface) {
        place(other, low, high);
      }
      hit = other;
      low = hit.t;
    }
    if (!has_recovered) return true;
    if (start.clear_recovered > low) {
      low = start.clear_recovered;
      hit = {low, SurfaceBranch::recovered, false, 0.0f, {}, 0.0f};
    }
    if (low > high) return false;
    const bool at_begin = i == 0 && low <= begin + crossing_tolerance;
    const bool may_start = recovered_start && at_begin;
    FieldOnLine r;
    const FieldOnLine* at_low = nullptr;
    bool starts = false;
    // Without the main field the ray is known to be inside the recovered one, unless it starts on its surface.
    if (has_main || i > 0 || may_start) {
      const Vec3 y = origin + direction * low;
      float value = may_start ? 0.0f : field_value<kernel, SurfaceBranch::recovered, equal_radii>(s, cell, y);
      if (may_start || value > 0.0f) {
        r = field_on_line<kernel, SurfaceBranch::recovered, equal_radii, BoundsFor::line>(s, cell, y, direction, 0.0f,
                                                                                          0.0f);
        value = r.value;
        starts = fabsf(value) < rounding_on_surface && r.slope > 0.0f;
      }
      if (value <= 0.0f && !(may_start && starts)) {
        // Rounding put the ray across before it began: through the surface that is the nearer one.
        if (at_begin && !(has_main && field_value<kernel, SurfaceBranch::main, equal_radii>(s, cell, y) >= value))
          hit = {low, SurfaceBranch::recovered, false, 0.0f, {}, 0.0f};
        return true;
      }
      at_low = &r;
    }
    if (!recovered_crossing<kernel, equal_radii>(s, cell, origin, direction, -1.0f, low, high, starts, at_low, other)) {
      return false;
    }
    if (has_main) place(other, low, high);
    hit = other;
    low = hit.t;
    if (!has_main) return true;
  }
  return true;
}

/// Brings a crossing to its exact place and fills in its normals, side and what is known of the field there.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN void fill_hit(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& origin,
                              const Vec3& direction, CellCrossing& crossing, bool inside, SurfaceHit& hit) {
  place_crossing_once<kernel, equal_radii>(s, cell, origin, direction, inside, crossing);
  const FieldNormals& n = crossing.normals;
  const float gradient = length(n.gradient);
  const float weighted = length(n.weighted);
  const Vec3 against = inside ? direction : -direction;
  hit.geometric_normal = gradient > 1e-12f ? n.gradient * (1.0f / gradient) : against;
  hit.shading_normal =
      s.normal == NormalMode::weighted && weighted > 1e-12f ? n.weighted * (1.0f / weighted) : hit.geometric_normal;
  hit.entering = !inside;
  const float per_metre = 1.0f / s.cell_size;
  hit.sheet = crossing.branch == SurfaceBranch::main ? 0 : 1;
  hit.gradient = gradient * per_metre;
  hit.rise = n.rise * per_metre * per_metre;
  hit.fall = n.fall * per_metre * per_metre;
  hit.reach = crossing.reach * s.cell_size;
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
    if (guard == 0) {
      for (int a = 0; a < 3; ++a) forget_beside_face(p[a] - middle[a] + half, 2.0f * half, start);
    }
    if (cell->kind == SurfaceCellKind::near) {
      const Vec3 origin = ray.origin - middle;
      const Parabola model = model_along(*cell, origin, ray.direction, inside ? -1.0f : 1.0f);
      if (leaf_hit<kernel, equal_radii>(s, *cell, origin, ray.direction, inside, model, low, end, start, t, hit)) {
        return true;
      }
      start.on_surface = false;
    }
    start.end_at(end);
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

}  // namespace embrun
