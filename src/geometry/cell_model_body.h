// The loops of cell_model.h. Included by one source file for each instruction set, which defines the name
// EMBRUN_CELL_MODEL of its table. Uses no function with external linkage, so that nothing compiled here for one
// instruction set can stand in for the same function compiled for another.

#include "geometry/cell_model.h"
#include "geometry/kernel_lanes.h"
#include "math/lanes.h"

namespace embrun {

namespace {

// Bounds on the second derivatives of a kernel around a particle, in units of its influence radius.

/// Range of one axis' second derivative over a box.
struct AxisRange {
  F16 least, most;
};

template <Kernel kernel>
struct AxisCurvature;

template <>
struct AxisCurvature<Kernel::metaball> {
  /// d^2 f/dk^2 = 3 (1 - rho^2/u^3) for 1/3 <= u <= 1, with rho the distance from the particle's k axis and a the
  /// distance along it: u^2 = rho^2 + a^2. For given a it falls and then rises in rho^2, least at rho^2 = 2 a^2.
  static EMBRUN_FN AxisRange axis(F16 a_least, F16 a_most, F16 rho_least, F16 rho_most) {
    const F16 u_least = a_least * a_least + rho_least * rho_least;
    const F16 u_most = a_most * a_most + rho_most * rho_most;
    // Most: the far end of a, either end of rho; beyond the support it is 0, and rho^2/u^3 >= rho^2 within.
    const F16 one = splat(1.0f), zero = splat(0.0f);
    const F16 ratio_near = ratio(rho_least, a_most);
    const F16 ratio_far = ratio(rho_most, a_most);
    F16 most = 3.0f * (1.0f - min_of(ratio_near, ratio_far));
    most = min_of(most, 3.0f * (1.0f - rho_least * rho_least));
    // A box that leaves the support contains 0.
    most = select_less(one, u_most, max_of(most, zero), most);
    most = select_less(u_least, one, most, zero);
    // Least: the near end of a, where rho^2 = 2 a^2 if the box has it, else an end of rho. -6 in the core.
    const F16 two_a = 2.0f * a_least * a_least;
    const F16 worst = min_of(max_of(two_a, rho_least * rho_least), rho_most * rho_most);
    const F16 u2 = max_of(worst + a_least * a_least, splat(1.0f / 9.0f));
    F16 least = 3.0f * (1.0f - worst * (1.00001f / (u2 * sqrt_of(u2))));
    // With u kept at 1/3 or more the ratio may still be larger nearer the particle: -6 is the floor there.
    least = select_less(u_least, splat(1.0f / 9.0f), splat(-6.0f), max_of(least, splat(-6.0f)));
    least = select_less(one, u_most, min_of(least, zero), least);
    least = select_less(u_least, one, least, zero);
    return {least, most};
  }

