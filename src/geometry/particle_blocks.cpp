#include "geometry/particle_blocks.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.h"

namespace embrun {

namespace {

/// Spreads the low 21 bits so that two zeros follow each.
std::uint64_t spread_bits(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffffull;
  v = (v | v << 16) & 0x1f0000ff0000ffull;
  v = (v | v << 8) & 0x100f00f00f00f00full;
  v = (v | v << 4) & 0x10c30c30c30c30c3ull;
  return (v | v << 2) & 0x1249249249249249ull;
}

struct KeyedParticle {
  std::uint64_t key;
  std::uint32_t index;
};

/// Index along a Hilbert curve of 2^bits cells a side [Skilling2004]. Its
/// neighbours are always neighbours in space, so that runs of it have small boxes.
std::uint64_t hilbert_index(std::array<std::uint32_t, 3> x, int bits) {
  for (std::uint32_t q = 1u << (bits - 1); q > 1; q >>= 1) {
    const std::uint32_t p = q - 1;
    for (std::uint32_t& coordinate : x) {
      const std::uint32_t set = 0u - static_cast<std::uint32_t>((coordinate & q) != 0);  // all ones or none
      const std::uint32_t exchange = (x[0] ^ coordinate) & p & ~set;
      x[0] ^= (p & set) | exchange;
      coordinate ^= exchange;
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  std::uint32_t flip = 0;
  for (std::uint32_t q = 1u << (bits - 1); q > 1; q >>= 1) {
    if (x[2] & q) flip ^= q - 1;
  }
  for (std::uint32_t& coordinate : x) coordinate ^= flip;
  return spread_bits(x[0]) << 2 | spread_bits(x[1]) << 1 | spread_bits(x[2]);
}

/// Stable sort by key: counting passes over 11 bits, as many as the keys need.
void radix_sort(std::vector<KeyedParticle>& particles, int key_bits) {
  std::vector<KeyedParticle> scratch(particles.size());
  constexpr int digit_bits = 11;
  for (int shift = 0; shift < key_bits; shift += digit_bits) {
    std::array<std::uint32_t, 1u << digit_bits> starts{};
    const auto digit = [shift](std::uint64_t key) { return (key >> shift) & ((1u << digit_bits) - 1); };
    for (const KeyedParticle& p : particles) ++starts[digit(p.key)];
    std::uint32_t sum = 0;
    for (std::uint32_t& start : starts) {
      const std::uint32_t count = start;
      start = sum;
      sum += count;
    }
    for (const KeyedParticle& p : particles) scratch[starts[digit(p.key)]++] = p;
    particles.swap(scratch);
  }
}

constexpr int axis_bits_limit = 18;
constexpr int class_bits = 8;
constexpr int fan_out = 8;

/// Bits per axis that tell cells of a quarter of the smallest influence radius apart, within the limit.
int axis_bits_for(float extent, float smallest_influence) {
  int bits = 1;
  while (bits < axis_bits_limit && extent > 0.25f * smallest_influence * static_cast<float>(1 << bits)) ++bits;
  return bits;
}

}  // namespace

ParticleBlocks::ParticleBlocks(std::span<const Vec3> positions, std::span<const float> influence,
                               std::span<const float> weights, float support) {
  const std::size_t count = positions.size();
  if (count == 0) return;
  const bool uniform = influence.size() == 1;
  Box3 box;
  for (const Vec3 p : positions) box.include(p);
  const Vec3 size = box.high - box.low;
  const float extent = max_of(size.x, max_of(size.y, size.z));
  const float smallest = *std::min_element(influence.begin(), influence.end());

  // Keys: the size class above, the position along the curve below.
  const int axis_bits = axis_bits_for(extent, smallest);
  const float scale = extent > 0 ? static_cast<float>((1 << axis_bits) - 1) / extent : 0.0f;
  const int smallest_exponent = std::ilogb(smallest);
  const auto class_of = [&](float b) { return std::min(std::ilogb(b) - smallest_exponent, (1 << class_bits) - 1); };
  const int largest_class = class_of(*std::max_element(influence.begin(), influence.end()));
  std::vector<KeyedParticle> order(count);
  parallel_for(count, 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 cell = (positions[i] - box.low) * scale;
      const std::uint64_t code = hilbert_index(
          {static_cast<std::uint32_t>(cell.x), static_cast<std::uint32_t>(cell.y), static_cast<std::uint32_t>(cell.z)},
          axis_bits);
      const int size_class = largest_class == 0 ? 0 : class_of(influence[i]);
      order[i] = {static_cast<std::uint64_t>(size_class) << (3 * axis_bits) | code, static_cast<std::uint32_t>(i)};
    }
  });
  radix_sort(order, 3 * axis_bits + (largest_class > 0 ? class_bits : 0));

