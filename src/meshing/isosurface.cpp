#include "meshing/isosurface.h"

#include <fmt/core.h>

#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/field_sums.h"
#include "geometry/kernels.h"
#include "geometry/particle_blocks.h"
#include "meshing/cube_cases.h"

namespace embrun {

namespace {

constexpr int side = lattice_side;  // samples of a block along each axis
constexpr int block_samples = side * side * side;
constexpr int padded_side = side + 1;  // with the first layer of the next blocks
constexpr std::uint32_t no_block = 0xffffffffu;

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// Which of a block's sample edges the surface crosses, three a sample, numbered in that order.
struct EdgeBits {
  std::uint64_t words[3 * block_samples / 64] = {};
  std::uint16_t before[3 * block_samples / 64] = {};
  std::uint32_t count = 0;

  static std::size_t index(int i, int j, int k, unsigned axis) {
    return static_cast<std::size_t>((k * side + j) * side + i) * 3 + axis;
  }
  void set(std::size_t edge) { words[edge / 64] |= std::uint64_t{1} << edge % 64; }
  void finish() {
    for (std::size_t w = 0; w < std::size(words); ++w) {
      before[w] = static_cast<std::uint16_t>(count);
      count += static_cast<std::uint32_t>(std::popcount(words[w]));
    }
  }
  /// How many crossed edges come before this one.
  std::uint32_t rank(std::size_t edge) const {
    const std::uint64_t lower = words[edge / 64] & ((std::uint64_t{1} << edge % 64) - 1);
    return before[edge / 64] + static_cast<std::uint32_t>(std::popcount(lower));
  }
};

class Extractor {
 public:
  Extractor(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceModel& model,
            const IsosurfaceSettings& settings);
  TriangleMesh run(IsosurfaceStats* stats);

 private:
  struct Near {
    std::vector<std::uint32_t> main, recovered;
  };
  using PaddedSamples = float[padded_side * padded_side * padded_side];
  struct SurfacePoint {
    float g;
    Vec3 gradient, normal;
  };

  void lay_out_blocks();
  void sample_blocks();
  void find_edges(std::size_t block);
  void place_vertices(std::size_t block, TriangleMesh& mesh) const;
  void emit_triangles(std::size_t block, std::vector<std::array<std::uint32_t, 3>>& triangles) const;

  Vec3 sample_position(std::size_t block, int i, int j, int k) const;
  void find_near(std::size_t block, float margin, Near& near) const;
  bool pad_samples(std::size_t block, PaddedSamples& samples) const;
  SurfacePoint point_at(const Near& near, Vec3 x) const;
  std::uint32_t block_at(int x, int y, int z) const;

  const SurfaceModel& model_;
  bool exact_;
  float cell_;
  ParticleBlocks main_, recovered_;
  Vec3 origin_;
  int blocks_[3] = {};
  std::vector<std::uint32_t> block_of_place_;  // index of the active block at a place, or no_block
  std::vector<std::uint32_t> places_;          // of the active blocks, rising
  std::vector<float> samples_;                 // max(D/T, D'/T') - 1
  std::vector<EdgeBits> edges_;                // of those blocks that the surface meets
  std::vector<std::uint32_t> edges_of_block_;  // index into edges_, or no_block
  std::vector<std::uint32_t> first_vertex_;    // of each entry of edges_
};

ParticleBlocks recovered_blocks(std::span<const Vec3> positions, std::span<const float> radii,
                                const SurfaceModel& model) {
  std::vector<Vec3> centres;
  std::vector<float> influence;
  for (const std::uint32_t i : model.recovered) {
    centres.push_back(positions[i]);
    influence.push_back(model.recover_factor * (radii.empty() ? model.radius : radii[i]));
  }
  return {centres, influence, model.recovered_weights, kernel_support(model.kernel)};
}

ParticleBlocks main_blocks(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceModel& model) {
  std::vector<float> influence(radii.begin(), radii.end());
  for (float& b : influence) b *= model.influence_factor;
  if (influence.empty()) influence.push_back(model.influence_radius);
  return {positions, influence, {}, kernel_support(model.kernel)};
}

Extractor::Extractor(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceModel& model,
                     const IsosurfaceSettings& settings)
    : model_(model),
      exact_(settings.exact_vertices),
      cell_(settings.cell > 0 ? settings.cell : 0.5f * model.radius),
      main_(main_blocks(positions, radii, model)),
      recovered_(recovered_blocks(positions, radii, model)) {}

/// Finds the blocks of samples in which anything is felt, a cell farther on the low sides, since a block's cells
/// reach to the next samples above.
void Extractor::lay_out_blocks() {
  Vec3 low{infinity, infinity, infinity}, high = -low;
  for (const ReachBox& box : main_.bounds()) {
    const Vec3 reach{box.reach, box.reach, box.reach};
    low = min_of(low, box.low - reach);
    high = max_of(high, box.high + reach);
  }
  const float width = cell_ * side;
  origin_ = low - Vec3{cell_, cell_, cell_} * 1.5f;
  double count = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double extent = (static_cast<double>(high[axis]) - static_cast<double>(origin_[axis])) / width;
    count *= extent + 2;
    if (extent < 1e6) blocks_[axis] = static_cast<int>(extent) + 2;
  }
  if (!(count < 1e9)) {
    throw Error(fmt::format("a grid of cells of {} m is too fine for particles spread so wide", cell_));
  }
  block_of_place_.assign(static_cast<std::size_t>(blocks_[0]) * static_cast<std::size_t>(blocks_[1]) *
                             static_cast<std::size_t>(blocks_[2]),
                         no_block);
  for (const ReachBox& box : main_.bounds()) {
    int first[3], last[3];
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = max_of(0, static_cast<int>((box.low[axis] - box.reach - cell_ - origin_[axis]) / width));
      last[axis] = static_cast<int>((box.high[axis] + box.reach - origin_[axis]) / width);
    }
    for (int z = first[2]; z <= last[2]; ++z) {
      for (int y = first[1]; y <= last[1]; ++y) {
        for (int x = first[0]; x <= last[0]; ++x) {
          block_of_place_[static_cast<std::size_t>((z * blocks_[1] + y) * blocks_[0] + x)] = 0;
        }
      }
    }
  }
  for (std::size_t place = 0; place < block_of_place_.size(); ++place) {
    if (block_of_place_[place] == no_block) continue;
    block_of_place_[place] = static_cast<std::uint32_t>(places_.size());
    places_.push_back(static_cast<std::uint32_t>(place));
  }
}

