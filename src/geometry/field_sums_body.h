// The body of field_sums.h for one instruction set: a .cpp defines EMBRUN_FIELD_SUMS (the table's name) and
// includes this. It uses only what is inlined, so that no code for one set can be linked into another.

#include "geometry/field_sums.h"
#include "geometry/kernel_lanes.h"

namespace embrun {
namespace {

EMBRUN_FN float squared_support(Kernel kernel) { return square(kernel_support(kernel)); }

EMBRUN_FN bool felt_at(const ReachBox& bounds, Vec3 p) { return bounds.distance_squared(p, p) < square(bounds.reach); }

/// One particle at a time against sixteen points.
template <Kernel kernel>
void sum_values(const BlockList& list, const float* x, const float* y, const float* z, float enough, float* values) {
  const F16 px = load16(x), py = load16(y), pz = load16(z);
  F16 sum = splat(0.0f);
  for (std::size_t n = 0; n < list.count; ++n) {
    const ParticleBlock& block = list.blocks[list.near[n]];
    for (int lane = 0; lane < 16; ++lane) {
      const F16 dx = px - block.x[lane], dy = py - block.y[lane], dz = pz - block.z[lane];
      const F16 q = (dx * dx + dy * dy + dz * dz) * block.inverse_influence_squared[lane];
      sum += block.weight[lane] * KernelLanes<kernel>::value(q);
    }
    if (n % 4 == 3 && min_lane(sum) >= enough) break;
  }
  store16(values, sum);
}

template <Kernel kernel>
void sum_samples(const BlockList& list, const Vec3* points, std::size_t point_count, FieldSample* samples) {
  for (std::size_t i = 0; i < point_count; ++i) {
    const Vec3 p = points[i];
    const F16 zero = splat(0.0f);
    F16 value = zero, gx = zero, gy = zero, gz = zero, nx = zero, ny = zero, nz = zero;
    for (std::size_t n = 0; n < list.count; ++n) {
      const std::uint32_t b = list.near[n];
      if (!felt_at(list.bounds[b], p)) continue;
      const ParticleBlock& block = list.blocks[b];
      const F16 scale_squared = load16(block.inverse_influence_squared);
      const F16 dx = p.x - load16(block.x), dy = p.y - load16(block.y), dz = p.z - load16(block.z);
      const F16 distance_squared = dx * dx + dy * dy + dz * dz;
      F16 f, pull, inverse;
      KernelLanes<kernel>::value_and_pull(distance_squared * scale_squared, f, pull, inverse);
      const F16 weight = load16(block.weight);
      f = f * weight;
      pull = pull * weight * scale_squared;
      inverse = rsqrt_of(max_of(distance_squared, splat(1e-30f)));
      value += f;
      gx -= pull * dx;
      gy -= pull * dy;
      gz -= pull * dz;
      const F16 away = f * inverse;
      nx += away * dx;
      ny += away * dy;
      nz += away * dz;
    }
    samples[i].value = sum_lanes(value);
    samples[i].gradient = {sum_lanes(gx), sum_lanes(gy), sum_lanes(gz)};
    samples[i].weighted = {sum_lanes(nx), sum_lanes(ny), sum_lanes(nz)};
  }
}

/// Two rows of eight points make the sixteen lanes; pairs of rows that a particle does not reach are skipped.
template <Kernel kernel>
void sum_lattice(const BlockList& list, Vec3 corner, float cell, float* values) {
  const float support_squared = squared_support(kernel);
  const float side = cell * (lattice_side - 1);
  float column[16], row[16];
  for (int i = 0; i < 16; ++i) {
    column[i] = corner.x + cell * static_cast<float>(i % lattice_side);
    row[i] = i < lattice_side ? 0.0f : cell;
  }
  const F16 columns = load16(column), second_row = load16(row);
  for (std::size_t n = 0; n < list.count; ++n) {
    const ParticleBlock& block = list.blocks[list.near[n]];
    for (int lane = 0; lane < 16; ++lane) {
      const Vec3 p{block.x[lane], block.y[lane], block.z[lane]};
      const float scale_squared = block.inverse_influence_squared[lane], weight = block.weight[lane];
      const float reach_squared = support_squared / scale_squared;
      const Vec3 gap = max_of(Vec3{}, max_of(corner - p, p - corner - Vec3{side, side, side}));
      if (weight == 0.0f || length_squared(gap) >= reach_squared) continue;
      const F16 dx = columns - p.x;
      const F16 dx_squared = dx * dx;
      for (int k = 0; k < lattice_side; ++k) {
        const float dz = corner.z + cell * static_cast<float>(k) - p.z;
        if (square(gap.x) + square(dz) >= reach_squared) continue;
        for (int j = 0; j < lattice_side; j += 2) {
          const float y = corner.y + cell * static_cast<float>(j) - p.y;
          const float nearest = max_of(0.0f, max_of(y, -y - cell));
          if (square(gap.x) + square(nearest) + square(dz) >= reach_squared) continue;
          const F16 dy = second_row + y;
          const F16 q = (dx_squared + dy * dy + square(dz)) * scale_squared;
          float* out = values + (k * lattice_side + j) * lattice_side;
          store16(out, load16(out) + weight * KernelLanes<kernel>::value(q));
        }
      }
    }
  }
}

template <Kernel kernel>
float sum_most(const BlockList& list, Vec3 low, Vec3 high) {
  const F16 zero = splat(0.0f);
  F16 sum = zero;
  for (std::size_t n = 0; n < list.count; ++n) {
    const ParticleBlock& block = list.blocks[list.near[n]];
    const F16 x = load16(block.x), y = load16(block.y), z = load16(block.z);
    const F16 dx = max_of(max_of(low.x - x, x - high.x), zero);
    const F16 dy = max_of(max_of(low.y - y, y - high.y), zero);
    const F16 dz = max_of(max_of(low.z - z, z - high.z), zero);
    const F16 q = (dx * dx + dy * dy + dz * dz) * load16(block.inverse_influence_squared);
    sum += load16(block.weight) * KernelLanes<kernel>::value(q);
  }
  return sum_lanes(sum);
}

void dispatch_values(Kernel kernel, const BlockList& list, const float* x, const float* y, const float* z, float enough,
                     float* values) {
  switch (kernel) {
    case Kernel::metaball: return sum_values<Kernel::metaball>(list, x, y, z, enough, values);
    case Kernel::zhu_bridson: return sum_values<Kernel::zhu_bridson>(list, x, y, z, enough, values);
    case Kernel::blinn: return sum_values<Kernel::blinn>(list, x, y, z, enough, values);
  }
}

void dispatch_samples(Kernel kernel, const BlockList& list, const Vec3* points, std::size_t point_count,
                      FieldSample* samples) {
  switch (kernel) {
    case Kernel::metaball: return sum_samples<Kernel::metaball>(list, points, point_count, samples);
    case Kernel::zhu_bridson: return sum_samples<Kernel::zhu_bridson>(list, points, point_count, samples);
    case Kernel::blinn: return sum_samples<Kernel::blinn>(list, points, point_count, samples);
  }
}

void dispatch_lattice(Kernel kernel, const BlockList& list, Vec3 corner, float cell, float* values) {
  switch (kernel) {
    case Kernel::metaball: return sum_lattice<Kernel::metaball>(list, corner, cell, values);
    case Kernel::zhu_bridson: return sum_lattice<Kernel::zhu_bridson>(list, corner, cell, values);
    case Kernel::blinn: return sum_lattice<Kernel::blinn>(list, corner, cell, values);
  }
}

float dispatch_most(Kernel kernel, const BlockList& list, Vec3 low, Vec3 high) {
  switch (kernel) {
    case Kernel::metaball: return sum_most<Kernel::metaball>(list, low, high);
    case Kernel::zhu_bridson: return sum_most<Kernel::zhu_bridson>(list, low, high);
    case Kernel::blinn: return sum_most<Kernel::blinn>(list, low, high);
  }
  return 0.0f;
}

}  // namespace

extern const FieldSums EMBRUN_FIELD_SUMS;
const FieldSums EMBRUN_FIELD_SUMS{dispatch_values, dispatch_samples, dispatch_lattice, dispatch_most};

}  // namespace embrun
