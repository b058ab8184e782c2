#include "meshing/surface_field.h"

#include <algorithm>
#include <cmath>

#include "geometry/kernels.h"

namespace embrun {

namespace {

/// What sums may be off by, relatively: bounds prove nothing within it.
constexpr float rounding = 1e-4f;

ParticleBlocks main_blocks(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceModel& model) {
  std::vector<float> influence(radii.begin(), radii.end());
  for (float& b : influence) b *= model.influence_factor;
  if (influence.empty()) influence.push_back(model.influence_radius);
  return {positions, influence, {}, kernel_support(model.kernel)};
}

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

float smallest_influence(std::span<const float> radii, const SurfaceModel& model) {
  if (radii.empty()) return model.influence_radius;
  return model.influence_factor * *std::min_element(radii.begin(), radii.end());
}

std::size_t pack(Kernel kernel, const ParticleBlocks& particles, Vec3 low, Vec3 high, std::vector<std::uint32_t>& found,
                 std::vector<ParticleBlock>& packed) {
  found.clear();
  particles.find_near(low, high, found);
  if (packed.size() < found.size()) packed.resize(found.size());
  return field_sums().pack(kernel, {particles.blocks().data(), particles.bounds().data(), found.data(), found.size()},
                           low, high, packed.data());
}

std::size_t repack(Kernel kernel, const PackedParticles& particles, Vec3 low, Vec3 high,
                   std::vector<ParticleBlock>& packed, float shell_begin = 0, float shell_end = 1e3f) {
  if (packed.size() < particles.block_count()) packed.resize(particles.block_count());
  return field_sums().repack(kernel, particles, low, high, shell_begin, shell_end, packed.data());
}

PackedParticles main_of(const SurfaceField::Near& near) { return {near.main.data(), near.main_count}; }
PackedParticles recovered_of(const SurfaceField::Near& near) { return {near.recovered.data(), near.recovered_count}; }

}  // namespace

SurfaceField::SurfaceField(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceModel& model)
    : kernel_(model.kernel),
      normal_(model.normal),
      inverse_threshold_(1.0f / model.threshold),
      inverse_recover_threshold_(1.0f / model.recover_threshold),
      smallest_influence_(smallest_influence(radii, model)),
      main_(main_blocks(positions, radii, model)),
      recovered_(recovered_blocks(positions, radii, model)) {}

void SurfaceField::find(Vec3 low, Vec3 high, Near& near) const {
  near.main_count = pack(kernel_, main_, low, high, near.found, near.main);
  near.recovered_count = pack(kernel_, recovered_, low, high, near.found, near.recovered);
}

void SurfaceField::find(const Near& from, Vec3 low, Vec3 high, Near& near) const {
  near.main_count = repack(kernel_, main_of(from), low, high, near.main);
  near.recovered_count = repack(kernel_, recovered_of(from), low, high, near.recovered);
}

void SurfaceField::drop_weak(Vec3 low, Vec3 high, Near& near) const {
  const FieldSums& sums = field_sums();
  if (sums.most(kernel_, main_of(near), low, high) * inverse_threshold_ < 1.0f - rounding) near.main_count = 0;
  if (sums.most(kernel_, recovered_of(near), low, high) * inverse_recover_threshold_ < 1.0f - rounding)
    near.recovered_count = 0;
}

SurfaceField::Region SurfaceField::classify(Vec3 low, Vec3 high, const Near& near) const {
  if (near.empty()) return Region::outside;
  // In a box that is large against the influence radii they prove nothing.
  constexpr float worth_trying = 0.18f;
  if (near.main_count == 0 || length(high - low) > 2 * worth_trying * smallest_influence_) return Region::open;
  // D departs from its linear model by at most half the squared distance times a bound on its second derivative.
  const Vec3 half = 0.5f * (high - low);
  const float reach = length(half) * (1.0f + rounding);
  const FieldBound bound = field_sums().bound(kernel_, main_of(near), 0.5f * (low + high), reach);
  const float linear =
      fabsf(bound.gradient.x) * half.x + fabsf(bound.gradient.y) * half.y + fabsf(bound.gradient.z) * half.z;
  const float least = bound.value - linear - 0.5f * reach * reach * bound.fall;
  if (least * inverse_threshold_ > 1.0f + rounding) return Region::inside;
  const float most = bound.value + linear + 0.5f * reach * reach * bound.rise;
  const bool recovered_weak =
      near.recovered_count == 0 ||
      field_sums().most(kernel_, recovered_of(near), low, high) * inverse_recover_threshold_ < 1.0f - rounding;
  return recovered_weak && most * inverse_threshold_ < 1.0f - rounding ? Region::outside : Region::open;
}

SurfaceField::Region SurfaceField::sample(const Near& near, Vec3 corner, float cell, Near& scratch,
                                          float* values) const {
  const FieldSums& sums = field_sums();
  const float side = cell * (lattice_side - 1);
  const Vec3 low = corner, high = corner + Vec3{side, side, side};
  scratch.recovered_count = repack(kernel_, recovered_of(near), low, high, scratch.recovered);
  if (sums.most(kernel_, recovered_of(scratch), low, high) * inverse_recover_threshold_ < 1.0f - rounding)
    scratch.recovered_count = 0;

  // The near particles make most of the field: where they suffice, or the far ones cannot, those need no summing.
  const float near_share = 0.65f * kernel_support(kernel_);
  scratch.main_count = repack(kernel_, main_of(near), low, high, scratch.main, 0, near_share);
  const std::size_t far_count = repack(kernel_, main_of(near), low, high, scratch.far, near_share);
  const PackedParticles far{scratch.far.data(), far_count};
  const float most_of_far = sums.most(kernel_, far, low, high);
  const auto lattice = [&](const PackedParticles& particles, float* out) {
    sums.lattice(kernel_, particles, corner, cell, out);
    return std::minmax_element(out, out + lattice_size);
  };
  std::fill(values, values + lattice_size, 0.0f);
  const auto [least, most] = lattice(main_of(scratch), values);
  if (*least * inverse_threshold_ > 1.0f + rounding) return Region::inside;
  const bool main_weak = (*most + most_of_far) * inverse_threshold_ < 1.0f - rounding;
  if (main_weak && scratch.recovered_count == 0) return Region::outside;
  if (!main_weak) lattice(far, values);

  for (int i = 0; i < lattice_size; ++i) values[i] *= inverse_threshold_;
  if (scratch.recovered_count > 0) {
    alignas(64) float recovered[lattice_size] = {};
    lattice(recovered_of(scratch), recovered);
    for (int i = 0; i < lattice_size; ++i) values[i] = max_of(values[i], recovered[i] * inverse_recover_threshold_);
  }
  for (int i = 0; i < lattice_size; ++i) values[i] -= 1.0f;
  return Region::open;
}

SurfaceField::Slope SurfaceField::slope(const Near& near, Vec3 x, int axis) const {
  Slope main{-1, 0, false}, recovered{-1, 0, true};
  const auto relative = [&](const PackedParticles& particles, float scale, Slope& branch) {
    if (particles.count == 0) return;
    const FieldSlope field = field_sums().slope(kernel_, particles, x, axis);
    branch.value = field.value * scale - 1.0f;
    branch.slope = field.slope * scale;
  };
  relative(main_of(near), inverse_threshold_, main);
  relative(recovered_of(near), inverse_recover_threshold_, recovered);
  return recovered.value > main.value ? recovered : main;
}

SurfaceField::Normal SurfaceField::normal(const Near& near, Vec3 x) const {
  Normal main{-1, {}, false}, recovered{-1, {}, true};
  const auto relative = [&](const PackedParticles& particles, float scale, Normal& branch) {
    if (particles.count == 0) return;
    FieldNormal field = field_sums().normal(kernel_, normal_, particles, x);
    branch.value = field.value * scale - 1.0f;
    // In the middle of particles the weighted normals cancel.
    if (!(length_squared(field.normal) > 0) && normal_ == NormalMode::weighted)
      field = field_sums().normal(kernel_, NormalMode::gradient, particles, x);
    branch.normal = field.normal;
  };
  relative(main_of(near), inverse_threshold_, main);
  relative(recovered_of(near), inverse_recover_threshold_, recovered);
  Normal result = recovered.value > main.value ? recovered : main;
  result.normal = length_squared(result.normal) > 0 ? normalize(result.normal) : Vec3{0, 1, 0};
  return result;
}

}  // namespace embrun