  const auto fill = [&](std::size_t n, std::span<const KeyedParticle> particles) {
    ParticleBlock& block = blocks_[n];
    Box3 bounds;
    float reach = 0;
    for (std::size_t lane = 0; lane < 16; ++lane) {
      const bool used = lane < particles.size();
      const std::uint32_t source = particles[used ? lane : 0].index;
      const Vec3 p = positions[source];
      const float b = uniform ? influence[0] : influence[source];
      block.x[lane] = p.x;
      block.y[lane] = p.y;
      block.z[lane] = p.z;
      block.inverse_influence_squared[lane] = square(1.0f / max_of(b, 1e-18f));
      block.weight[lane] = !used ? 0.0f : weights.empty() ? 1.0f : weights[source];
      if (used) sources_[16 * n + lane] = source;
      bounds.include(p);
      reach = max_of(reach, b * support);
    }
    bounds_[n] = {bounds.low, bounds.high, reach};
  };
  // A class starts a new block.
  for (std::size_t begin = 0; begin < count;) {
    const std::uint64_t size_class = order[begin].key >> (3 * axis_bits);
    const std::size_t first_block = blocks_.size();
    std::size_t end = begin;
    while (end < count && order[end].key >> (3 * axis_bits) == size_class) ++end;
    const std::size_t block_count = (end - begin + 15) / 16;
    blocks_.resize(first_block + block_count);
    bounds_.resize(first_block + block_count);
    sources_.resize(16 * (first_block + block_count), no_particle);
    parallel_for(block_count, 512, [&](std::size_t first, std::size_t last) {
      for (std::size_t n = first; n < last; ++n) {
        const std::size_t from = begin + 16 * n;
        fill(first_block + n, std::span(order).subspan(from, std::min<std::size_t>(16, end - from)));
      }
    });
    build_tree(first_block, blocks_.size() - first_block);
    begin = end;
  }
}

void ParticleBlocks::build_tree(std::size_t first_block, std::size_t block_count) {
  Tree& tree = trees_.emplace_back();
  tree.first_block = first_block;
  tree.block_count = block_count;
  std::span<const ReachBox> finer(bounds_.data() + first_block, block_count);
  do {
    std::vector<ReachBox> level;
    for (std::size_t begin = 0; begin < finer.size(); begin += fan_out) {
      ReachBox node = finer[begin];
      for (std::size_t i = begin + 1; i < std::min<std::size_t>(begin + fan_out, finer.size()); ++i) {
        node.low = min_of(node.low, finer[i].low);
        node.high = max_of(node.high, finer[i].high);
        node.reach = max_of(node.reach, finer[i].reach);
      }
      level.push_back(node);
    }
    tree.levels.push_back(std::move(level));
    finer = tree.levels.back();
  } while (finer.size() > fan_out);
}

void ParticleBlocks::find_in_tree(const Tree& tree, std::size_t level, std::size_t begin, std::size_t end, Vec3 low,
                                  Vec3 high, std::vector<std::uint32_t>& found) const {
  const std::vector<ReachBox>& nodes = tree.levels[level];
  for (std::size_t i = begin; i < end; ++i) {
    if (!(nodes[i].distance_squared(low, high) < nodes[i].reach * nodes[i].reach)) continue;
    const std::size_t children = level > 0 ? tree.levels[level - 1].size() : tree.block_count;
    const std::size_t first = i * fan_out, last = std::min(first + fan_out, children);
    if (level > 0) {
      find_in_tree(tree, level - 1, first, last, low, high, found);
      continue;
    }
    for (std::size_t b = tree.first_block + first; b < tree.first_block + last; ++b) {
      if (bounds_[b].distance_squared(low, high) < bounds_[b].reach * bounds_[b].reach) {
        found.push_back(static_cast<std::uint32_t>(b));
      }
    }
  }
}

void ParticleBlocks::find_near(Vec3 low, Vec3 high, std::vector<std::uint32_t>& found) const {
  for (const Tree& tree : trees_) {
    find_in_tree(tree, tree.levels.size() - 1, 0, tree.levels.back().size(), low, high, found);
  }
}

}  // namespace embrun
