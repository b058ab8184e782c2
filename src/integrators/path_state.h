#pragma once

#include <cstdint>

#include "math/ray.h"
#include "media/media_state.h"
#include "sampling/sampler.h"

namespace embrun {

/// What a path did since light was last sampled for it.
enum class SinceLightSample : std::uint8_t {
  none,       ///< light never was
  nothing,    ///< light could have been met directly
  refracted,  ///< only refraction: straight shadow rays brought that light
  reflected,  ///< a specular reflection, perhaps refraction as well: no light sample brought that
};

/// One path from the camera, between two stages. Plain data.
///
/// `throughput` follows the radiance convention: crossing from index a into b multiplies it by (a/b)^2, so
/// inside water it is smaller by 1.77 than the share of the light that gets to the camera.
struct PathState {
  Ray ray;           ///< the segment to trace next
  Rgb throughput;    ///< what radiance along `ray` counts in the pixel
  Rgb radiance;      ///< gathered so far
  MediaState media;  ///< what `ray` starts in
  SampleKey key;     ///< whose random numbers; `bounce` counts scattering events, as depth does

  /// Density per steradian with which the direction of `ray` was drawn; 0: specular, or the camera.
  float scatter_pdf = 0;
  /// What guided directions made of the throughput: it is small where much light is expected, which is no reason to end a
  /// path, so Russian roulette leaves this factor out.
  float guide_factor = 1;

  std::uint16_t depth = 0;        ///< scattering events so far (index-matched boundaries do not count)
  std::uint16_t refractions = 0;  ///< those that went through an interface
  std::uint16_t passed = 0;       ///< boundaries crossed straight on since the last event
  bool alive = false;
  bool failed = false;       ///< gave up: not a sample
  bool left_medium = false;  ///< the last event was in a medium, not at a surface
  SinceLightSample since = SinceLightSample::none;

  // Features of the picture. Distance and normal are those of the first event; the albedo is that of the first
  // event that is not specular, and white for what is seen through specular events alone.
  bool has_normal = false, has_albedo = false;
  float first_distance = infinity;
  Vec3 first_normal;
  Rgb albedo;
};

/// Rays of one kind. A few of the batches are timed, with the clock of their thread.
struct RayCounter {
  std::uint64_t rays = 0;
  std::uint64_t timed_rays = 0, timed_ns = 0;
};

/// What a batch of paths counted.
struct PathCounters {
  RayCounter camera, outside, inside, shadow;  ///< secondary rays by what they start in: air, or anything else
  std::uint64_t paths = 0;
  std::uint64_t scatterings = 0;
  std::uint64_t bends = 0;           ///< directions that a shading normal sent across the true surface
  std::uint64_t contradictions = 0;  ///< crossings that disagreed with the media counters
  std::uint64_t collisions = 0;      ///< scatterings in media, which `scatterings` counts too
  std::uint64_t majorants = 0;  ///< extinctions found above their majorant: a defect, the picture is too bright or dark
  std::uint64_t stuck = 0;      ///< paths ended after max_passes crossings without an event
};

EMBRUN_FN void add(RayCounter& sum, const RayCounter& c) {
  sum.rays += c.rays;
  sum.timed_rays += c.timed_rays;
  sum.timed_ns += c.timed_ns;
}

EMBRUN_FN void add(PathCounters& sum, const PathCounters& c) {
  add(sum.camera, c.camera);
  add(sum.outside, c.outside);
  add(sum.inside, c.inside);
  add(sum.shadow, c.shadow);
  sum.paths += c.paths;
  sum.scatterings += c.scatterings;
  sum.bends += c.bends;
  sum.contradictions += c.contradictions;
  sum.collisions += c.collisions;
  sum.majorants += c.majorants;
  sum.stuck += c.stuck;
}

}  // namespace embrun
