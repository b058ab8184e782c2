#pragma once

#include <cstdint>

#include "geometry/grid_walk.h"
#include "geometry/surface_hit.h"
#include "math/lanes.h"
#include "math/ray.h"

// The surface of a field on a lattice, in place of the particles' own: coarse, but found without looking at particles.
// g is a quadratic spline in each coordinate, so it is smooth across cells; in a cell it lies between the least and the
// greatest of the 27 values round it (a B-spline's weights are positive and their sum is 1), which tells where no surface
// can be.

namespace embrun {

/// 4 x 4 x 4 cells that the surface may pass through.
struct alignas(64) LatticeBrick {
  std::uint64_t near = 0;    ///< bit x + 4 y + 16 z: the surface may be in that cell
  std::uint64_t inside = 0;  ///< likewise: a cell that is all inside
  float values[216];  ///< of g; cell (x, y, z) has those from (x, y, z) to (x + 2, y + 2, z + 2), x fastest of six
};

/// Flat arrays, read-only, the same on host and device.
struct LatticeSurfaceView {
  CellGrid bricks;
  const std::int32_t* state = nullptr;  ///< of each brick: outside, inside, or its number in `brick`
  const LatticeBrick* brick = nullptr;
  float cell = 1;  ///< metres

  static constexpr std::int32_t outside = -1, inside = -2;
};

/// g and its gradient along the lattice's axes, per cell.
struct LatticeValue {
  float g;
  Vec3 gradient;
};

/// A point in cells from a brick's low corner; F is float or lanes of them.
template <class F>
struct LatticePoint {
  F x, y, z;
};

/// Weights of a quadratic B-spline's three values in a cell, u from 0 to 1 across it; F is float or lanes of them.
template <class F>
EMBRUN_FN void spline_weights(F u, F w[3]) {
  const F v = F(1.0f) - u;
  w[0] = F(0.5f) * v * v;
  w[1] = F(0.5f) + u * v;
  w[2] = F(0.5f) * u * u;
}

/// Their derivatives by u.
EMBRUN_FN void spline_slopes(float u, float w[3]) {
  w[0] = u - 1.0f;
  w[1] = 1.0f - 2.0f * u;
  w[2] = u;
}

/// The field in one cell of a brick; points are in cells from the brick's low corner.
struct LatticeField {
  const float* values;  ///< the cell's first
  Vec3 corner;          ///< the cell's, in cells from the brick's

  EMBRUN_FN LatticeField(const LatticeBrick& brick, int x, int y, int z)
      : values(brick.values + (z * 6 + y) * 6 + x),
        corner{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)} {}
  /// Of the cell that holds the point.
  EMBRUN_FN LatticeField(const LatticeBrick& brick, const Vec3& p)
      : LatticeField(brick, cell_of(p.x), cell_of(p.y), cell_of(p.z)) {}

  template <class F>
  EMBRUN_FN F value(const LatticePoint<F>& p) const {
    F x[3], y[3], z[3];
    spline_weights(p.x - F(corner.x), x);
    spline_weights(p.y - F(corner.y), y);
    spline_weights(p.z - F(corner.z), z);
    return sum(x, y, z);
  }
  EMBRUN_FN float value(const Vec3& p) const { return value(LatticePoint<float>{p.x, p.y, p.z}); }
  EMBRUN_FN LatticeValue value_and_gradient(const Vec3& p) const {
    float x[3], y[3], z[3], dx[3], dy[3], dz[3];
    spline_weights(p.x - corner.x, x);
    spline_weights(p.y - corner.y, y);
    spline_weights(p.z - corner.z, z);
    spline_slopes(p.x - corner.x, dx);
    spline_slopes(p.y - corner.y, dy);
    spline_slopes(p.z - corner.z, dz);
    return {sum(x, y, z), {sum(dx, y, z), sum(x, dy, z), sum(x, y, dz)}};
  }

 private:
  EMBRUN_FN static int cell_of(float v) { return static_cast<int>(clamp(v, 0.0f, 3.5f)); }
  template <class F>
  EMBRUN_FN F sum(const F x[3], const F y[3], const F z[3]) const {
    F total = F(0.0f);
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) {
        const float* v = values + (k * 6 + j) * 6;
        total += z[k] * y[j] * (x[0] * F(v[0]) + x[1] * F(v[1]) + x[2] * F(v[2]));
      }
    }
    return total;
  }
};