 private:
  static EMBRUN_FN F16 ratio(F16 rho, F16 a) {
    const F16 square = rho * rho;
    const F16 u2 = max_of(square + a * a, splat(1.0f / 9.0f));
    return square * (0.99999f / (u2 * sqrt_of(u2)));
  }
};

template <>
struct AxisCurvature<Kernel::zhu_bridson> {
  /// -6 w^2 + 24 a^2 w with w = 1 - u^2.
  static EMBRUN_FN AxisRange axis(F16 a_least, F16 a_most, F16 rho_least, F16 rho_most) {
    const F16 w_most = max_of(1.0f - (a_least * a_least + rho_least * rho_least), splat(0.0f));
    const F16 w_least = max_of(1.0f - (a_most * a_most + rho_most * rho_most), splat(0.0f));
    return {24.0f * a_least * a_least * w_least - 6.0f * w_most * w_most,
            24.0f * a_most * a_most * w_most - 6.0f * w_least * w_least};
  }
};

template <>
struct AxisCurvature<Kernel::blinn> {
  /// (4 k^2 a^2 - 2k) S exp(-k u^2) + 2k S c inside the support; the last term, which is small, counts for `most` alone.
  static EMBRUN_FN AxisRange axis(F16 a_least, F16 a_most, F16 rho_least, F16 rho_most) {
    constexpr float k = blinn_exponent;
    const F16 zero = splat(0.0f);
    const F16 q_least = a_least * a_least + rho_least * rho_least;
    const F16 q_most = a_most * a_most + rho_most * rho_most;
    const F16 cut = splat(blinn_support * blinn_support);
    const F16 gauss_most = select_less(q_least, cut, exp_of(q_least * -k) * 1.00798f, zero);
    const F16 gauss_least = select_less(q_most, cut, exp_of(q_most * -k), zero);
    const F16 low = 4.0f * k * k * a_least * a_least - 2.0f * k;
    const F16 high = 4.0f * k * k * a_most * a_most - 2.0f * k;
    return {select_less(low, zero, low * gauss_most, low * gauss_least),
            select_less(high, zero, high * gauss_least, high * gauss_most) +
                select_less(q_least, cut, splat(2.0f * k * blinn_scale * 1.00001f), zero)};
  }
};

/// Squared distance of sixteen points from the box center +- half.
EMBRUN_FN F16 box_distance_squared(F16 x, F16 y, F16 z, Vec3 center, float half) {
  const F16 zero = splat(0.0f);
  const F16 dx = max_of(max_of(x - (center.x + half), (center.x - half) - x), zero);
  const F16 dy = max_of(max_of(y - (center.y + half), (center.y - half) - y), zero);
  const F16 dz = max_of(max_of(z - (center.z + half), (center.z - half) - z), zero);
  return dx * dx + dy * dy + dz * dz;
}

/// Sixteen far particles after the last one, so that loops over whole blocks read nothing stale.
void pad(const CellFrame& frame, const ParticleArrays& list, std::size_t count) {
  for (std::size_t i = 0; i < 16; ++i) {
    list.x[count + i] = list.y[count + i] = list.z[count + i] = 1e15f;
    if (!frame.equal_radii) list.reach[count + i] = 1.0f;
  }
}

/// Which of particles i to i + 15 (of `count`) have a < b.
EMBRUN_FN std::uint32_t valid_less(std::size_t i, std::size_t count, F16 a, F16 b) {
  const std::size_t valid = count - i < 16 ? count - i : 16;
  return mask_less(a, b) & ((1u << valid) - 1u);
}

/// Appends those of particles i to i + 15 whose bits are set to `out`, in order.
EMBRUN_FN void append(const CellFrame& frame, const ParticleArrays& in, std::size_t i, std::uint32_t mask,
                      const ParticleArrays& out, std::size_t& kept) {
  compress_store16(out.x + kept, load16(in.x + i), mask);
  compress_store16(out.y + kept, load16(in.y + i), mask);
  compress_store16(out.z + kept, load16(in.z + i), mask);
  if (!frame.equal_radii) compress_store16(out.reach + kept, load16(in.reach + i), mask);
  kept += static_cast<std::size_t>(__builtin_popcount(mask));
}

/// Which of particles i to i + 15 (of `count`) are felt in the box center +- half.
EMBRUN_FN std::uint32_t felt_in_box(const CellFrame& frame, const ParticleArrays& in, std::size_t i, std::size_t count,
                                    Vec3 center, float half) {
  const F16 distance = box_distance_squared(load16(in.x + i), load16(in.y + i), load16(in.z + i), center, half);
  const F16 reach = frame.equal_radii ? splat(frame.reach) : load16(in.reach + i);
  return valid_less(i, count, distance, reach * reach);
}

std::size_t gather(const CellFrame& frame, const ParticleArrays& in, std::size_t count, Vec3 center, float half,
                   const ParticleArrays& out) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; i += 16)
    append(frame, in, i, felt_in_box(frame, in, i, count, center, half), out, kept);
  return kept;
}

void mark(const CellFrame& frame, const ParticleArrays& in, std::size_t count, Vec3 center, float half,
          std::uint8_t bit, std::uint8_t* marks) {
  for (std::size_t i = 0; i < count; i += 16) {
    for (std::uint32_t felt = felt_in_box(frame, in, i, count, center, half); felt != 0; felt &= felt - 1) {
      std::uint8_t& marked = marks[i + static_cast<std::size_t>(lowest_bit(felt))];
      marked = static_cast<std::uint8_t>(marked | bit);
    }
  }
}

/// Bounds on the field D (not divided by T) over a cell.
struct FieldBounds {
  float least, most;
};

