#include "geometry/surface_levels.h"

#include <cmath>

#include "base/error.h"
#include "geometry/surface_model.h"

namespace embrun {
namespace {

/// D/T of the lattice at a particle under which it is spray: where its smooth weight (see recover_weight) is a half.
constexpr float spray_below = 0.9f;

}  // namespace

CoarseSurfaceView CoarseSurface::view() const {
  CoarseSurfaceView view;
  view.bulk = bulk.view();
  if (spray) {
    view.spray = spray->view();
    view.has_spray = true;
  }
  return view;
}

std::size_t CoarseSurface::bytes() const { return bulk.bytes() + (spray ? spray->stats().bytes : 0); }

float rest_spacing(const SurfaceSettings& settings) {
  return settings.spacing > 0 ? static_cast<float>(settings.spacing) : 2.0f * settings.radius;
}

std::optional<CoarseSurface> build_coarse_surface(std::span<const Vec3> positions, const SurfaceSettings& settings,
                                                  int level) {
  EMBRUN_CHECK(level >= 1);
  const SurfaceModel model = resolve_surface_constants({}, settings);
  const double spacing = static_cast<double>(rest_spacing(settings));
  std::vector<float> field;
  auto bulk = build_lattice_surface(positions, spacing, std::ldexp(spacing, level),
                                    static_cast<double>(model.threshold / model.mean_field), field);
  if (!bulk || bulk->near.empty()) return std::nullopt;
  CoarseSurface surface;
  surface.bulk = std::move(*bulk);
  surface.threshold = model.threshold;
  surface.influence_radius = model.influence_radius;
  if (settings.recover == RecoverMode::off) return surface;
  std::vector<Vec3> drops;
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (field[i] < spray_below) drops.push_back(positions[i]);
  surface.spray_particles = drops.size();
  if (drops.empty()) return surface;
  SurfaceSettings single = settings;
  single.order = 1;
  single.threshold_mode = ThresholdMode::automatic;
  single.recover = RecoverMode::off;
  surface.spray = build_implicit_surface(drops, {}, single, positions.size());
  return surface;
}

}  // namespace embrun
