#include "geometry/surface_model.h"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/field_sums.h"
#include "geometry/kernels.h"
#include "geometry/particle_blocks.h"

namespace embrun {

namespace {

constexpr int largest_order = 32;

void check_settings(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceSettings& settings) {
  if (positions.empty()) throw Error("a surface needs at least one particle");
  if (!(settings.radius > 0) || !is_finite(settings.radius)) {
    throw Error(fmt::format("particle radius {} must be positive and finite", settings.radius));
  }
  if (settings.order < 1 || settings.order > largest_order) {
    throw Error(fmt::format("neighbourhood order {} must be from 1 to {}", settings.order, largest_order));
  }
  if (!(settings.spacing >= 0) || !std::isfinite(settings.spacing)) {
    throw Error(
        fmt::format("rest spacing {} must be positive and finite, or 0 for twice the radius", settings.spacing));
  }
  if (settings.threshold_mode == ThresholdMode::number &&
      (!(settings.threshold > 0) || !is_finite(settings.threshold))) {
    throw Error(fmt::format("surface threshold {} must be positive and finite", settings.threshold));
  }
  if (!radii.empty() && radii.size() != positions.size()) {
    throw Error(fmt::format("{} particle radii for {} particles", radii.size(), positions.size()));
  }
  for (std::size_t i = 0; i < radii.size(); ++i) {
    if (!(radii[i] > 0) || !is_finite(radii[i])) {
      throw Error(fmt::format("radius {} of particle {} must be positive and finite", radii[i], i));
    }
  }
}

/// <R^3>/s^3.
double filling(std::span<const float> radii, const SurfaceSettings& settings) {
  if (settings.spacing == 0) return 1.0 / 8.0;
  double cubes = std::pow(static_cast<double>(settings.radius), 3);
  if (!radii.empty()) {
    cubes = 0;
    for (const float radius : radii) cubes += std::pow(static_cast<double>(radius), 3);
    cubes /= static_cast<double>(radii.size());
  }
  return cubes / std::pow(settings.spacing, 3);
}

float resolve_threshold(const SurfaceModel& model, const SurfaceSettings& settings) {
  switch (settings.threshold_mode) {
    case ThresholdMode::automatic: return model.order == 1 ? kernel_value(model.kernel, 0.5f) : 0.5f * model.mean_field;
    case ThresholdMode::thesis: return static_cast<float>(2 * model.order - 1);
    case ThresholdMode::number: return settings.threshold;
  }
  return settings.threshold;
}

/// Sorts the blocks `near` block b roughly by the distance of their centres, nearest first.
void order_by_distance(std::span<const ReachBox> bounds, std::size_t b, const std::vector<std::uint32_t>& near,
                       std::vector<std::uint32_t>& ordered) {
  constexpr int shell_count = 16;
  const auto shell = [&](std::uint32_t n) {
    const Vec3 offset = bounds[n].low + bounds[n].high - bounds[b].low - bounds[b].high;
    const float relative = 0.5f * length(offset) / (bounds[n].reach + 0.25f * length(bounds[b].high - bounds[b].low));
    return static_cast<std::size_t>(min_of(relative * shell_count, static_cast<float>(shell_count - 1)));
  };
  std::array<std::uint32_t, shell_count + 1> starts{};
  for (const std::uint32_t n : near) ++starts[shell(n) + 1];
  for (std::size_t i = 1; i <= shell_count; ++i) starts[i] += starts[i - 1];
  ordered.resize(near.size());
  for (const std::uint32_t n : near) ordered[starts[shell(n)]++] = n;
}

/// D at the particles, in their order; sums may stop at `enough` (see FieldSums::values).
std::vector<float> sum_at_particles(std::span<const Vec3> positions, std::span<const float> influence, Kernel kernel,
                                    float enough) {
  const ParticleBlocks particles(positions, influence, {}, kernel_support(kernel));
  const FieldSums& sums = field_sums();
  std::vector<float> result(positions.size());
  parallel_for(particles.blocks().size(), 32, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> near, ordered;
    for (std::size_t b = begin; b < end; ++b) {
      const ReachBox& box = particles.bounds()[b];
      near.clear();
      particles.find_near(box.low, box.high, near);
      order_by_distance(particles.bounds(), b, near, ordered);
      const ParticleBlock& block = particles.blocks()[b];
      float values[16];
      sums.values(kernel, {particles.blocks().data(), particles.bounds().data(), ordered.data(), ordered.size()},
                  block.x, block.y, block.z, enough, values);
      const std::uint32_t* sources = particles.sources().data() + 16 * b;
      for (std::size_t lane = 0; lane < 16; ++lane) {
        if (sources[lane] != ParticleBlocks::no_particle) result[sources[lane]] = values[lane];
      }
    }
  });
  return result;
}

constexpr float weight_starts_falling = 0.6f, weight_ends = 1.2f;

void find_recovered(std::span<const Vec3> positions, std::span<const float> radii, RecoverMode mode,
                    SurfaceModel& model) {
  // Beyond this no particle is recovered, and a particle's own f(0) = 1 may be enough.
  const float limit = mode == RecoverMode::thesis ? 1.0f : weight_ends;
  if (limit * model.threshold <= 1.0f) return;
  std::vector<float> influence{model.influence_radius};
  if (!radii.empty()) {
    influence.assign(radii.begin(), radii.end());
    for (float& b : influence) b *= model.influence_factor;
  }
  // A little more than the limit keeps rounding out of it.
  const std::vector<float> field =
      sum_at_particles(positions, influence, model.kernel, 1.001f * limit * model.threshold);
  for (std::size_t i = 0; i < field.size(); ++i) {
    const float weight = mode == RecoverMode::thesis ? (field[i] < model.threshold ? 1.0f : 0.0f)
                                                     : recover_weight(field[i] / model.threshold);
    if (weight <= 0) continue;
    model.recovered.push_back(static_cast<std::uint32_t>(i));
    model.recovered_weights.push_back(weight);
  }
}

}  // namespace

float recover_weight(float q) {
  const float v = clamp((weight_ends - q) / (weight_ends - weight_starts_falling), 0.0f, 1.0f);
  return v * v * (3.0f - 2.0f * v);
}

std::vector<float> particle_field_values(std::span<const Vec3> positions, std::span<const float> influence,
                                         Kernel kernel) {
  return sum_at_particles(positions, influence, kernel, std::numeric_limits<float>::max());
}

SurfaceModel resolve_surface_model(std::span<const Vec3> positions, std::span<const float> radii,
                                   const SurfaceSettings& settings) {
  check_settings(positions, radii, settings);
  SurfaceModel model = resolve_surface_constants(radii, settings);
  if (settings.recover != RecoverMode::off) find_recovered(positions, radii, settings.recover, model);
  return model;
}

SurfaceModel resolve_surface_constants(std::span<const float> radii, const SurfaceSettings& settings) {
  SurfaceModel model;
  model.kernel = settings.kernel;
  model.order = settings.order;
  model.normal = settings.normal;
  model.radius = settings.radius;
  model.influence_factor = 2.0f * static_cast<float>(settings.order);
  model.influence_radius = model.influence_factor * model.radius;
  model.mean_field = static_cast<float>(kernel_integral(model.kernel) * std::pow(model.influence_factor, 3) *
                                        filling(radii, settings));
  model.threshold = resolve_threshold(model, settings);
  model.recover_radius = model.recover_factor * model.radius;
  model.recover_threshold = kernel_value(model.kernel, 1.0f / model.recover_factor);
  return model;
}

}  // namespace embrun