/// Bounds by value, gradient and curvature at the centres of the cell's eight octants: cheap, and enough for most
/// of the cells deep inside and far outside. Lanes 0-7 are the octants for one particle, 8-15 for the next.
template <Kernel kernel>
FieldBounds octant_bounds(const CellFrame& frame, const ParticleArrays& list, std::size_t count, Vec3 center,
                          float half) {
  float px[16], py[16], pz[16], index[16];
  const float offset = 0.5f * half;
  for (int i = 0; i < 16; ++i) {
    index[i] = static_cast<float>(i);
    px[i] = center.x + ((i & 1) != 0 ? offset : -offset);
    py[i] = center.y + ((i & 2) != 0 ? offset : -offset);
    pz[i] = center.z + ((i & 4) != 0 ? offset : -offset);
  }
  const F16 ox = load16(px), oy = load16(py), oz = load16(pz), lane = load16(index), eight = splat(8.0f);
  const float scale = frame.support / frame.reach;
  // Half the diagonal of an octant, in units of b.
  const float h = 0.8660255f * half * scale;
  F16 value = splat(0.0f), gx = value, gy = value, gz = value, down = value, up = value;
  for (std::size_t i = 0; i < count; i += 2) {
    const auto pair = [&](const float* v) { return select_less(lane, eight, splat(v[i]), splat(v[i + 1])); };
    const F16 x = (pair(list.x) - ox) * scale, y = (pair(list.y) - oy) * scale, z = (pair(list.z) - oz) * scale;
    const F16 q = max_of(x * x + y * y + z * z, splat(1e-12f));
    F16 f, pull, inverse;
    KernelLanes<kernel>::value_and_pull(q, f, pull, inverse);
    value += f;
    gx += pull * x, gy += pull * y, gz += pull * z;
    const CurvatureLanes<F16> bend = KernelLanes<kernel>::curvature_within(q * inverse, splat(h));
    down += bend.down;
    up += bend.up;
  }
  float v[16], x[16], y[16], z[16], below[16], above[16];
  store16(v, value), store16(x, gx), store16(y, gy), store16(z, gz), store16(below, down), store16(above, up);
  FieldBounds bounds{infinity, -infinity};
  for (int i = 0; i < 8; ++i) {
    const float slope = length(Vec3{x[i] + x[i + 8], y[i] + y[i + 8], z[i] + z[i + 8]});
    const float d = v[i] + v[i + 8];
    bounds.least = min_of(bounds.least, d - slope * h - 0.5f * h * h * (below[i] + below[i + 8]));
    bounds.most = max_of(bounds.most, d + slope * h + 0.5f * h * h * (above[i] + above[i + 8]));
  }
  return bounds;
}

/// What one pass over a cell's particles tells.
struct FirstLook {
  float most;       ///< the field if every particle were as near as the cell lets it be
  float at_center;  ///< the field of the nearer particles at the cell's centre
};

/// The first look, which also copies the particles within `near_share` of their reach to `near`.
template <Kernel kernel>
FirstLook first_look(const CellFrame& frame, const ParticleArrays& list, std::size_t count, Vec3 center, float half,
                     float near_share, const ParticleArrays& near, std::size_t& near_count) {
  F16 most = splat(0.0f), at_center = most, scale = splat(frame.support / frame.reach);
  const float limit = square(near_share * frame.support);
  for (std::size_t i = 0; i < count; i += 16) {
    const F16 x = load16(list.x + i), y = load16(list.y + i), z = load16(list.z + i);
    if (!frame.equal_radii) scale = frame.support / load16(list.reach + i);
    const F16 distance = box_distance_squared(x, y, z, center, half) * (scale * scale);
    most += KernelLanes<kernel>::value(distance);
    append(frame, list, i, valid_less(i, count, distance, splat(limit)), near, near_count);
  }
  pad(frame, near, near_count);
  scale = splat(frame.support / frame.reach);
  for (std::size_t i = 0; i < near_count; i += 16) {
    const F16 x = load16(near.x + i) - center.x, y = load16(near.y + i) - center.y, z = load16(near.z + i) - center.z;
    if (!frame.equal_radii) scale = frame.support / load16(near.reach + i);
    at_center += KernelLanes<kernel>::value((x * x + y * y + z * z) * (scale * scale));
  }
  return {sum_lanes(most), sum_lanes(at_center)};
}

/// The nodes at which a cell's field is sampled: edge^3, x fastest, faces included, in cell sides from the centre. The
/// last block is padded by repeating the last node.
template <int edge>
struct alignas(64) NodeTable {
  static constexpr int count = edge * edge * edge, blocks = (count + 15) / 16;
  float x[16 * blocks], y[16 * blocks], z[16 * blocks];
  float square[16 * blocks];  ///< x^2 + y^2 + z^2
  float weight[16 * blocks];  ///< 0 for those that repeat

  constexpr NodeTable() : x(), y(), z(), square(), weight() {
    for (int i = 0; i < 16 * blocks; ++i) {
      const int node = i < count ? i : count - 1;
      constexpr float step = 1.0f / (edge - 1);
      x[i] = static_cast<float>(node % edge) * step - 0.5f;
      y[i] = static_cast<float>(node / edge % edge) * step - 0.5f;
      z[i] = static_cast<float>(node / (edge * edge)) * step - 0.5f;
      square[i] = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
      weight[i] = i < count ? 1.0f : 0.0f;
    }
  }
};

