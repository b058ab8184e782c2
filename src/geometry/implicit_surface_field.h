#pragma once

#include <type_traits>
#include <utility>

#include "geometry/implicit_surface.h"
#include "geometry/kernel_lanes.h"
#include "geometry/particle_eights.h"
#include "math/lanes.h"

namespace embrun {

// The exact fields of one cell: loops over the particles felt in it. `y` is relative to the cell's centre and all
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

/// The same vector in all lanes of a register.
struct VecLanes {
  RegisterLanes x, y, z;

  EMBRUN_FN explicit VecLanes(Vec3 v) : x(v.x), y(v.y), z(v.z) {}
};

/// As many particles of a list as a register holds, relative to a point, in units of their influence radii.
struct ParticleLanes {
  RegisterLanes x, y, z;
  RegisterLanes inverse_influence;
  RegisterLanes weight;  ///< of the recovered branch
};

/// 1/b of all particles, or 1/b' of the recovered ones, where radii are equal.
template <SurfaceBranch branch>
EMBRUN_FN float equal_inverse_influence(const ImplicitSurfaceView& s) {
  return branch == SurfaceBranch::main ? s.inverse_influence : s.recovered_inverse_influence;
}
/// A step of the packed lists' lattice, in the same radii.
template <SurfaceBranch branch>
EMBRUN_FN float packed_step(const ImplicitSurfaceView& s) {
  return branch == SurfaceBranch::main ? s.packed_step : s.packed_recovered_step;
}
template <SurfaceBranch branch>
EMBRUN_FN float inverse_threshold(const ImplicitSurfaceView& s) {
  return branch == SurfaceBranch::main ? s.inverse_threshold : s.recovered_inverse_threshold;
}

/// The lists of a field's particles.
template <SurfaceBranch branch, bool equal_radii>
EMBRUN_FN auto lists(const ImplicitSurfaceView& s) {
  if constexpr (branch == SurfaceBranch::main) {
    if constexpr (equal_radii) {
      return s.packed;
    } else {
      return s.wide;
    }
  } else {
    if constexpr (equal_radii) {
      return s.packed_recovered;
    } else {
      return s.wide_recovered;
    }
  }
}

/// A point of the cell as FeltParticles wants it, from the middle of the list's box: in influence radii, or in grid units
/// where radii differ.
template <SurfaceBranch branch, bool equal_radii>
EMBRUN_FN Vec3 list_coordinates(const ImplicitSurfaceView& s, const SurfaceCell& cell, Vec3 y) {
  // A cell has its recovered particles for itself.
  const Vec3 from_middle = branch == SurfaceBranch::main ? y + cell.place.offset() : y;
  return equal_radii ? from_middle * equal_inverse_influence<branch>(s) : from_middle;
}

/// The particles of one field that are felt in a cell, a register of them at a time, relative to a point.
template <SurfaceBranch branch, bool equal_radii>
class FeltParticles {
 public:
  EMBRUN_FN FeltParticles(const ImplicitSurfaceView& s, const SurfaceCell& cell, Vec3 y)
      : step_(packed_step<branch>(s)), origin_(list_coordinates<branch, equal_radii>(s, cell, y)) {
    lanes_.inverse_influence = RegisterLanes(equal_inverse_influence<branch>(s));
    list_ = lists<branch, equal_radii>(s) + (recovered ? cell.recovered : cell.list);
    if constexpr (recovered) {
      left_ = cell.recovered_eights;
    } else {
      bits_ = list_bits_ = cell.list_bits;
      part_ = passes_ = 1 << cell.place.eights_log2();
    }
  }

  /// The next ones; false when there are no more.
  EMBRUN_FN bool next(ParticleLanes& p) {
    if constexpr (register_lanes == 16) {
      const Eight *first, *second = nullptr;
      if (!next_eight(first)) return false;
      next_eight(second);
      load([&](const auto& array, auto none) {
        return join_eights(array(*first), second != nullptr ? array(*second) : nullptr, none);
      });
    } else {
      if (in_eight_ == 0 && !next_eight(eight_)) return false;
      load([&](const auto& array, auto) { return load_register(array(*eight_) + in_eight_); });
      in_eight_ = (in_eight_ + register_lanes) % 8;
    }
    p = lanes_;
    return true;
  }

 private:
  static constexpr bool recovered = branch == SurfaceBranch::recovered;
  using Eight = std::remove_cvref_t<decltype(*lists<branch, equal_radii>(std::declval<const ImplicitSurfaceView&>()))>;

  EMBRUN_FN bool next_eight(const Eight*& eight) {
    if constexpr (recovered) {
      if (left_ == 0) return false;
      --left_;
      eight = list_++;
    } else {
      // First the first eights of all parts, then the second ones: nearly always a part has but one.
      if (bits_ == 0) {
        if (--passes_ <= 0) return false;
        ++list_;
        bits_ = list_bits_;
      }
      eight = list_ + lowest_bit(bits_) * part_;
      bits_ &= bits_ - 1;
    }
    return true;
  }

