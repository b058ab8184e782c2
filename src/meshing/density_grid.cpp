#include "meshing/density_grid.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.h"
#include "geometry/particle_blocks.h"
#include "meshing/felt_tiles.h"
#include "meshing/meter.h"

namespace embrun {

namespace {

constexpr int tile_side = DensityGrid::tile_side;
constexpr std::size_t tile_cells = DensityGrid::tile_cells;
/// Points of a cell along each axis: balls have edges, smooth sums have none.
constexpr int points_of_balls = 4, points_of_smooth = 1;

/// What particles are apart from where they are.
struct Matter {
  Rgb extinction;
  Rgb scattering;
};

/// Sums over particles at the points of a tile: of their weights, of those times the extinction, times the scattering.
struct TileSums {
  std::vector<float> weight;
  std::array<std::vector<float>, 3> extinction, scattering;
};

class Sampler {
 public:
  Sampler(const DensityParticles& particles, DensityGrid& grid);
  void sample_tile(std::size_t tile, TileSums& sums) const;

  std::vector<std::uint64_t> tile_keys() const;

 private:
  /// A particle at the points of a tile.
  struct Placed {
    Vec3 center;  ///< in points from the tile's first one
    float reach;  ///< in points
    Matter matter;
  };

  Matter matter_of(std::uint32_t particle) const;
  void add(const Placed& particle, TileSums& sums) const;
  void add_row(const Placed& particle, int first, int last, float beside, std::size_t row, TileSums& sums) const;
  template <class Value>
  void add_up(const Value& value, std::array<float, tile_cells>& cells) const;
  void reduce(const TileSums& sums, std::size_t tile) const;

