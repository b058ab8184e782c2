#pragma once

#include "geometry/implicit_surface.h"
#include "geometry/kernel_lanes.h"
#include "math/lanes.h"

namespace embrun {

// The exact field of one cell: loops over the cell's lists. `y` is relative to the cell's centre and all
// lengths are grid units. Fields are relative: g = D/T - 1, g' = D'/T' - 1, positive inside.

/// g at a point of a line and its derivative there; -down <= g'' <= up all along the line inside the cell.
struct FieldOnLine {
  float value, slope, up, down;
};

/// Sums over a cell's list that make both normals, pointing away from the particles.
struct FieldNormals {
  Vec3 weighted;  ///< sum f_i (y - p_i)/|y - p_i|
  Vec3 gradient;  ///< minus a positive multiple of the gradient of D
};

/// Sixteen particles of a list relative to a point, in units of their influence radii.
struct ParticleLanes {
  F16 x, y, z;
  F16 inverse_influence;
};

template <bool equal_radii>
EMBRUN_FN ParticleLanes load_block(const ImplicitSurfaceView& s, std::uint32_t block, Vec3 origin) {
  ParticleLanes p;
  if constexpr (equal_radii) {
    // `origin` is on the cell's lattice; one scale for all.
    const std::uint16_t* list = s.packed_lists + static_cast<std::size_t>(block) * 48;
    const float scale = s.inverse_influence / s.lattice_per_cell;
    p.x = (load16(list) - origin.x) * scale;
    p.y = (load16(list + 16) - origin.y) * scale;
    p.z = (load16(list + 32) - origin.z) * scale;
    p.inverse_influence = splat(s.inverse_influence);
  } else {
    const float* list = s.wide_lists + static_cast<std::size_t>(block) * 64;
    p.inverse_influence = load16(list + 48);
    p.x = (load16(list) - origin.x) * p.inverse_influence;
    p.y = (load16(list + 16) - origin.y) * p.inverse_influence;
    p.z = (load16(list + 32) - origin.z) * p.inverse_influence;
  }
  return p;
}

/// A point of the cell in the coordinates of its list.
template <bool equal_radii>
EMBRUN_FN Vec3 list_coordinates(const ImplicitSurfaceView& s, Vec3 y) {
  if constexpr (equal_radii) {
    const float shift = s.lattice_bias + 0.5f * s.lattice_per_cell;
    return y * s.lattice_per_cell + Vec3{shift, shift, shift};
  } else {
    return y;
  }
}

template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN FieldOnLine field_on_line(const ImplicitSurfaceView& s, const SurfaceCell& cell, Vec3 y, Vec3 d) {
  const Vec3 origin = list_coordinates<equal_radii>(s, y);
  F16 value = splat(0.0f), slope = splat(0.0f), up = splat(0.0f), down = splat(0.0f);
  for (std::uint32_t i = 0; i < cell.list_blocks; ++i) {
    const ParticleLanes p = load_block<equal_radii>(s, cell.list + i, origin);
    const F16 q = p.x * p.x + p.y * p.y + p.z * p.z;
    const F16 ahead = p.x * d.x + p.y * d.y + p.z * d.z;
    const LineLanes f = KernelLanes<kernel>::on_line(q, ahead);
    value += f.value;
    if constexpr (equal_radii) {
      slope += f.slope;
      up += f.up;
      down += f.down;
    } else {
      slope += f.slope * p.inverse_influence;
      up += f.up * (p.inverse_influence * p.inverse_influence);
      down += f.down * (p.inverse_influence * p.inverse_influence);
    }
  }
  const float first = equal_radii ? s.inverse_threshold * s.inverse_influence : s.inverse_threshold;
  const float second = equal_radii ? first * s.inverse_influence : s.inverse_threshold;
  return {sum_lanes(value) * s.inverse_threshold - 1.0f, sum_lanes(slope) * first, sum_lanes(up) * second,
          sum_lanes(down) * second};
}

template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN float field_value(const ImplicitSurfaceView& s, const SurfaceCell& cell, Vec3 y) {
  const Vec3 origin = list_coordinates<equal_radii>(s, y);
  F16 value = splat(0.0f);
  for (std::uint32_t i = 0; i < cell.list_blocks; ++i) {
    const ParticleLanes p = load_block<equal_radii>(s, cell.list + i, origin);
    value += KernelLanes<kernel>::value(p.x * p.x + p.y * p.y + p.z * p.z);
  }
  return sum_lanes(value) * s.inverse_threshold - 1.0f;
}

template <Kernel kernel, bool equal_radii>
EMBRUN_LOCAL_FN FieldNormals field_normals(const ImplicitSurfaceView& s, const SurfaceCell& cell, Vec3 y) {
  const Vec3 origin = list_coordinates<equal_radii>(s, y);
  F16 wx = splat(0.0f), wy = splat(0.0f), wz = splat(0.0f);
  F16 gx = splat(0.0f), gy = splat(0.0f), gz = splat(0.0f);
  for (std::uint32_t i = 0; i < cell.list_blocks; ++i) {
    const ParticleLanes p = load_block<equal_radii>(s, cell.list + i, origin);
    const F16 q = p.x * p.x + p.y * p.y + p.z * p.z;
    F16 value, pull, inverse;
    KernelLanes<kernel>::value_and_pull(q, value, pull, inverse);
    const F16 w = value * inverse;
    if constexpr (!equal_radii) pull = pull * p.inverse_influence;
    wx -= w * p.x, wy -= w * p.y, wz -= w * p.z;
    gx -= pull * p.x, gy -= pull * p.y, gz -= pull * p.z;
  }
  return {{sum_lanes(wx), sum_lanes(wy), sum_lanes(wz)}, {sum_lanes(gx), sum_lanes(gy), sum_lanes(gz)}};
}

/// The same for the recovered particles' field, whose kernel has the radius b'. The lists are short.
template <Kernel kernel>
EMBRUN_LOCAL_FN FieldOnLine recovered_on_line(const ImplicitSurfaceView& s, const SurfaceCell& cell, Vec3 y, Vec3 d) {
  FieldOnLine sum{-1.0f, 0.0f, 0.0f, 0.0f};
  for (std::uint32_t i = 0; i < cell.recovered_count; ++i) {
    const RecoveredParticle& r = s.recovered[cell.recovered + i];
    const Vec3 to = Vec3{r.x - y.x, r.y - y.y, r.z - y.z} * r.inverse_radius;
    const float ahead = dot(to, d);
    const float square = dot(to, to);
    constexpr float support = kernel == Kernel::blinn ? blinn_support : 1.0f;
    const float beside = max_of(square - ahead * ahead, 0.0f);
    if (beside >= support * support) continue;
    const float u = sqrtf(square);
    const float slope = u > 1e-6f ? -kernel_derivative(kernel, u) * ahead / u : 0.0f;
    const float first = r.weight * r.inverse_radius;
    const float second = first * r.inverse_radius;
    sum.value += r.weight * kernel_value(kernel, u);
    sum.slope += first * slope;
    // The bounds of KernelLanes::on_line; Blinn's are at most 4k exp(-1.5) and 2k.
    const float rest = 1.0f - beside;
    if constexpr (kernel == Kernel::metaball) {
      sum.up += second * 3.0f * rest;
      sum.down += second * min_of(6.0f, 6.75f * rest);
    } else if constexpr (kernel == Kernel::zhu_bridson) {
      sum.up += second * 6.0f * rest * rest;
      sum.down += second * 6.0f * rest * rest;
    } else {
      sum.up += second * 0.893f * blinn_exponent;
      sum.down += second * 2.003f * blinn_exponent;
    }
  }
  return sum;
}

template <Kernel kernel>
EMBRUN_LOCAL_FN FieldNormals recovered_normals(const ImplicitSurfaceView& s, const SurfaceCell& cell, Vec3 y) {
  FieldNormals sum;
  for (std::uint32_t i = 0; i < cell.recovered_count; ++i) {
    const RecoveredParticle& r = s.recovered[cell.recovered + i];
    const Vec3 away = Vec3{y.x - r.x, y.y - r.y, y.z - r.z} * r.inverse_radius;
    const float u = length(away);
    if (u <= 1e-6f) continue;
    sum.weighted += away * (r.weight * kernel_value(kernel, u) / u);
    sum.gradient += away * (-r.weight * r.inverse_radius * kernel_derivative(kernel, u) / u);
  }
  return sum;
}

}  // namespace embrun
