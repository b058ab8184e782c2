#pragma once

#include <cstdint>

#include "camera/camera.h"
#include "geometry/detail_blocks.h"
#include "integrators/direction_guide.h"
#include "lights/integrator_kind.h"
#include "lights/light_set.h"
#include "materials/material.h"
#include "media/grid_medium.h"
#include "media/media_state.h"
#include "media/particle_flight.h"
#include "sampling/hemisphere_rule.h"

namespace embrun {

/// How light that reaches a diffuse surface is sampled. `mis` is for pictures; the others are unbiased too
/// (`lights_only`: as long as every light can be sampled) and exist to check it.
enum class LightStrategy : std::uint8_t { mis, bsdf_only, lights_only };

struct PathSettings {
  IntegratorKind integrator = IntegratorKind::path;
  std::uint32_t seed = 0;
  SamplerKind sampler = SamplerKind::sobol;
  LightStrategy lights = LightStrategy::mis;
  /// Most scattering events of a path, 0 to 65535; the light met after the last one counts. Index-matched
  /// boundaries are no events.
  int max_depth = 256;
  /// Events after which Russian roulette may end a path.
  int roulette_depth = 5;
  bool hide_emitters = false;  ///< not seen before the first event; shapes that shine are not there
  /// Interfaces that a path may go through by refraction, or -1 for any number. After the last one every interface
  /// is crossed straight on, without reflection.
  int max_refractions = -1;
  /// How flights through particles are drawn, and how the transmittance of shadow rays is found.
  FlightSampler flights = FlightSampler::tracking, transmittance = FlightSampler::tracking;
  /// Shadow rays go straight through interfaces: see IntegratorDescription::straight_shadows.
  bool straight_shadows = false;
  /// Lamps also light points of media that are drawn by where the lamp is: see equiangular.h.
  bool equiangular = false;
  /// Most radiance that light found after the first event may bring; infinite: no limit.
  float clamp = infinity;
  /// Of ambient occlusion: what is farther away occludes nothing, metres.
  float occlusion_distance = infinity;
};

/// What the stages of a path need besides an intersector: a view of arrays that others own.
struct PathScene {
  const Material* materials = nullptr;
  Medium media[max_media_classes];
  ParticleDensityView density;        ///< the particles of all media
  std::uint32_t volumes = 0;          ///< mask of its fluids that count everywhere: foam, fog
  const GridMedium* grids = nullptr;  ///< by Medium::grid
  LightSet lights;
  Camera camera;
  MediaState camera_media;  ///< what the camera is in
  DetailBlocks detail;
  DirectionGuide guide;
  HemisphereRule rule;  ///< of IntegratorKind::gauss
  PathSettings settings;
};

}  // namespace embrun
