// The body of field_sums.h for one instruction set: a .cpp defines EMBRUN_FIELD_SUMS (the table's name) and
// includes this. It uses only what is inlined, so that no code for one set can be linked into another.

#include "geometry/field_sums.h"
#include "geometry/kernel_lanes.h"

namespace embrun {
namespace {

EMBRUN_FN float squared_support(Kernel kernel) { return square(kernel_support(kernel)); }

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

/// Particles one after the other in blocks of sixteen.
class Packer {
 public:
  explicit Packer(ParticleBlock* packed) : packed_(packed) {}
  void take(const ParticleBlock& from, int lane) {
    ParticleBlock& block = packed_[count_ / 16];
    const std::size_t to = count_ % 16;
    block.x[to] = from.x[lane];
    block.y[to] = from.y[lane];
    block.z[to] = from.z[lane];
    block.inverse_influence_squared[to] = from.inverse_influence_squared[lane];
    block.weight[to] = from.weight[lane];
    ++count_;
  }
  void take_all(const ParticleBlock& from, std::uint32_t lanes) {
    for (; lanes != 0; lanes &= lanes - 1) take(from, __builtin_ctz(lanes));
  }
  /// Fills the last block up with what weighs nothing.
  std::size_t finish() {
    const std::size_t count = count_;
    if (count % 16 == 0) return count;
    const ParticleBlock last = packed_[count / 16];
    while (count_ % 16 != 0) {
      take(last, 0);
      packed_[(count_ - 1) / 16].weight[(count_ - 1) % 16] = 0.0f;
    }
    return count;
  }