std::uint32_t Extractor::block_at(int x, int y, int z) const {
  if (x >= blocks_[0] || y >= blocks_[1] || z >= blocks_[2]) return no_block;
  return block_of_place_[static_cast<std::size_t>((z * blocks_[1] + y) * blocks_[0] + x)];
}

Vec3 Extractor::sample_position(std::size_t block, int i, int j, int k) const {
  const auto place = static_cast<int>(places_[block]);
  const int x = place % blocks_[0], y = place / blocks_[0] % blocks_[1], z = place / blocks_[0] / blocks_[1];
  return origin_ +
         Vec3{static_cast<float>(x * side + i), static_cast<float>(y * side + j), static_cast<float>(z * side + k)} *
             cell_;
}

/// The particles felt within `margin` of a block's samples.
void Extractor::find_near(std::size_t block, float margin, Near& near) const {
  near.main.clear();
  near.recovered.clear();
  const Vec3 margins{margin, margin, margin};
  const Vec3 low = sample_position(block, 0, 0, 0) - margins;
  const Vec3 high = sample_position(block, side - 1, side - 1, side - 1) + margins;
  main_.find_near(low, high, near.main);
  recovered_.find_near(low, high, near.recovered);
}

BlockList list_of(const ParticleBlocks& particles, const std::vector<std::uint32_t>& near) {
  return {particles.blocks().data(), particles.bounds().data(), near.data(), near.size()};
}

void Extractor::sample_blocks() {
  samples_.resize(places_.size() * block_samples);
  const FieldSums& sums = field_sums();
  parallel_for(places_.size(), 8, [&](std::size_t begin, std::size_t end) {
    Near near;
    for (std::size_t block = begin; block < end; ++block) {
      find_near(block, cell_, near);
      const Vec3 corner = sample_position(block, 0, 0, 0);
      // Most blocks around splashes cannot reach a threshold, nor can a sample next to them: a bound tells for a
      // fraction of the price.
      const Vec3 margin{cell_, cell_, cell_};
      const Vec3 low = corner - margin, high = sample_position(block, side - 1, side - 1, side - 1) + margin;
      const BlockList main_list = list_of(main_, near.main), recovered_list = list_of(recovered_, near.recovered);
      const float rounding = 0.9999f;
      const bool main_counts = sums.most(model_.kernel, main_list, low, high) >= rounding * model_.threshold;
      const bool recovered_counts =
          sums.most(model_.kernel, recovered_list, low, high) >= rounding * model_.recover_threshold;
      alignas(64) float main[block_samples] = {}, recovered[block_samples] = {};
      if (main_counts) sums.lattice(model_.kernel, main_list, corner, cell_, main);
      if (recovered_counts) sums.lattice(model_.kernel, recovered_list, corner, cell_, recovered);
      float* out = samples_.data() + block * block_samples;
      for (int i = 0; i < block_samples; ++i) {
        out[i] = max_of(main[i] / model_.threshold, recovered[i] / model_.recover_threshold) - 1.0f;
      }
    }
  });
}