template <int edge>
constexpr NodeTable<edge> nodes{};

/// D at the nodes of a cell.
template <int edge>
struct NodeSamples {
  static constexpr int blocks = NodeTable<edge>::blocks;
  F16 block[blocks];
};

/// Particles from a cell's centre, in units of their own b: node n of a cell of side s is at the squared distance
/// |n|^2 s^2 + |p|^2 + n . towards, towards = -2 s p.
struct NodeSources {
  static constexpr std::size_t room = 64;
  std::size_t count = 0;
  float side_square[room], square[room], x[room], y[room], z[room];

  EMBRUN_FN void add(Vec3 p, float side) {
    const float twice = -2.0f * side;
    side_square[count] = side * side;
    square[count] = dot(p, p);
    x[count] = p.x * twice;
    y[count] = p.y * twice;
    z[count] = p.z * twice;
    ++count;
  }
};

/// Adds the sources' kernel at the nodes; `beyond`: all nodes are beyond the cores of all sources.
template <bool beyond, int edge, Kernel kernel>
void add_at_nodes(NodeSources& from, F16* block) {
  for (int k = 0; k < NodeTable<edge>::blocks; ++k) {
    const F16 x = load16(nodes<edge>.x + 16 * k), y = load16(nodes<edge>.y + 16 * k),
              z = load16(nodes<edge>.z + 16 * k);
    const F16 square = load16(nodes<edge>.square + 16 * k);
    F16 sum = block[k];
    for (std::size_t i = 0; i < from.count; ++i) {
      const F16 q = square * from.side_square[i] + from.square[i] + x * from.x[i] + y * from.y[i] + z * from.z[i];
      sum += beyond ? KernelLanes<kernel>::value_beyond_core(q) : KernelLanes<kernel>::rough_value(q);
    }
    block[k] = sum;
  }
  from.count = 0;
}

template <int edge, Kernel kernel>
NodeSamples<edge> sample_nodes(const CellFrame& frame, const ParticleArrays& list, std::size_t count, Vec3 center,
                               float half) {
  NodeSamples<edge> s{};
  const float side = 2.0f * half, gap = side / (edge - 1);
  const float equal_scale = frame.support / frame.reach;
  NodeSources cores, others;
  for (std::size_t i = 0; i < count; ++i) {
    float scale = equal_scale;
    if (!frame.equal_radii) {
      if (list.reach[i] < gap) continue;
      scale = frame.support / list.reach[i];
    }
    const Vec3 p = Vec3{list.x[i] - center.x, list.y[i] - center.y, list.z[i] - center.z} * scale;
    const float side_here = side * scale;
    const float away = max_of(max_of(fabsf(p.x), fabsf(p.y)), fabsf(p.z)) - 0.5f * side_here;
    if (away > KernelLanes<kernel>::core) {
      others.add(p, side_here);
      if (others.count == NodeSources::room) add_at_nodes<true, edge, kernel>(others, s.block);
    } else {
      cores.add(p, side_here);
      if (cores.count == NodeSources::room) add_at_nodes<false, edge, kernel>(cores, s.block);
    }
  }
  add_at_nodes<true, edge, kernel>(others, s.block);
  add_at_nodes<false, edge, kernel>(cores, s.block);
  return s;
}

/// Ranges of the second derivatives of D along the axes.
struct CurvatureRanges {
  float least[3], most[3];  ///< in units of 1 / (cell side)^2
  float small_maximum;      ///< what particles too small for the nodes may add to D anywhere
};

