#pragma once

#include "base/prefetch.h"
#include "geometry/implicit_surface_cell.h"
#include "math/ray.h"

namespace embrun {

// Ray against the implicit surface. All lengths are grid units until the very end. The ray walks the top grid by cubes
// that hold no near cell, and looks into the near cells on its way.

/// The least clearance, in grid units, that stands for more than the rounding of a ray's origin.
inline constexpr float least_clearance = 0.012f;
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
  if (cell->list_bits != 0 && field_value<kernel, SurfaceBranch::main, equal_radii>(s, *cell, y) > 0.0f) return true;
  return cell->recovered_eights > 0 && field_value<kernel, SurfaceBranch::recovered, equal_radii>(s, *cell, y) > 0.0f;
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
  for (int a = 0; a < 3; ++a) forget_beside_face(first[a] - static_cast<float>(cell[a]), 1.0f, start);
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
    start.end_at(end);
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
  // A clearance is of the origin; the ray may start at a surface farther on.
  if (ray.clearance.distance > ray.t_min) known.sheet = ray.clearance.sheet;
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