/// A block's samples with the first layer of the next ones (outside where there is none); false when all are on one
/// side.
bool Extractor::pad_samples(std::size_t block, PaddedSamples& samples) const {
  const auto place = static_cast<int>(places_[block]);
  const int x = place % blocks_[0], y = place / blocks_[0] % blocks_[1], z = place / blocks_[0] / blocks_[1];
  int inside = 0;
  for (int dz = 0; dz < 2; ++dz) {
    for (int dy = 0; dy < 2; ++dy) {
      for (int dx = 0; dx < 2; ++dx) {
        const std::uint32_t from = block_at(x + dx, y + dy, z + dz);
        const float* source = from == no_block ? nullptr : samples_.data() + std::size_t{from} * block_samples;
        for (int k = 0; k < (dz ? 1 : side); ++k) {
          for (int j = 0; j < (dy ? 1 : side); ++j) {
            float* row = samples + ((k + dz * side) * padded_side + j + dy * side) * padded_side + dx * side;
            for (int i = 0; i < (dx ? 1 : side); ++i) {
              row[i] = source ? source[(k * side + j) * side + i] : -1.0f;
              inside += row[i] > 0.0f;
            }
          }
        }
      }
    }
  }
  return inside > 0 && inside < padded_side * padded_side * padded_side;
}

constexpr int padded_stride[3] = {1, padded_side, padded_side* padded_side};

void Extractor::find_edges(std::size_t block) {
  PaddedSamples samples;
  if (!pad_samples(block, samples)) return;
  EdgeBits& bits = edges_[edges_of_block_[block]];
  for (int k = 0; k < side; ++k) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        const float* at = samples + (k * padded_side + j) * padded_side + i;
        for (unsigned axis = 0; axis < 3; ++axis) {
          if ((at[0] > 0.0f) != (at[padded_stride[axis]] > 0.0f)) bits.set(EdgeBits::index(i, j, k, axis));
        }
      }
    }
  }
  bits.finish();
}

/// g, its gradient and the outward unit normal.
Extractor::SurfacePoint Extractor::point_at(const Near& near, Vec3 x) const {
  FieldSample main, recovered{};
  field_sums().samples(model_.kernel, list_of(main_, near.main), &x, 1, &main);
  if (!near.recovered.empty()) {
    field_sums().samples(model_.kernel, list_of(recovered_, near.recovered), &x, 1, &recovered);
  }
  const bool use_recovered = recovered.value * model_.threshold > main.value * model_.recover_threshold;
  const FieldSample& branch = use_recovered ? recovered : main;
  const float scale = 1.0f / (use_recovered ? model_.recover_threshold : model_.threshold);
  Vec3 normal = model_.normal == NormalMode::weighted ? branch.weighted : -branch.gradient;
  if (!(length_squared(normal) > 0)) normal = -branch.gradient;
  normal = length_squared(normal) > 0 ? normalize(normal) : Vec3{0, 1, 0};
  return {branch.value * scale - 1.0f, branch.gradient * scale, normal};
}

void Extractor::place_vertices(std::size_t block, TriangleMesh& mesh) const {
  PaddedSamples samples;
  pad_samples(block, samples);
  const EdgeBits& bits = edges_[edges_of_block_[block]];
  std::size_t vertex = first_vertex_[edges_of_block_[block]];
  Near near;
  find_near(block, cell_, near);
  for (std::size_t word = 0; word < std::size(bits.words); ++word) {
    for (std::uint64_t left = bits.words[word]; left != 0; left &= left - 1, ++vertex) {
      const auto edge = static_cast<int>(word * 64) + std::countr_zero(left);
      const int axis = edge % 3, sample = edge / 3;
      const int i = sample % side, j = sample / side % side, k = sample / side / side;
      const float* at = samples + (k * padded_side + j) * padded_side + i;
      const Vec3 base = sample_position(block, i, j, k);
      Vec3 along;
      along[axis] = cell_;
      // The zero between a and b: linear, then Newton kept within the bracket.
      float a = 0, b = 1, ga = at[0];
      float s = ga / (ga - at[padded_stride[axis]]);
      SurfacePoint point = point_at(near, base + along * s);
      for (int iteration = 0; exact_ && iteration < 12 && fabsf(point.g) > 2e-6f; ++iteration) {
        if ((point.g > 0) == (ga > 0)) {
          a = s;
        } else {
          b = s;
        }
        const float slope = dot(point.gradient, along);
        const float newton = s - point.g / slope;
        const float last = s;
        s = newton > a && newton < b ? newton : 0.5f * (a + b);
        point = point_at(near, base + along * s);
        if (fabsf(s - last) < 1e-6f) break;
      }
      mesh.positions[vertex] = base + along * s;
      mesh.normals[vertex] = point.normal;
    }
  }
}