/// A ray in a brick: in cells from its low corner, and still metres along the ray.
struct LatticeRay {
  Vec3 origin, direction;

  EMBRUN_FN Vec3 at(float t) const { return origin + direction * t; }
};

/// Where F = sign g, not above 0 at `low`, is above 0 at `high`: its zero between, to 1e-5 cells.
EMBRUN_LOCAL_FN float lattice_zero(const LatticeField& field, const LatticeRay& ray, float sign, float low, float high,
                                   float cell) {
  float t = 0.5f * (low + high);
  for (int i = 0; i < 24 && high - low > 1e-5f * cell; ++i) {
    const LatticeValue here = field.value_and_gradient(ray.at(t));
    const float value = sign * here.g, slope = sign * dot(here.gradient, ray.direction);
    (value > 0.0f ? high : low) = t;
    const float newton = slope > 0.0f ? t - value / slope : infinity;
    if (newton > low && newton < high) {
      if (fabsf(newton - t) < 1e-6f * cell) return newton;
      t = newton;
    } else {
      t = 0.5f * (low + high);
    }
  }
  return t;
}

/// What a walk along a ray knows of F where it is.
struct LatticeWalk {
  float sign;
  bool starts = true;  ///< nothing of the ray was walked yet
  bool known = false;  ///< F is known not to be above 0 where the last stretch ended
};

/// The crossing in one cell that the surface may pass through, within [low, high] of the ray. F is looked at sixteen times
/// on the way: bodies and gaps that are thinner than that are passed over.
EMBRUN_LOCAL_FN bool cross_lattice_cell(const LatticeField& field, const LatticeRay& ray, float low, float high,
                                        float cell, LatticeWalk& walk, float& t_hit) {
  constexpr int samples = F16::count;
  bool back = false;  // rounding put the start across the surface, and the ray goes back to its side
  if (!walk.known) {
    const LatticeValue here = field.value_and_gradient(ray.at(low));
    if (walk.sign * here.g > 0.0f) {
      t_hit = low;
      constexpr float rounding = 0.01f;
      back = walk.starts && walk.sign * here.g < rounding && walk.sign * dot(here.gradient, ray.direction) < 0.0f;
      if (!back) return true;
    }
  }
  alignas(64) float t[samples];
  for (int i = 0; i < samples; ++i)
    t[i] = low + (high - low) * (static_cast<float>(i + 1) * (1.0f / static_cast<float>(samples)));
  const F16 at = load16(t), o = splat(walk.sign);
  const LatticePoint<F16> p{splat(ray.origin.x) + at * splat(ray.direction.x),
                            splat(ray.origin.y) + at * splat(ray.direction.y),
                            splat(ray.origin.z) + at * splat(ray.direction.z)};
  const F16 value = o * field.value(p);
  std::uint32_t above = mask_less(splat(0.0f), value);
  if (back) {
    // It is back where the first sample is not above 0: in the next cell, perhaps.
    const std::uint32_t below = ~above & 0xffffu;
    if (below == 0) return false;
    above &= ~((below & (~below + 1u)) - 1u);
  }
  walk.starts = false;
  walk.known = true;
  if (above == 0) return false;
  int first = 0;
  while ((above >> first & 1u) == 0) ++first;
  t_hit = lattice_zero(field, ray, walk.sign, first == 0 ? low : t[first - 1], t[first], cell);
  return true;
}