  /// `of` gives a register of one of an eight's arrays, and where there is no eight of what stands for no particle.
  template <class Of>
  EMBRUN_FN void load(const Of& of) {
    if constexpr (equal_radii) {
      const LaneIntRegister xz = of([](const Eight& e) { return e.xz; }, packed_nowhere.xz);
      const LaneIntRegister yz = of([](const Eight& e) { return e.yz; }, packed_nowhere.yz);
      lanes_.x = to_lanes(to_float(packed_x(xz))) * step_ - origin_.x;
      lanes_.y = to_lanes(to_float(packed_y(yz))) * step_ - origin_.y;
      lanes_.z = to_lanes(to_float(packed_z(xz, yz))) * step_ - origin_.z;
    } else {
      lanes_.inverse_influence = to_lanes(of([](const Eight& e) { return e.inverse_influence; }, 1.0f));
      const auto coordinate = [&](const auto& array, RegisterLanes origin) {
        return (to_lanes(of(array, far_away)) - origin) * lanes_.inverse_influence;
      };
      lanes_.x = coordinate([](const Eight& e) { return e.x; }, origin_.x);
      lanes_.y = coordinate([](const Eight& e) { return e.y; }, origin_.y);
      lanes_.z = coordinate([](const Eight& e) { return e.z; }, origin_.z);
    }
    if constexpr (recovered) lanes_.weight = to_lanes(of([](const Eight& e) { return e.weight; }, 0.0f));
  }

  const Eight* list_;
  const Eight* eight_ = nullptr;  ///< where registers hold no more than eight: the eight, and
  int in_eight_ = 0;              ///< where in it
  int left_ = 0;
  std::uint32_t bits_ = 0, list_bits_ = 0;
  int passes_ = 0;
  int part_ = 0;  ///< eights of a part
  RegisterLanes step_;
  VecLanes origin_;
  ParticleLanes lanes_;
};

/// Of the line along the unit vector `d` through the point, from the particles; `ahead` is p . d. Not |p|^2 - ahead^2: a
/// small particle is hundreds of its radii away, and nothing would be left of the difference.
EMBRUN_FN RegisterLanes squared_distance_of_line(const ParticleLanes& p, RegisterLanes ahead, const VecLanes& d) {
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
    const LaneSums sum = sum_lanes(value, slope, up, down);
    return {sum.of[0] * scale - 1.0f, sum.of[1] * first, sum.of[2] * second, sum.of[3] * second};
  }
};

/// How far the bounds of field_on_line hold.
enum class BoundsFor {
  line,     ///< everywhere in the cell
  segment,  ///< from `begin` to `end` along the line: tighter, and dearer to compute
};

template <Kernel kernel, SurfaceBranch branch, bool equal_radii, BoundsFor bounds>
EMBRUN_LOCAL_FN FieldOnLine field_on_line(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& y,
                                          const Vec3& direction, float begin, float end) {
  const VecLanes d(direction);
  LineSums<branch, equal_radii> sum;
  FeltParticles<branch, equal_radii> particles(s, cell, y);
  ParticleLanes p;
  while (particles.next(p)) {
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
  RegisterLanes value = RegisterLanes(0.0f);
  FeltParticles<branch, equal_radii> particles(s, cell, y);
  ParticleLanes p;
  while (particles.next(p)) {
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
  RegisterLanes wx = RegisterLanes(0.0f), wy = wx, wz = wx, gx = wx, gy = wx, gz = wx, rise = wx, fall = wx, sum = wx;
  FeltParticles<branch, equal_radii> particles(s, cell, y);
  ParticleLanes p;
  while (particles.next(p)) {
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
  const LaneSums w = sum_lanes(wx, wy, wz, sum);
  const LaneSums g = sum_lanes(gx, gy, gz, rise);
  return {w.of[3] * scale - 1.0f,
          {w.of[0], w.of[1], w.of[2]},
          Vec3{g.of[0], g.of[1], g.of[2]} * scale,
          g.of[3] * scale,
          sum_lanes(fall) * scale};
}

/// The field and its derivative along the unit vector `direction`, with bounds that hold within the distance `within` in every
/// direction.
template <Kernel kernel, SurfaceBranch branch, bool equal_radii>
EMBRUN_LOCAL_FN FieldOnLine field_around(const ImplicitSurfaceView& s, const SurfaceCell& cell, const Vec3& y,
                                         const Vec3& direction, float within) {
  const VecLanes d(direction);
  LineSums<branch, equal_radii> sum;
  FeltParticles<branch, equal_radii> particles(s, cell, y);
  ParticleLanes p;
  while (particles.next(p)) {
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
                                     const Vec3& direction, float low, float high) {
  const VecLanes d(direction);
  RegisterLanes most = RegisterLanes(0.0f);
  FeltParticles<SurfaceBranch::recovered, equal_radii> particles(s, cell, y);
  ParticleLanes p;
  while (particles.next(p)) {
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
                                             const Vec3& direction) {
  const VecLanes d(direction);
  constexpr float support = kernel == Kernel::blinn ? blinn_support : 1.0f;
  const RegisterLanes nowhere = RegisterLanes(infinity), before = RegisterLanes(-infinity), zero = RegisterLanes(0.0f);
  const RegisterLanes edge = RegisterLanes(support * support), ball = RegisterLanes(0.25f);
  RegisterLanes begin = nowhere, end = before, entry = nowhere, exit = before, total = zero, moment = zero;
  FeltParticles<SurfaceBranch::recovered, equal_radii> particles(s, cell, y);
  ParticleLanes p;
  while (particles.next(p)) {
    const RegisterLanes ahead = p.x * d.x + p.y * d.y + p.z * d.z;
    const RegisterLanes beside = squared_distance_of_line(p, ahead, d);
    const RegisterLanes radius = 1.0f / p.inverse_influence;
    const RegisterLanes half = sqrt_of(max_of(edge - beside, zero));
    // A lone particle's ball has half its influence radius.
    const RegisterLanes ball_half = sqrt_of(max_of(ball - beside, zero));
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