void Extractor::emit_triangles(std::size_t block, std::vector<std::array<std::uint32_t, 3>>& triangles) const {
  PaddedSamples samples;
  if (!pad_samples(block, samples)) return;
  const auto place = static_cast<int>(places_[block]);
  const int x = place % blocks_[0], y = place / blocks_[0] % blocks_[1], z = place / blocks_[0] / blocks_[1];
  const auto vertex_of = [&](int i, int j, int k, unsigned edge) {
    const unsigned corner = edge_base_corner(edge);
    i += static_cast<int>(corner & 1u);
    j += static_cast<int>(corner >> 1 & 1u);
    k += static_cast<int>(corner >> 2);
    const std::uint32_t owner = block_at(x + i / side, y + j / side, z + k / side);
    const std::uint32_t entry = edges_of_block_[owner];
    return first_vertex_[entry] + edges_[entry].rank(EdgeBits::index(i % side, j % side, k % side, edge >> 2));
  };
  const CubeCases& cases = cube_cases();
  for (int k = 0; k < side; ++k) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        const float* at = samples + (k * padded_side + j) * padded_side + i;
        unsigned corner_bits = 0;
        for (unsigned c = 0; c < 8; ++c) {
          const int offset = static_cast<int>(c & 1u) + static_cast<int>(c >> 1 & 1u) * padded_stride[1] +
                             static_cast<int>(c >> 2) * padded_stride[2];
          corner_bits |= static_cast<unsigned>(at[offset] > 0.0f) << c;
        }
        for (const CubeCases::Triangle& t : cases.of(corner_bits)) {
          triangles.push_back({vertex_of(i, j, k, t[0]), vertex_of(i, j, k, t[1]), vertex_of(i, j, k, t[2])});
        }
      }
    }
  }
}

TriangleMesh Extractor::run(IsosurfaceStats* stats) {
  const double start = now();
  lay_out_blocks();
  sample_blocks();
  const double sampled = now();

  // Which blocks the surface meets, and which edges it crosses there.
  edges_of_block_.assign(places_.size(), no_block);
  std::vector<std::uint8_t> met(places_.size());
  parallel_for(places_.size(), 64, [&](std::size_t begin, std::size_t end) {
    PaddedSamples samples;
    for (std::size_t block = begin; block < end; ++block) met[block] = pad_samples(block, samples);
  });
  std::vector<std::uint32_t> surface_blocks;
  for (std::uint32_t block = 0; block < places_.size(); ++block) {
    if (!met[block]) continue;
    edges_of_block_[block] = static_cast<std::uint32_t>(surface_blocks.size());
    surface_blocks.push_back(block);
  }
  edges_.resize(surface_blocks.size());
  parallel_for(surface_blocks.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) find_edges(surface_blocks[s]);
  });

  // Vertices, numbered block by block.
  std::uint64_t vertex_count = 0;
  for (const EdgeBits& bits : edges_) {
    first_vertex_.push_back(static_cast<std::uint32_t>(vertex_count));
    vertex_count += bits.count;
  }
  if (vertex_count >= no_block) throw Error(fmt::format("a mesh with cells of {} m has too many vertices", cell_));
  TriangleMesh mesh;
  mesh.positions.resize(vertex_count);
  mesh.normals.resize(vertex_count);
  std::vector<std::vector<std::array<std::uint32_t, 3>>> triangles(surface_blocks.size());
  parallel_for(surface_blocks.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      place_vertices(surface_blocks[s], mesh);
      emit_triangles(surface_blocks[s], triangles[s]);
    }
  });
  std::size_t triangle_count = 0;
  for (const auto& part : triangles) triangle_count += part.size();
  mesh.triangles.reserve(triangle_count);
  for (const auto& part : triangles) mesh.triangles.insert(mesh.triangles.end(), part.begin(), part.end());
  if (stats) *stats = {places_.size(), samples_.size(), sampled - start, now() - sampled};
  return mesh;
}

}  // namespace

TriangleMesh extract_isosurface(std::span<const Vec3> positions, std::span<const float> radii,
                                const SurfaceModel& model, const IsosurfaceSettings& settings, IsosurfaceStats* stats) {
  return Extractor(positions, radii, model, settings).run(stats);
}

double enclosed_volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
                c = to_double(mesh.positions[t[2]]);
    sum += dot(a, cross(b, c));
  }
  return sum / 6;
}

double surface_area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3d a = to_double(mesh.positions[t[0]]), b = to_double(mesh.positions[t[1]]),
                c = to_double(mesh.positions[t[2]]);
    sum += length(cross(b - a, c - a));
  }
  return sum / 2;
}

}  // namespace embrun