EMBRUN_FN Vec3 brick_corner(const LatticeSurfaceView& s, int x, int y, int z) {
  return s.bricks.low + s.bricks.cell * Vec3{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

/// A point's brick.
struct LatticePlace {
  std::int32_t state;  ///< see LatticeSurfaceView; outside beyond all bricks
  Vec3 local;          ///< where the state is a brick's number: the point in cells from its low corner
};

EMBRUN_LOCAL_FN LatticePlace place_in_lattice(const LatticeSurfaceView& s, const Vec3& point) {
  const Vec3 p = (point - s.bricks.low) * s.bricks.cells_per_metre;
  const int x = static_cast<int>(floorf(p.x)), y = static_cast<int>(floorf(p.y)), z = static_cast<int>(floorf(p.z));
  if (x < 0 || y < 0 || z < 0 || x >= s.bricks.nx || y >= s.bricks.ny || z >= s.bricks.nz)
    return {LatticeSurfaceView::outside, {}};
  return {s.state[s.bricks.index(x, y, z)], (point - brick_corner(s, x, y, z)) * (1.0f / s.cell)};
}

/// g at a point; -1 or 1 where no surface is near.
EMBRUN_LOCAL_FN float lattice_value(const LatticeSurfaceView& s, const Vec3& point) {
  const LatticePlace place = place_in_lattice(s, point);
  if (place.state < 0) return place.state == LatticeSurfaceView::inside ? 1.0f : -1.0f;
  return LatticeField(s.brick[place.state], place.local).value(place.local);
}

/// Whether a point is in the body.
EMBRUN_LOCAL_FN bool lattice_contains(const LatticeSurfaceView& s, const Vec3& point) {
  return lattice_value(s, point) > 0.0f;
}

EMBRUN_LOCAL_FN void fill_lattice_hit(const LatticeSurfaceView& s, const Ray& ray, float t, bool inside,
                                      SurfaceHit& hit) {
  hit = {};
  hit.t = t;
  hit.position = ray.at(t);
  hit.entering = !inside;
  hit.geometric_normal = inside ? ray.direction : -ray.direction;
  const LatticePlace place = place_in_lattice(s, hit.position);
  if (place.state >= 0) {
    const Vec3 gradient = LatticeField(s.brick[place.state], place.local).value_and_gradient(place.local).gradient;
    const float steepness = length(gradient);
    if (steepness > 1e-12f) hit.geometric_normal = gradient * (-1.0f / steepness);
  }
  hit.shading_normal = hit.geometric_normal;
}

/// First crossing with t in (ray.t_min, ray.t_max), as intersect_implicit_surface has it; false leaves `hit` alone. A ray
/// that is not where `side` says it starts crosses at once.
EMBRUN_LOCAL_FN bool intersect_lattice_surface(const LatticeSurfaceView& s, const Ray& ray, Side side,
                                               SurfaceHit& hit) {
  const bool inside = side == Side::unknown ? lattice_contains(s, ray.at(ray.t_min)) : side == Side::inside;
  LatticeWalk walk{inside ? -1.0f : 1.0f};
  const float per_metre = 1.0f / s.cell;
  GridWalk bricks(s.bricks, ray.origin, ray.direction, ray.t_min, ray.t_max);
  if (bricks.done && inside) {
    fill_lattice_hit(s, ray, ray.t_min, inside, hit);
    return true;
  }
  for (; !bricks.done; bricks.advance()) {
    const std::int32_t state = s.state[bricks.index()];
    if (state < 0) {
      walk.known = false;
      if ((state == LatticeSurfaceView::inside) == inside) {
        walk.starts = false;
        continue;
      }
      fill_lattice_hit(s, ray, bricks.begin, inside, hit);
      return true;
    }
    const LatticeBrick& brick = s.brick[state];
    const Vec3 low = brick_corner(s, bricks.x, bricks.y, bricks.z);
    const LatticeRay local{(ray.origin - low) * per_metre, ray.direction * per_metre};
    const CellGrid grid = grid_of_cubes(low, s.cell, 4, 4, 4);
    for (GridWalk cells(grid, ray.origin, ray.direction, bricks.begin, bricks.end()); !cells.done; cells.advance()) {
      const std::uint64_t bit = std::uint64_t{1} << cells.index();
      float t = cells.begin;
      if ((brick.near & bit) == 0) {
        walk.known = false;
        if (((brick.inside & bit) != 0) == inside) {
          walk.starts = false;
          continue;
        }
      } else if (!cross_lattice_cell({brick, cells.x, cells.y, cells.z}, local, cells.begin, cells.end(), s.cell, walk,
                                     t)) {
        continue;
      }
      fill_lattice_hit(s, ray, t, inside, hit);
      return true;
    }
  }
  return false;
}

}  // namespace embrun