/// Over the box center +- half, which is a cell of half `cell_half` or a part of one: sums of the particles' ranges.
/// Particles that reach less than `gap` are too small for the nodes.
template <Kernel kernel>
CurvatureRanges curvature_ranges(const CellFrame& frame, const ParticleArrays& list, std::size_t count, Vec3 center,
                                 float half, float cell_half, float gap) {
  const float equal_scale = frame.support / frame.reach;
  F16 least[3] = {splat(0.0f), splat(0.0f), splat(0.0f)};
  F16 most[3] = {splat(0.0f), splat(0.0f), splat(0.0f)};
  F16 small = splat(0.0f);
  for (std::size_t i = 0; i < count; i += 16) {
    F16 scale = splat(equal_scale);
    F16 used = splat(1.0f);
    if (!frame.equal_radii) {
      const F16 reach = load16(list.reach + i);
      scale = frame.support / reach;
      used = select_less(reach, splat(gap), splat(0.0f), splat(1.0f));
    }
    float valid[16];
    for (std::size_t j = 0; j < 16; ++j) valid[j] = i + j < count ? 1.0f : 0.0f;
    const F16 real = load16(valid);
    small += real * (1.0f - used);
    used = used * real;
    F16 near_side[3], far_side[3];
    const float* coordinate[3] = {list.x, list.y, list.z};
    for (int a = 0; a < 3; ++a) {
      const F16 d = load16(coordinate[a] + i) - center[a];
      const F16 size = max_of(d, 0.0f - d);
      near_side[a] = max_of(size - half, splat(0.0f)) * scale;
      far_side[a] = (size + half) * scale;
    }
    // Second derivatives per b^2, brought to per cell side squared.
    const F16 to_cell = used * (scale * scale) * (4.0f * cell_half * cell_half);
    for (int a = 0; a < 3; ++a) {
      const int b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
      const F16 near_square = near_side[b] * near_side[b] + near_side[c] * near_side[c];
      const F16 far_square = far_side[b] * far_side[b] + far_side[c] * far_side[c];
      const F16 rho_near = sqrt_of(near_square);
      const F16 rho_far = sqrt_of(far_square);
      const AxisRange range = AxisCurvature<kernel>::axis(near_side[a], far_side[a], rho_near, rho_far);
      least[a] += range.least * to_cell;
      most[a] += range.most * to_cell;
    }
  }
  return {{sum_lanes(least[0]), sum_lanes(least[1]), sum_lanes(least[2])},
          {sum_lanes(most[0]), sum_lanes(most[1]), sum_lanes(most[2])},
          sum_lanes(small)};
}

/// Between nodes h apart a function departs from its trilinear interpolation by at most h^2/8 times the sum over the
/// axes of its second derivative's bound (linear interpolation along one axis after the other).
template <int edge>
constexpr float node_gap = 1.0f / (8.0f * (edge - 1) * (edge - 1));

/// How far a function whose second derivatives along the axes are at most `most` may fall below the interpolation.
template <int edge>
float fall_between_nodes(const float most[3]) {
  return node_gap<edge> * (max_of(0.0f, most[0]) + max_of(0.0f, most[1]) + max_of(0.0f, most[2]));
}

template <int edge>
float least_node(const NodeSamples<edge>& s) {
  F16 least = s.block[0];
  for (int k = 1; k < s.blocks; ++k) least = min_of(least, s.block[k]);
  return min_lane(least);
}
template <int edge>
float most_node(const NodeSamples<edge>& s) {
  F16 most = s.block[0];
  for (int k = 1; k < s.blocks; ++k) most = max_of(most, s.block[k]);
  return max_lane(most);
}

/// Whether octant_bounds decide about most cells, for less than samples: where supports are large against them, as for
/// n >= 3.
bool octants_are_enough(const CellFrame& frame, float half) { return frame.equal_radii && frame.reach > 4.9f * half; }

/// Whether the given particles alone keep D above `level` all over the cell.
template <Kernel kernel>
bool proves_inside(const CellFrame& frame, const ParticleArrays& list, std::size_t count, Vec3 center, float half,
                   float level) {
  if (octants_are_enough(frame, half)) {
    const float least = octant_bounds<kernel>(frame, list, count, center, half).least;
    if (least > level) return true;
    if (least < 0.75f * level) return false;
  }
  constexpr int edge = 4;
  const NodeSamples<edge> s = sample_nodes<edge, kernel>(frame, list, count, center, half);
  const CurvatureRanges bend =
      curvature_ranges<kernel>(frame, list, count, center, half, half, 2.0f * half / (edge - 1));
  return least_node(s) - fall_between_nodes<edge>(bend.most) > level;
}

