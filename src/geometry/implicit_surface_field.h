#pragma once

#include "geometry/implicit_surface.h"
#include "geometry/kernel_lanes.h"
#include "math/lanes.h"

namespace embrun {

// The exact fields of one cell: loops over the cell's lists. `y` is relative to the cell's centre and all
// lengths are grid units. Fields are relative: g = D/T - 1 and g' = D'/T' - 1, positive inside.

/// The two fields whose larger one makes the surface.
enum class SurfaceBranch {
  main,       ///< D, of all particles
  recovered,  ///< D', of the recovered ones
};

/// A field at a point of a line and its derivative there; -down <= g'' <= up where the caller asked for it.
struct FieldOnLine {
  float value, slope, up, down;
};

/// g at a point and the sums over a cell's list that make both normals, pointing away from the particles.
struct FieldNormals {
  float value;
  Vec3 weighted;     ///< sum f_i (y - p_i)/|y - p_i|
  Vec3 gradient;     ///< minus the gradient of g
  float rise, fall;  ///< -fall <= g'' <= rise in every direction, within the distance asked for
};

/// As many particles of a list as a register holds, relative to a point, in units of their influence radii.
struct ParticleLanes {
  RegisterLanes x, y, z;
  RegisterLanes inverse_influence;
  RegisterLanes weight;  ///< of the recovered branch
};

/// How many of those a cell's list makes.
template <SurfaceBranch branch>
EMBRUN_FN int group_count(const SurfaceCell& cell) {
  const int eights = branch == SurfaceBranch::main ? cell.list_eights : cell.recovered_eights;
  return (8 * eights + register_lanes - 1) / register_lanes;
}

/// 1/b of all particles, or 1/b' of the recovered ones, where radii are equal.
template <SurfaceBranch branch>
EMBRUN_FN float equal_inverse_influence(const ImplicitSurfaceView& s) {
  return branch == SurfaceBranch::main ? s.inverse_influence : s.recovered_inverse_influence;
}
template <SurfaceBranch branch>
EMBRUN_FN const ListLattice& lattice(const ImplicitSurfaceView& s) {
  return branch == SurfaceBranch::main ? s.lattice : s.recovered_lattice;
}
template <SurfaceBranch branch>
EMBRUN_FN float inverse_threshold(const ImplicitSurfaceView& s) {
  return branch == SurfaceBranch::main ? s.inverse_threshold : s.recovered_inverse_threshold;
}

/// Group `i` of the cell's list, relative to `origin` in the coordinates of lists.
template <SurfaceBranch branch, bool equal_radii>
EMBRUN_FN ParticleLanes load_group(const ImplicitSurfaceView& s, const SurfaceCell& cell, int i, Vec3 origin) {
  constexpr bool recovered = branch == SurfaceBranch::recovered;
  constexpr int groups = 16 / register_lanes;  // of a block
  const std::size_t block =
      static_cast<std::size_t>(recovered ? cell.recovered : cell.list) + static_cast<std::size_t>(i / groups);
  const std::size_t first = static_cast<std::size_t>(i % groups) * std::size_t{register_lanes};
  const auto load = [](const auto* from) { return load_lanes<RegisterLanes>(from); };
  ParticleLanes p;
  if constexpr (equal_radii) {
    constexpr std::size_t stride = recovered ? packed_recovered_stride : packed_stride;
    const std::uint16_t* list = (recovered ? s.packed_recovered : s.packed_lists) + block * stride + first;
    p.inverse_influence = RegisterLanes(equal_inverse_influence<branch>(s));
    const float scale = equal_inverse_influence<branch>(s) / lattice<branch>(s).per_cell;
    p.x = load(list) * scale - origin.x;
    p.y = load(list + 16) * scale - origin.y;
    p.z = load(list + 32) * scale - origin.z;
    if constexpr (recovered) p.weight = load(list + 48) * (1.0f / 65535.0f);
  } else {
    constexpr std::size_t stride = recovered ? wide_recovered_stride : wide_stride;
    const float* list = (recovered ? s.wide_recovered : s.wide_lists) + block * stride + first;
    p.inverse_influence = load(list + 48);
    p.x = (load(list) - origin.x) * p.inverse_influence;
    p.y = (load(list + 16) - origin.y) * p.inverse_influence;
    p.z = (load(list + 32) - origin.z) * p.inverse_influence;
    if constexpr (recovered) p.weight = load(list + 64);
  }
  return p;
}

/// A point of the cell as load_group wants it: in influence radii from the lattice's zero, or as it is where radii differ.
template <SurfaceBranch branch, bool equal_radii>
EMBRUN_FN Vec3 list_coordinates(const ImplicitSurfaceView& s, Vec3 y) {
  if constexpr (equal_radii) {
    const float radii = equal_inverse_influence<branch>(s);
    const float shift = (lattice<branch>(s).bias / lattice<branch>(s).per_cell + 0.5f) * radii;
    return y * radii + Vec3{shift, shift, shift};
  } else {
    return y;
  }
}

/// Of the line along the unit vector `d` through the point, from the particles; `ahead` is p . d. Not |p|^2 - ahead^2: a
/// small particle is hundreds of its radii away, and nothing would be left of the difference.
EMBRUN_FN RegisterLanes squared_distance_of_line(const ParticleLanes& p, RegisterLanes ahead, Vec3 d) {
  const RegisterLanes x = p.x - ahead * d.x, y = p.y - ahead * d.y, z = p.z - ahead * d.z;
  return x * x + y * y + z * z;
}

/// Sums of particles' kernels along a line to a field's. Where radii are equal they are scaled in the end.
template <SurfaceBranch branch, bool equal_radii>
struct LineSums {
  static constexpr bool scaled_after = equal_radii && branch == SurfaceBranch::main;
  RegisterLanes value = RegisterLanes(0.0f), slope = value, up = value, down = value;

