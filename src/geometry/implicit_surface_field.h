#pragma once

#include <type_traits>

#include "geometry/implicit_surface.h"
#include "geometry/kernel_lanes.h"
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
template <SurfaceBranch branch>
EMBRUN_FN const ListLattice& lattice(const ImplicitSurfaceView& s) {
  return branch == SurfaceBranch::main ? s.lattice : s.recovered_lattice;
}
template <SurfaceBranch branch>
EMBRUN_FN float inverse_threshold(const ImplicitSurfaceView& s) {
  return branch == SurfaceBranch::main ? s.inverse_threshold : s.recovered_inverse_threshold;
}

/// A point of the cell as FeltParticles wants it: in influence radii from the lattice's zero, or in grid units from the
/// middle of the list's box where radii differ.
template <SurfaceBranch branch, bool equal_radii>
EMBRUN_FN Vec3 list_coordinates(const ImplicitSurfaceView& s, const SurfaceCell& cell, Vec3 y) {
  // A cell has its recovered particles for itself.
  const Vec3 from_middle = branch == SurfaceBranch::main ? y + cell.place.offset() : y;
  if constexpr (equal_radii) {
    const float radii = equal_inverse_influence<branch>(s);
    const float shift = lattice<branch>(s).middle / lattice<branch>(s).per_cell * radii;
    return from_middle * radii + Vec3{shift, shift, shift};
  } else {
    return from_middle;
  }
}

/// A coordinate for lanes without a particle.
inline constexpr int far_away = 1000000000;

/// The particles of one field that are felt in a cell, a register of them at a time, relative to a point.
template <SurfaceBranch branch, bool equal_radii>
class FeltParticles {
 public:
  EMBRUN_FN FeltParticles(const ImplicitSurfaceView& s, const SurfaceCell& cell, Vec3 y)
      : scale_(equal_inverse_influence<branch>(s) / lattice<branch>(s).per_cell),
        origin_(list_coordinates<branch, equal_radii>(s, cell, y)) {
    lanes_.inverse_influence = RegisterLanes(equal_inverse_influence<branch>(s));
    if constexpr (equal_radii) {
      lists_ = recovered ? s.packed_recovered : s.packed_lists;
    } else {
      lists_ = recovered ? s.wide_recovered : s.wide_lists;
    }
    if constexpr (recovered) {
      lists_ += cell.recovered * stride;
      left_ = cell.recovered_eights;
    } else {
      lists_ += cell.list * stride;
      bits_ = list_bits_ = cell.list_bits;
      passes_ = 1 << cell.place.eights_log2();
      part_stride_ = static_cast<std::size_t>(passes_) * stride;
    }
  }

  /// The next ones; false when there are no more.
  EMBRUN_FN bool next(ParticleLanes& p) {
    const Number* from;
    if constexpr (register_lanes >= 8) {
      if (!next_eight(from)) return false;
    } else {
      if (in_eight_ == 0 && !next_eight(at_)) return false;
      from = at_ + in_eight_;
      in_eight_ = (in_eight_ + register_lanes) % 8;
    }
    if constexpr (register_lanes == 16) {
      const Number* second = nullptr;
      next_eight(second);
      load([&](int attribute, int none) {
        return load_two_eights(from + 8 * attribute, second != nullptr ? second + 8 * attribute : nullptr, none);
      });
    } else {
      load([&](int attribute, int) { return load_lanes<RegisterLanes>(from + 8 * attribute); });
    }
    p = lanes_;
    return true;
  }

 private:
  static constexpr bool recovered = branch == SurfaceBranch::recovered;
  static constexpr std::size_t stride = equal_radii ? recovered ? packed_recovered_stride : packed_stride
                                        : recovered ? wide_recovered_stride
                                                    : wide_stride;
  using Number = std::conditional_t<equal_radii, std::uint16_t, float>;

  EMBRUN_FN bool next_eight(const Number*& eight) {
    if constexpr (recovered) {
      if (left_ == 0) return false;
      --left_;
      eight = lists_;
      lists_ += stride;
    } else {
      // First the first eights of all parts, then the second ones: nearly always a part has but one.
      if (bits_ == 0) {
        if (--passes_ <= 0) return false;
        lists_ += stride;
        bits_ = list_bits_;
      }
      eight = lists_ + static_cast<std::size_t>(lowest_bit(bits_)) * part_stride_;
      bits_ &= bits_ - 1;
    }
    return true;
  }

  /// `attribute` gives a register of an attribute by its number in the lists, and by what stands for no particle there.
  template <class Attribute>
  EMBRUN_FN void load(const Attribute& attribute) {
    if constexpr (equal_radii) {
      lanes_.x = attribute(0, 65535) * scale_ - origin_.x;
      lanes_.y = attribute(1, 65535) * scale_ - origin_.y;
      lanes_.z = attribute(2, 65535) * scale_ - origin_.z;
      if constexpr (recovered) lanes_.weight = attribute(3, 0) * (1.0f / 65535.0f);
    } else {
      lanes_.inverse_influence = attribute(3, 1);
      lanes_.x = (attribute(0, far_away) - origin_.x) * lanes_.inverse_influence;
      lanes_.y = (attribute(1, far_away) - origin_.y) * lanes_.inverse_influence;
      lanes_.z = (attribute(2, far_away) - origin_.z) * lanes_.inverse_influence;
      if constexpr (recovered) lanes_.weight = attribute(4, 0);
    }
  }

  const Number* lists_ = nullptr;
  const Number* at_ = nullptr;  ///< where registers hold fewer than eight: the eight, and
  int in_eight_ = 0;            ///< where in it
  int left_ = 0;
  std::uint32_t bits_ = 0, list_bits_ = 0;
  int passes_ = 0;
  std::size_t part_stride_ = 0;
  RegisterLanes scale_;
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
  const LaneSums g = bounded ? sum_lanes(gx, gy, gz, rise) : sum_lanes(gx, gy, gz, RegisterLanes(0.0f));
  return {w.of[3] * scale - 1.0f,
          {w.of[0], w.of[1], w.of[2]},
          Vec3{g.of[0], g.of[1], g.of[2]} * scale,
          g.of[3] * scale,
          bounded ? sum_lanes(fall) * scale : 0.0f};
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