/// Least-squares quadratic through the nodes, coordinates in cell sides from the centre. On a product grid that is even
/// about 0 the monomials minus their means are orthogonal, so each coefficient is one sum.
template <int edge>
void fit_quadratic(const NodeSamples<edge>& s, float q[10]) {
  F16 sum[10];
  for (F16& v : sum) v = splat(0.0f);
  for (int k = 0; k < s.blocks; ++k) {
    const F16 x = load16(nodes<edge>.x + 16 * k), y = load16(nodes<edge>.y + 16 * k);
    const F16 z = load16(nodes<edge>.z + 16 * k);
    const F16 d = s.block[k] * load16(nodes<edge>.weight + 16 * k);
    const F16 dx = d * x, dy = d * y, dz = d * z;
    sum[0] += d;
    sum[1] += dx, sum[2] += dy, sum[3] += dz;
    sum[4] += dx * x, sum[5] += dy * y, sum[6] += dz * z;
    sum[7] += dx * y, sum[8] += dx * z, sum[9] += dy * z;
  }
  // Of edge evenly spaced points in [-1/2, 1/2]: the mean of x^2, and the variance of x^2.
  constexpr float last = edge - 1;
  constexpr float mean_square = (last + 2.0f) / (12.0f * last);
  constexpr float fourth = mean_square * (3.0f * last * last + 6.0f * last - 4.0f) / (20.0f * last * last);
  constexpr float spread = fourth - mean_square * mean_square;
  constexpr float count = NodeTable<edge>::count;
  const float all = sum_lanes(sum[0]);
  for (int i = 1; i < 4; ++i) q[i] = sum_lanes(sum[i]) / (count * mean_square);
  for (int i = 4; i < 7; ++i) q[i] = (sum_lanes(sum[i]) - mean_square * all) / (count * spread);
  for (int i = 7; i < 10; ++i) q[i] = sum_lanes(sum[i]) / (count * mean_square * mean_square);
  q[0] = all / count - mean_square * (q[4] + q[5] + q[6]);
}

/// The quadratic's values at the nodes.
template <int edge>
NodeSamples<edge> model_at_nodes(const float q[10]) {
  NodeSamples<edge> model;
  for (int k = 0; k < model.blocks; ++k) {
    const F16 x = load16(nodes<edge>.x + 16 * k), y = load16(nodes<edge>.y + 16 * k);
    const F16 z = load16(nodes<edge>.z + 16 * k);
    model.block[k] =
        q[0] + x * (q[1] + x * q[4] + y * q[7] + z * q[8]) + y * (q[2] + y * q[5] + z * q[9]) + z * (q[3] + z * q[6]);
  }
  return model;
}

/// Least and largest values at the eight corners of each of the boxes between a cell's nodes; the box with the low corner
/// at node n has number n.
template <int edge>
struct BoxBounds {
  static constexpr int size = 16 * NodeTable<edge>::blocks;
  float least[size], most[size];

  explicit BoxBounds(const NodeSamples<edge>& s) {
    for (int k = 0; k < s.blocks; ++k) store16(least + 16 * k, s.block[k]);
    for (int i = 0; i < size; ++i) most[i] = least[i];
    for (const int step : {1, edge, edge * edge}) {
      for (int i = 0; i + step < size; ++i) {
        least[i] = least[i] < least[i + step] ? least[i] : least[i + step];
        most[i] = most[i] > most[i + step] ? most[i] : most[i + step];
      }
    }
  }
};