  const DensityParticles& particles_;
  DensityGrid& grid_;
  ParticleBlocks balls_;
  std::vector<std::uint32_t> sources_;  // of the balls: the particles that are there
  bool smooth_, same_matter_, own_albedos_;
  int points_;         // of a cell, along each axis
  float smooth_norm_;  // of the kernel, times the volume that a particle stands for
};

Sampler::Sampler(const DensityParticles& particles, DensityGrid& grid)
    : particles_(particles), grid_(grid), smooth_(particles.model == DensityModel::smooth) {
  same_matter_ = particles.factors.empty() && particles.extinctions.empty();
  own_albedos_ = !particles.albedos.empty();
  points_ = smooth_ ? points_of_smooth : points_of_balls;
  const auto is_grey = [](const Rgb& k) { return k.r == k.g && k.g == k.b; };
  const bool grey = particles.extinctions.empty()
                        ? is_grey(particles.extinction)
                        : std::all_of(particles.extinctions.begin(), particles.extinctions.end(), is_grey);
  grid_.channels = grey ? 1 : 3;

  // A smooth particle is felt to four radii, and its kernel's integral is 1 there.
  const float reach_factor = smooth_ ? 4.0f : 1.0f;
  const float reach = reach_factor * particles.radius;
  smooth_norm_ = particles.volume * 8 * inv_pi / (reach * reach * reach);
  std::vector<Vec3> centers;
  std::vector<float> reaches;
  for (std::size_t i = 0; i < particles.positions.size(); ++i) {
    const float radius = particles.radii.empty() ? particles.radius : particles.radii[i];
    if (!(radius > 0)) continue;
    centers.push_back(particles.positions[i]);
    if (!particles.radii.empty() || reaches.empty()) reaches.push_back(reach_factor * radius);
    sources_.push_back(static_cast<std::uint32_t>(i));
  }
  balls_ = ParticleBlocks(centers, reaches, {}, 1.0f);
}

std::vector<std::uint64_t> Sampler::tile_keys() const {
  if (balls_.bounds().empty()) return {};
  const float width = grid_.cell * tile_side;
  const Vec3 low = felt_box(balls_.bounds()).low;
  for (int axis = 0; axis < 3; ++axis) grid_.origin[axis] = std::floor(low[axis] / width - 0.5f) * width;
  return felt_tiles(balls_.bounds(), grid_.origin, width, 0, 0, grid_.cell);
}

Matter Sampler::matter_of(std::uint32_t particle) const {
  Matter matter;
  matter.extinction = !particles_.extinctions.empty() ? particles_.extinctions[particle]
                      : !particles_.factors.empty()   ? particles_.extinction * particles_.factors[particle]
                                                      : particles_.extinction;
  if (own_albedos_) matter.scattering = matter.extinction * particles_.albedos[particle];
  return matter;
}

void Sampler::add_row(const Placed& particle, int first, int last, float beside, std::size_t row,
                      TileSums& sums) const {
  const auto add_to = [&](std::vector<float>& values, const auto& weight, float factor) {
    float* out = values.data() + row;
    for (int i = first; i <= last; ++i) out[i] += weight(i) * factor;
  };
  const auto add_all = [&](const auto& weight) {
    add_to(sums.weight, weight, 1.0f);
    if (same_matter_ && !own_albedos_) return;
    for (int c = 0; c < grid_.channels; ++c)
      add_to(sums.extinction[static_cast<std::size_t>(c)], weight, particle.matter.extinction[c]);
    if (!own_albedos_) return;
    for (int c = 0; c < 3; ++c)
      add_to(sums.scattering[static_cast<std::size_t>(c)], weight, particle.matter.scattering[c]);
  };
  if (!smooth_) {
    add_all([](int) { return 1.0f; });
    return;
  }
  const float inverse = 1.0f / particle.reach;
  add_all([&](int i) {
    const float dx = static_cast<float>(i) - particle.center.x;
    const float u = std::sqrt(beside + dx * dx) * inverse;
    const float outer = max_of(1.0f - u, 0.0f), inner = max_of(0.5f - u, 0.0f);
    return smooth_norm_ * (2.0f * outer * outer * outer - 8.0f * inner * inner * inner);
  });
}

/// Row by row: the points of a row that a ball holds follow each other.
void Sampler::add(const Placed& particle, TileSums& sums) const {
  const int side = tile_side * points_;
  const auto first_of = [](float low) { return std::max(0, static_cast<int>(std::ceil(low))); };
  const auto last_of = [side](float high) { return std::min(side - 1, static_cast<int>(std::floor(high))); };
  const Vec3 c = particle.center;
  const float r = particle.reach;
  for (int k = first_of(c.z - r); k <= last_of(c.z + r); ++k) {
    const float dz = static_cast<float>(k) - c.z, left_of_z = r * r - dz * dz;
    if (!(left_of_z > 0)) continue;
    const float half_y = std::sqrt(left_of_z);
    for (int j = first_of(c.y - half_y); j <= last_of(c.y + half_y); ++j) {
      const float dy = static_cast<float>(j) - c.y, left_of_y = left_of_z - dy * dy;
      if (!(left_of_y > 0)) continue;
      const float half_x = std::sqrt(left_of_y);
      add_row(particle, first_of(c.x - half_x), last_of(c.x + half_x), r * r - left_of_y,
              static_cast<std::size_t>((k * side + j) * side), sums);
    }
  }
}

static_assert(points_of_balls == 4 && points_of_smooth == 1, "the sums below are written out");

/// Adds up what `value` gives for the points of each cell of a tile, row by row.
template <class Value>
void Sampler::add_up(const Value& value, std::array<float, tile_cells>& cells) const {
  cells.fill(0.0f);
  const int side = tile_side * points_;
  std::array<float, tile_side * points_of_balls> values;
  for (int row = 0; row < side * side; ++row) {
    float* out = cells.data() + (row / side / points_ * tile_side + row % side / points_) * tile_side;
    const auto first = static_cast<std::size_t>(row * side);
    // All of a row first: its divisions are done several at a time.
    for (std::size_t i = 0; i < static_cast<std::size_t>(side); ++i) values[i] = value(first + i);
    if (points_ == points_of_balls) {
      for (std::size_t x = 0; x < tile_side; ++x)
        out[x] += values[4 * x] + values[4 * x + 1] + values[4 * x + 2] + values[4 * x + 3];
    } else {
      for (std::size_t x = 0; x < tile_side; ++x) out[x] += values[x];
    }
  }
}

/// Cells are the means of their points: balls are averaged at each point, smooth sums are what they are.
void Sampler::reduce(const TileSums& sums, std::size_t tile) const {
  const float share = 1.0f / static_cast<float>(points_ * points_ * points_);
  // Weights of balls count them. Where there is none the sums are 0, whatever they are divided by.
  const auto mean_of = [&](const std::vector<float>& values, std::array<float, tile_cells>& cells) {
    if (smooth_)
      add_up([&](std::size_t at) { return values[at]; }, cells);
    else
      add_up([&](std::size_t at) { return values[at] / max_of(sums.weight[at], 1.0f); }, cells);
  };
  std::array<float, tile_cells> cells;
  const auto channels = static_cast<std::size_t>(grid_.channels);
  float* extinction = grid_.extinction.data() + tile * tile_cells * channels;
  for (std::size_t c = 0; c < channels; ++c) {
    float factor = share;
    if (same_matter_ && !own_albedos_) {
      factor *= particles_.extinction[static_cast<int>(c)];
      mean_of(sums.weight, cells);
    } else {
      mean_of(sums.extinction[c], cells);
    }
    for (std::size_t cell = 0; cell < tile_cells; ++cell) extinction[cell * channels + c] = factor * cells[cell];
  }
  if (!own_albedos_) return;
  for (std::size_t c = 0; c < 3; ++c) {
    mean_of(sums.scattering[c], cells);
    for (std::size_t cell = 0; cell < tile_cells; ++cell) {
      const float k = extinction[cell * channels + (channels == 1 ? 0 : c)];
      grid_.albedo[tile * tile_cells + cell][static_cast<int>(c)] =
          k > 0 ? min_of(share * cells[cell] / k, 1.0f) : 0.0f;
    }
  }
}

void Sampler::sample_tile(std::size_t tile, TileSums& sums) const {
  const auto count = static_cast<std::size_t>(std::pow(tile_side * points_, 3));
  sums.weight.assign(count, 0.0f);
  if (!same_matter_ || own_albedos_)
    for (int c = 0; c < grid_.channels; ++c) sums.extinction[static_cast<std::size_t>(c)].assign(count, 0.0f);
  if (own_albedos_)
    for (std::vector<float>& channel : sums.scattering) channel.assign(count, 0.0f);

  const auto& [x, y, z] = grid_.tiles[tile];
  const float width = grid_.cell * tile_side, per_metre = static_cast<float>(points_) / grid_.cell;
  const Vec3 low = grid_.origin + width * Vec3{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  std::vector<std::uint32_t> near;
  balls_.find_near(low, low + Vec3{width, width, width}, near);
  for (const std::uint32_t b : near) {
    const ParticleBlock& block = balls_.blocks()[b];
    for (std::size_t lane = 0; lane < 16; ++lane) {
      const std::uint32_t ball = balls_.sources()[16 * b + lane];
      if (ball == ParticleBlocks::no_particle) continue;
      const Vec3 center =
          (Vec3{block.x[lane], block.y[lane], block.z[lane]} - low) * per_metre - Vec3{0.5f, 0.5f, 0.5f};
      add({center, per_metre / std::sqrt(block.inverse_influence_squared[lane]), matter_of(sources_[ball])}, sums);
    }
  }
  reduce(sums, tile);
}

}  // namespace

DensityGrid sample_density(const DensityParticles& particles, float cell, const std::function<void(double)>& progress) {
  DensityGrid grid;
  grid.cell = cell;
  Sampler sampler(particles, grid);
  for (const std::uint64_t key : sampler.tile_keys()) grid.tiles.push_back(tile_place(key));
  grid.extinction.resize(grid.tiles.size() * tile_cells * static_cast<std::size_t>(grid.channels));
  if (!particles.albedos.empty()) grid.albedo.resize(grid.tiles.size() * tile_cells);
  Meter meter(progress, 0, 1, std::max<std::size_t>(1, grid.tiles.size()));
  parallel_for(grid.tiles.size(), 8, [&](std::size_t begin, std::size_t end) {
    TileSums sums;
    for (std::size_t tile = begin; tile < end; ++tile) {
      sampler.sample_tile(tile, sums);
      meter.add(1);
    }
  });
  return grid;
}

}  // namespace embrun