  EMBRUN_FN void add(const ParticleLanes& p, const LineLanes<RegisterLanes>& f) {
    if constexpr (scaled_after) {
      value += f.value;
      slope += f.slope;
      up += f.up;
      down += f.down;
    } else {
      RegisterLanes first = p.inverse_influence, second = p.inverse_influence * p.inverse_influence;
      if constexpr (branch == SurfaceBranch::recovered) {
        value += f.value * p.weight;
        first = first * p.weight;
        second = second * p.weight;
      } else {
        value += f.value;
      }
      slope += f.slope * first;
      up += f.up * second;
      down += f.down * second;
    }
  }

  EMBRUN_FN FieldOnLine total(const ImplicitSurfaceView& s) const {
    const float scale = inverse_threshold<branch>(s);
    const float per_radius = scaled_after ? s.inverse_influence : 1.0f;
    const float first = scale * per_radius, second = first * per_radius;
    return {sum_lanes(value) * scale - 1.0f, sum_lanes(slope) * first, sum_lanes(up) * second,
            sum_lanes(down) * second};
  }
};

/// How far the bounds of field_on_line hold.
enum class BoundsFor {
  line,     ///< everywhere in the cell
  segment,  ///< from `begin` to `end` along the line: tighter, and dearer to compute
};

template <Kernel kernel, SurfaceBranch branch, bool equal_radii, BoundsFor bounds>
EMBRUN_LOCAL_FN FieldOnLine field_on_line(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& y,
                                          const Vec3& d, float begin, float end) {
  const Vec3 origin = list_coordinates<branch, equal_radii>(s, y);
  LineSums<branch, equal_radii> sum;
  const int groups = group_count<branch>(cell);
  for (int i = 0; i < groups; ++i) {
    const ParticleLanes p = load_group<branch, equal_radii>(s, cell, i, origin);
    const RegisterLanes q = p.x * p.x + p.y * p.y + p.z * p.z;
    const RegisterLanes ahead = p.x * d.x + p.y * d.y + p.z * d.z;
    const RegisterLanes aside =
        equal_radii ? max_of(q - ahead * ahead, RegisterLanes(0.0f)) : squared_distance_of_line(p, ahead, d);
    if constexpr (bounds == BoundsFor::segment) {
      sum.add(p,
              KernelLanes<kernel>::on_segment(q, ahead, aside, p.inverse_influence * begin, p.inverse_influence * end));
    } else {
      sum.add(p, KernelLanes<kernel>::on_line(q, ahead, aside));
    }
  }
  return sum.total(s);
}

template <Kernel kernel, SurfaceBranch branch, bool equal_radii>
EMBRUN_LOCAL_FN float field_value(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& y) {
  const Vec3 origin = list_coordinates<branch, equal_radii>(s, y);
  RegisterLanes value = RegisterLanes(0.0f);
  const int groups = group_count<branch>(cell);
  for (int i = 0; i < groups; ++i) {
    const ParticleLanes p = load_group<branch, equal_radii>(s, cell, i, origin);
    RegisterLanes f = KernelLanes<kernel>::value(p.x * p.x + p.y * p.y + p.z * p.z);
    if constexpr (branch == SurfaceBranch::recovered) f = f * p.weight;
    value += f;
  }
  return sum_lanes(value) * inverse_threshold<branch>(s) - 1.0f;
}

/// With `bounded` also rise and fall, over the distance `within`; else they are 0.
template <Kernel kernel, SurfaceBranch branch, bool equal_radii, bool bounded>
EMBRUN_LOCAL_FN FieldNormals field_normals(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& y,
                                           [[maybe_unused]] float within) {
  const Vec3 origin = list_coordinates<branch, equal_radii>(s, y);
  RegisterLanes wx = RegisterLanes(0.0f), wy = wx, wz = wx, gx = wx, gy = wx, gz = wx, rise = wx, fall = wx, sum = wx;
  const int groups = group_count<branch>(cell);
  for (int i = 0; i < groups; ++i) {
    const ParticleLanes p = load_group<branch, equal_radii>(s, cell, i, origin);
    const RegisterLanes q = p.x * p.x + p.y * p.y + p.z * p.z;
    RegisterLanes value, pull, inverse;
    KernelLanes<kernel>::value_and_pull(q, value, pull, inverse);
    RegisterLanes first = p.inverse_influence;
    RegisterLanes w = value * inverse;
    if constexpr (branch == SurfaceBranch::recovered) {
      value = value * p.weight;
      w = w * p.weight;
      first = first * p.weight;
    }
    if constexpr (bounded) {
      const CurvatureLanes<RegisterLanes> bend =
          KernelLanes<kernel>::curvature_within(q * inverse, p.inverse_influence * within);
      const RegisterLanes second = first * p.inverse_influence;
      rise += bend.up * second;
      fall += bend.down * second;
    }
    pull = pull * first;
    sum += value;
    wx -= w * p.x, wy -= w * p.y, wz -= w * p.z;
    gx -= pull * p.x, gy -= pull * p.y, gz -= pull * p.z;
  }
  const float scale = inverse_threshold<branch>(s);
  return {sum_lanes(sum) * scale - 1.0f,
          {sum_lanes(wx), sum_lanes(wy), sum_lanes(wz)},
          Vec3{sum_lanes(gx), sum_lanes(gy), sum_lanes(gz)} * scale,
          sum_lanes(rise) * scale,
          sum_lanes(fall) * scale};
}

/// The field and its derivative along the unit vector `d`, with bounds that hold within the distance `within` in every
/// direction.
template <Kernel kernel, SurfaceBranch branch, bool equal_radii>
EMBRUN_LOCAL_FN FieldOnLine field_around(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& y,
                                         const Vec3& d, float within) {
  const Vec3 origin = list_coordinates<branch, equal_radii>(s, y);
  LineSums<branch, equal_radii> sum;
  const int groups = group_count<branch>(cell);
  for (int i = 0; i < groups; ++i) {
    const ParticleLanes p = load_group<branch, equal_radii>(s, cell, i, origin);
    const RegisterLanes q = p.x * p.x + p.y * p.y + p.z * p.z;
    RegisterLanes f, pull, inverse;
    KernelLanes<kernel>::value_and_pull(q, f, pull, inverse);
    const CurvatureLanes<RegisterLanes> bend =
        KernelLanes<kernel>::curvature_within(q * inverse, p.inverse_influence * within);
    sum.add(p, {f, pull * (p.x * d.x + p.y * d.y + p.z * d.z), bend.up, bend.down});
  }
  return sum.total(s);
}

/// Bound on D'/T' from `low` to `high` along a line: each particle at its nearest.
template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN float most_recovered(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& y,
                                     const Vec3& d, float low, float high) {
  const Vec3 origin = list_coordinates<SurfaceBranch::recovered, equal_radii>(s, y);
  RegisterLanes most = RegisterLanes(0.0f);
  const int groups = group_count<SurfaceBranch::recovered>(cell);
  for (int i = 0; i < groups; ++i) {
    const ParticleLanes p = load_group<SurfaceBranch::recovered, equal_radii>(s, cell, i, origin);
    const RegisterLanes ahead = p.x * d.x + p.y * d.y + p.z * d.z;
    const RegisterLanes nearest = max_of(min_of(ahead, p.inverse_influence * high), p.inverse_influence * low);
    most += KernelLanes<kernel>::value(squared_distance_of_line(p, nearest, d)) * p.weight;
  }
  return sum_lanes(most) * s.recovered_inverse_threshold;
}

/// The recovered field along a line, seen from the particles one by one.
struct RecoveredSpan {
  float begin, end;             ///< where it can be felt
  float densest;                ///< where the particles are nearest, by weight
  float ball_entry, ball_exit;  ///< of the balls that they are when alone; infinite or minus infinite if all are missed
};

template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN RecoveredSpan recovered_span(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& y,
                                             const Vec3& d) {
  constexpr float support = kernel == Kernel::blinn ? blinn_support : 1.0f;
  const Vec3 origin = list_coordinates<SurfaceBranch::recovered, equal_radii>(s, y);
  const RegisterLanes nowhere = RegisterLanes(infinity), before = RegisterLanes(-infinity), zero = RegisterLanes(0.0f);
  const RegisterLanes edge = RegisterLanes(support * support), ball = RegisterLanes(0.25f);
  RegisterLanes begin = nowhere, end = before, entry = nowhere, exit = before, total = zero, moment = zero;
  const int groups = group_count<SurfaceBranch::recovered>(cell);
  for (int i = 0; i < groups; ++i) {
    const ParticleLanes p = load_group<SurfaceBranch::recovered, equal_radii>(s, cell, i, origin);
    const RegisterLanes ahead = p.x * d.x + p.y * d.y + p.z * d.z;
    const RegisterLanes beside = squared_distance_of_line(p, ahead, d);
    const RegisterLanes radius = 1.0f / p.inverse_influence;
    const RegisterLanes chord = max_of(edge - beside, RegisterLanes(1e-12f));
    const RegisterLanes half = chord * rsqrt_of(chord);
    // A lone particle's ball has half its influence radius.
    const RegisterLanes ball_chord = max_of(ball - beside, RegisterLanes(1e-12f));
    const RegisterLanes ball_half = ball_chord * rsqrt_of(ball_chord);
    begin = min_of(begin, select_less(beside, edge, (ahead - half) * radius, nowhere));
    end = max_of(end, select_less(beside, edge, (ahead + half) * radius, before));
    entry = min_of(entry, select_less(beside, ball, (ahead - ball_half) * radius, nowhere));
    exit = max_of(exit, select_less(beside, ball, (ahead + ball_half) * radius, before));
    const RegisterLanes share = KernelLanes<kernel>::value(beside) * p.weight;
    total += share;
    moment += share * ahead * radius;
  }
  return {min_lane(begin), max_lane(end), sum_lanes(moment) / max_of(sum_lanes(total), 1e-12f), min_lane(entry),
          max_lane(exit)};
}

}  // namespace embrun