/// Decides by samples at the nodes how a cell that may hold the surface stands to it, and fits its model.
template <int edge, Kernel kernel>
void sample_cell(const CellFrame& frame, const ParticleArrays& list, std::size_t count, Vec3 center, float half,
                 float rounding, SurfaceCell& cell) {
  const float threshold = 1.0f / frame.inverse_threshold;
  const float gap = 2.0f * half / (edge - 1);
  const NodeSamples<edge> s = sample_nodes<edge, kernel>(frame, list, count, center, half);
  const CurvatureRanges whole = curvature_ranges<kernel>(frame, list, count, center, half, half, gap);
  const float fall = fall_between_nodes<edge>(whole.most);
  const float opposite[3] = {-whole.least[0], -whole.least[1], -whole.least[2]};
  const float rise = fall_between_nodes<edge>(opposite) + whole.small_maximum;
  if (most_node(s) + rise + rounding < threshold) return;
  if (least_node(s) - fall - rounding > threshold) {
    cell.kind = SurfaceCellKind::inside;
    return;
  }

  float q[10];
  fit_quadratic(s, q);
  const NodeSamples<edge> model = model_at_nodes<edge>(q);
  NodeSamples<edge> difference;
  for (int k = 0; k < s.blocks; ++k) difference.block[k] = s.block[k] - model.block[k];
  const BoxBounds<edge> field(s), fit(model), residual(difference);
  const float bend[3] = {2.0f * q[4], 2.0f * q[5], 2.0f * q[6]}, back[3] = {-bend[0], -bend[1], -bend[2]};
  const float fit_fall = fall_between_nodes<edge>(bend), fit_rise = fall_between_nodes<edge>(back);

  // Only where the surface can be does it matter how far the model is off, and box by box it is known better. Octant by
  // octant so are the second derivatives.
  static_assert(edge % 2 == 1);
  constexpr int boxes = (edge - 1) / 2;
  float upper = -infinity, lower = -infinity;
  for (int octant = 0; octant < 8; ++octant) {
    const int x0 = (octant & 1) * boxes, y0 = (octant >> 1 & 1) * boxes, z0 = (octant >> 2) * boxes;
    bool known = false;
    float octant_rise = 0.0f, octant_fall = 0.0f;
    for (int i = 0; i < boxes * boxes * boxes; ++i) {
      const int box = x0 + i % boxes + edge * (y0 + i / boxes % boxes + edge * (z0 + i / (boxes * boxes)));
      if (field.most[box] + rise + rounding < threshold) {
        lower = max_of(lower, fit.most[box] + fit_rise - threshold);
        continue;
      }
      if (field.least[box] - fall - rounding > threshold) {
        upper = max_of(upper, threshold - (fit.least[box] - fit_fall));
        continue;
      }
      if (!known) {
        const float off = 0.5f * half;
        const Vec3 middle = center + Vec3{x0 > 0 ? off : -off, y0 > 0 ? off : -off, z0 > 0 ? off : -off};
        const CurvatureRanges part = curvature_ranges<kernel>(frame, list, count, middle, off, half, gap);
        float above[3], below[3];
        for (int a = 0; a < 3; ++a) {
          above[a] = part.most[a] - bend[a];
          below[a] = bend[a] - part.least[a];
        }
        octant_fall = fall_between_nodes<edge>(above) + rounding;
        octant_rise = fall_between_nodes<edge>(below) + whole.small_maximum + rounding;
        known = true;
      }
      const float most = residual.most[box] + octant_rise, least = residual.least[box] - octant_fall;
      const float fit_most = fit.most[box] + fit_rise - threshold, fit_least = fit.least[box] - fit_fall - threshold;
      // Of points of the body the model says at least fit_least, and g - most; of others at most fit_most, and g - least.
      if (fit_most + most >= 0.0f) upper = max_of(upper, min_of(most, -fit_least));
      if (fit_least + least <= 0.0f) lower = max_of(lower, min_of(-least, fit_most));
    }
  }
  if (upper == -infinity) return;
  if (lower == -infinity) {
    cell.kind = SurfaceCellKind::inside;
    return;
  }

  // To grid units and the relative field g = D/T - 1.
  cell.kind = SurfaceCellKind::near;
  const float side = 2.0f * half / frame.units_per_grid;
  const float per_side = frame.inverse_threshold / side;
  cell.quadratic[0] = q[0] * frame.inverse_threshold - 1.0f;
  for (int i = 1; i < 4; ++i) cell.quadratic[i] = q[i] * per_side;
  for (int i = 4; i < 10; ++i) cell.quadratic[i] = q[i] * per_side / side;
  cell.slack = {upper * frame.inverse_threshold + 1e-6f, lower * frame.inverse_threshold + 1e-6f};
}

template <Kernel kernel>
void examine_as(const CellFrame& frame, const ParticleArrays& list, std::size_t count, const ParticleArrays& near,
                Vec3 center, float half, SurfaceCell& cell) {
  cell.kind = SurfaceCellKind::outside;
  const float threshold = 1.0f / frame.inverse_threshold;
  if (static_cast<float>(count) < threshold) return;  // no kernel exceeds 1
  // Rounding of the sums, here and where the field is evaluated, stays well under this; so does what the nodes' rough
  // kernel departs from the true one.
  const float rounding = (2e-6f + KernelLanes<kernel>::rough_error) * static_cast<float>(count) + 1e-5f * threshold;

  pad(frame, list, count);

  // Far outside: even with every particle at its nearest the sum stays under. Deep inside: the nearer particles alone
  // are enough, and without the others the bounds are tighter too.
  constexpr float near_share = 0.65f;
  std::size_t near_count = 0;
  const FirstLook look = first_look<kernel>(frame, list, count, center, half, near_share, near, near_count);
  if (look.most + rounding < threshold) return;
  if (look.at_center > 1.2f * threshold) {
    if (proves_inside<kernel>(frame, near, near_count, center, half, threshold + rounding)) {
      cell.kind = SurfaceCellKind::inside;
      return;
    }
  }
  if (look.at_center < 0.5f * threshold && octants_are_enough(frame, half) &&
      octant_bounds<kernel>(frame, list, count, center, half).most + rounding < threshold) {
    return;
  }

  sample_cell<5, kernel>(frame, list, count, center, half, rounding, cell);
}

void examine(const CellFrame& frame, const ParticleArrays& list, std::size_t count, const ParticleArrays& near,
             Vec3 center, float half, SurfaceCell& cell) {
  switch (frame.kernel) {
    case Kernel::metaball: return examine_as<Kernel::metaball>(frame, list, count, near, center, half, cell);
    case Kernel::zhu_bridson: return examine_as<Kernel::zhu_bridson>(frame, list, count, near, center, half, cell);
    case Kernel::blinn: return examine_as<Kernel::blinn>(frame, list, count, near, center, half, cell);
  }
}