 private:
  ParticleBlock* packed_;
  std::size_t count_ = 0;
};

/// Bit i: the particle in lane i may be felt in the box.
EMBRUN_FN std::uint32_t felt_in(const ParticleBlock& block, float support_squared, Vec3 low, Vec3 high) {
  const F16 x = load16(block.x), y = load16(block.y), z = load16(block.z), zero = splat(0.0f);
  const F16 dx = max_of(max_of(low.x - x, x - high.x), zero);
  const F16 dy = max_of(max_of(low.y - y, y - high.y), zero);
  const F16 dz = max_of(max_of(low.z - z, z - high.z), zero);
  const F16 q = (dx * dx + dy * dy + dz * dz) * load16(block.inverse_influence_squared);
  return mask_less(q, splat(support_squared)) & mask_less(zero, load16(block.weight));
}

EMBRUN_FN std::uint32_t in_shell(const ParticleBlock& block, Vec3 center, float begin, float end) {
  const F16 dx = load16(block.x) - center.x, dy = load16(block.y) - center.y, dz = load16(block.z) - center.z;
  const F16 q = (dx * dx + dy * dy + dz * dz) * load16(block.inverse_influence_squared);
  return ~mask_less(q, splat(begin * begin)) & mask_less(q, splat(end * end));
}

std::size_t pack(Kernel kernel, const BlockList& list, Vec3 low, Vec3 high, ParticleBlock* packed) {
  const float support_squared = squared_support(kernel);
  Packer packer(packed);
  for (std::size_t n = 0; n < list.count; ++n) {
    const ParticleBlock& block = list.blocks[list.near[n]];
    packer.take_all(block, felt_in(block, support_squared, low, high));
  }
  return packer.finish();
}

std::size_t repack(Kernel kernel, const PackedParticles& particles, Vec3 low, Vec3 high, float shell_begin,
                   float shell_end, ParticleBlock* packed) {
  const float support_squared = squared_support(kernel);
  const Vec3 center = 0.5f * (low + high);
  Packer packer(packed);
  for (std::size_t n = 0; n < particles.block_count(); ++n) {
    const ParticleBlock& block = particles.blocks[n];
    packer.take_all(block,
                    felt_in(block, support_squared, low, high) & in_shell(block, center, shell_begin, shell_end));
  }
  return packer.finish();
}

template <Kernel kernel>
FieldSlope sum_slope(const PackedParticles& particles, Vec3 p, int axis) {
  F16 value = splat(0.0f), slope = value;
  for (std::size_t n = 0; n < particles.block_count(); ++n) {
    const ParticleBlock& block = particles.blocks[n];
    const F16 scale_squared = load16(block.inverse_influence_squared), weight = load16(block.weight);
    const F16 dx = p.x - load16(block.x), dy = p.y - load16(block.y), dz = p.z - load16(block.z);
    F16 f, pull, inverse;
    KernelLanes<kernel>::value_and_pull((dx * dx + dy * dy + dz * dz) * scale_squared, f, pull, inverse);
    value += weight * f;
    slope -= pull * weight * scale_squared * (axis == 0 ? dx : axis == 1 ? dy : dz);
  }
  return {sum_lanes(value), sum_lanes(slope)};
}

template <Kernel kernel, NormalMode mode>
FieldNormal sum_normal(const PackedParticles& particles, Vec3 p) {
  F16 value = splat(0.0f), nx = value, ny = value, nz = value;
  for (std::size_t n = 0; n < particles.block_count(); ++n) {
    const ParticleBlock& block = particles.blocks[n];
    const F16 scale_squared = load16(block.inverse_influence_squared), weight = load16(block.weight);
    const F16 dx = p.x - load16(block.x), dy = p.y - load16(block.y), dz = p.z - load16(block.z);
    F16 f, pull, inverse;
    KernelLanes<kernel>::value_and_pull((dx * dx + dy * dy + dz * dz) * scale_squared, f, pull, inverse);
    f = f * weight;
    // 1/|x - p| = inverse / b.
    const F16 away =
        mode == NormalMode::weighted ? f * inverse * sqrt_of(scale_squared) : pull * weight * scale_squared;
    value += f;
    nx += away * dx;
    ny += away * dy;
    nz += away * dz;
  }
  return {sum_lanes(value), {sum_lanes(nx), sum_lanes(ny), sum_lanes(nz)}};
}

/// One particle at a time against the four layers of sixteen points.
template <Kernel kernel>
void sum_lattice(const PackedParticles& particles, Vec3 corner, float cell, float* values) {
  float column[16], row[16];
  for (int i = 0; i < 16; ++i) {
    column[i] = corner.x + cell * static_cast<float>(i % lattice_side);
    row[i] = corner.y + cell * static_cast<float>(i / lattice_side);
  }
  const F16 columns = load16(column), rows = load16(row);
  F16 sum[lattice_side];
  for (int k = 0; k < lattice_side; ++k) sum[k] = load16(values + 16 * k);
  for (std::size_t n = 0; n < particles.count; ++n) {
    const ParticleBlock& block = particles.blocks[n / 16];
    const std::size_t lane = n % 16;
    const F16 dx = columns - block.x[lane], dy = rows - block.y[lane];
    const F16 beside = dx * dx + dy * dy;
    const float scale_squared = block.inverse_influence_squared[lane], weight = block.weight[lane];
    for (int k = 0; k < lattice_side; ++k) {
      const float dz = corner.z + cell * static_cast<float>(k) - block.z[lane];
      sum[k] += weight * KernelLanes<kernel>::value((beside + dz * dz) * scale_squared);
    }
  }
  for (int k = 0; k < lattice_side; ++k) store16(values + 16 * k, sum[k]);
}

template <Kernel kernel>
FieldBound sum_bound(const PackedParticles& particles, Vec3 center, float within) {
  const F16 zero = splat(0.0f);
  F16 value = zero, gx = zero, gy = zero, gz = zero, rise = zero, fall = zero;
  for (std::size_t n = 0; n < particles.block_count(); ++n) {
    const ParticleBlock& block = particles.blocks[n];
    const F16 scale_squared = load16(block.inverse_influence_squared);
    const F16 dx = center.x - load16(block.x), dy = center.y - load16(block.y), dz = center.z - load16(block.z);
    const F16 q = (dx * dx + dy * dy + dz * dz) * scale_squared;
    F16 f, pull, inverse;
    KernelLanes<kernel>::value_and_pull(q, f, pull, inverse);
    const CurvatureLanes bend = KernelLanes<kernel>::curvature_within(q * inverse, sqrt_of(scale_squared) * within);
    const F16 weight = load16(block.weight), scale = weight * scale_squared;
    value += weight * f;
    pull = pull * scale;
    gx -= pull * dx;
    gy -= pull * dy;
    gz -= pull * dz;
    rise += bend.up * scale;
    fall += bend.down * scale;
  }
  return {sum_lanes(value), {sum_lanes(gx), sum_lanes(gy), sum_lanes(gz)}, sum_lanes(rise), sum_lanes(fall)};
}

template <Kernel kernel>
float sum_most(const PackedParticles& particles, Vec3 low, Vec3 high) {
  const F16 zero = splat(0.0f);
  F16 sum = zero;
  for (std::size_t n = 0; n < particles.block_count(); ++n) {
    const ParticleBlock& block = particles.blocks[n];
    const F16 x = load16(block.x), y = load16(block.y), z = load16(block.z);
    const F16 dx = max_of(max_of(low.x - x, x - high.x), zero);
    const F16 dy = max_of(max_of(low.y - y, y - high.y), zero);
    const F16 dz = max_of(max_of(low.z - z, z - high.z), zero);
    const F16 q = (dx * dx + dy * dy + dz * dz) * load16(block.inverse_influence_squared);
    sum += load16(block.weight) * KernelLanes<kernel>::value(q);
  }
  return sum_lanes(sum);
}

/// `body.operator()<kernel>()`
template <class Body>
EMBRUN_FN auto with_kernel(Kernel kernel, const Body& body) {
  switch (kernel) {
    case Kernel::metaball: return body.template operator()<Kernel::metaball>();
    case Kernel::zhu_bridson: return body.template operator()<Kernel::zhu_bridson>();
    case Kernel::blinn: break;
  }
  return body.template operator()<Kernel::blinn>();
}

void dispatch_values(Kernel kernel, const BlockList& list, const float* x, const float* y, const float* z, float enough,
                     float* values) {
  with_kernel(kernel, [&]<Kernel k>() { sum_values<k>(list, x, y, z, enough, values); });
}
FieldSlope dispatch_slope(Kernel kernel, const PackedParticles& particles, Vec3 point, int axis) {
  return with_kernel(kernel, [&]<Kernel k>() { return sum_slope<k>(particles, point, axis); });
}
FieldNormal dispatch_normal(Kernel kernel, NormalMode mode, const PackedParticles& particles, Vec3 point) {
  return with_kernel(kernel, [&]<Kernel k>() {
    return mode == NormalMode::weighted ? sum_normal<k, NormalMode::weighted>(particles, point)
                                        : sum_normal<k, NormalMode::gradient>(particles, point);
  });
}
void dispatch_lattice(Kernel kernel, const PackedParticles& particles, Vec3 corner, float cell, float* values) {
  with_kernel(kernel, [&]<Kernel k>() { sum_lattice<k>(particles, corner, cell, values); });
}
FieldBound dispatch_bound(Kernel kernel, const PackedParticles& particles, Vec3 center, float within) {
  return with_kernel(kernel, [&]<Kernel k>() { return sum_bound<k>(particles, center, within); });
}
float dispatch_most(Kernel kernel, const PackedParticles& particles, Vec3 low, Vec3 high) {
  return with_kernel(kernel, [&]<Kernel k>() { return sum_most<k>(particles, low, high); });
}

}  // namespace

extern const FieldSums EMBRUN_FIELD_SUMS;
const FieldSums EMBRUN_FIELD_SUMS{dispatch_values,  pack,           repack,       dispatch_slope, dispatch_normal,
                                  dispatch_lattice, dispatch_bound, dispatch_most};

}  // namespace embrun