/// Which of sixteen cubes about (x, y, z), `reach` from the centre to the faces, recovered particles may reach their
/// threshold in: every particle is as near as the cube lets it be.
template <Kernel kernel>
EMBRUN_FN std::uint32_t reached_cubes(const RecoveredParticle* particles, std::size_t count, F16 x, F16 y, float z,
                                      float reach) {
  F16 most = splat(0.0f);
  for (std::size_t i = 0; i < count; ++i) {
    const RecoveredParticle& r = particles[i];
    const float beyond = max_of(fabsf(r.z - z) - reach, 0.0f);
    const F16 dx = r.x - x, dy = r.y - y;
    const F16 outside_x = max_of(max_of(dx, 0.0f - dx) - reach, splat(0.0f));
    const F16 outside_y = max_of(max_of(dy, 0.0f - dy) - reach, splat(0.0f));
    const F16 q = outside_x * outside_x + outside_y * outside_y + beyond * beyond;
    most += KernelLanes<kernel>::value(q * (r.inverse_radius * r.inverse_radius)) * r.weight;
  }
  return mask_less(splat(recovered_reach), most);
}

/// Looks at parts of 8x8x8 where one of 4x4x4 is not ruled out.
template <Kernel kernel>
bool bound_recovered_as(const RecoveredParticle* particles, std::size_t count, Vec3 center, float half, float slack,
                        Box3& where) {
  const float coarse = 0.5f * half, fine = 0.25f * half;  // their sides
  float coarse_x[16], coarse_y[16], fine_x[16], fine_y[16];
  for (int i = 0; i < 16; ++i) {
    coarse_x[i] = center.x - half + (static_cast<float>(i % 4) + 0.5f) * coarse;
    coarse_y[i] = center.y - half + (static_cast<float>(i / 4) + 0.5f) * coarse;
    fine_x[i] = center.x - half + (static_cast<float>(i % 8) + 0.5f) * fine;
    fine_y[i] = center.y - half + (static_cast<float>(i / 8) + 0.5f) * fine;
  }
  unsigned filled[3] = {};  // a bit for each layer of fine parts along an axis
  for (int layer = 0; layer < 4; ++layer) {
    const float low = center.z - half + static_cast<float>(layer) * coarse;
    const std::uint32_t possible = reached_cubes<kernel>(particles, count, load16(coarse_x), load16(coarse_y),
                                                         low + 0.5f * coarse, 0.5f * coarse + slack);
    for (int row = 0; row < 4; ++row) {
      if ((possible >> (4 * row) & 0xfu) == 0) continue;
      const F16 y = load16(fine_y) + static_cast<float>(row) * coarse;
      for (int half_layer = 0; half_layer < 2; ++half_layer) {
        const float z = low + (static_cast<float>(half_layer) + 0.5f) * fine;
        const std::uint32_t bits = reached_cubes<kernel>(particles, count, load16(fine_x), y, z, 0.5f * fine + slack);
        if (bits == 0) continue;
        filled[0] |= (bits | bits >> 8) & 0xffu;
        filled[1] |= ((bits & 0xffu) != 0 ? 1u : 0u) << (2 * row) | (bits >> 8 != 0 ? 2u : 0u) << (2 * row);
        filled[2] |= 1u << (2 * layer + half_layer);
      }
    }
  }
  if (filled[0] == 0) return false;
  for (int a = 0; a < 3; ++a) {
    where.low[a] = static_cast<float>(lowest_bit(filled[a])) * fine - half;
    where.high[a] = static_cast<float>(highest_bit(filled[a]) + 1) * fine - half;
  }
  return true;
}

bool bound_recovered(const CellFrame& frame, const RecoveredParticle* particles, std::size_t count, Vec3 center,
                     float half, float slack, Box3& where) {
  switch (frame.kernel) {
    case Kernel::metaball: return bound_recovered_as<Kernel::metaball>(particles, count, center, half, slack, where);
    case Kernel::zhu_bridson:
      return bound_recovered_as<Kernel::zhu_bridson>(particles, count, center, half, slack, where);
    case Kernel::blinn: return bound_recovered_as<Kernel::blinn>(particles, count, center, half, slack, where);
  }
  return false;
}

}  // namespace

const CellModelLoops EMBRUN_CELL_MODEL = {gather, mark, examine, bound_recovered};

}  // namespace embrun
