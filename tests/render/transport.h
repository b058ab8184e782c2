#pragma once

#include <cmath>

#include "image/film.h"
#include "render/render_loop.h"

// Small scenes and their pictures as numbers, for tests that know the answer.

namespace embrun::testing_support {

/// Mean over all samples of all pixels, one channel, with its standard error.
struct Measured {
  double mean = 0, standard_error = 0;
  double least = 0, greatest = 0;  ///< of the pixels' means
  PathCounters counters;
  std::uint64_t bad = 0;
};

inline Measured measure(const Film& film, int channel = 0) {
  Measured m;
  m.least = 1e30;
  double sum = 0, squares = 0, count = 0;
  for (const FilmPixel& pixel : film.pixels) {
    sum += pixel.radiance[channel];
    squares += pixel.radiance_squares[channel];
    count += pixel.samples;
    const double mean = pixel.radiance[channel] / pixel.samples;
    m.least = std::fmin(m.least, mean);
    m.greatest = std::fmax(m.greatest, mean);
  }
  m.mean = sum / count;
  m.standard_error = std::sqrt(std::fmax(0.0, squares / count - m.mean * m.mean) / count);
  m.bad = bad_samples(film);
  return m;
}

inline Measured render_and_measure(const SceneDescription& scene, LightStrategy strategy = LightStrategy::mis,
                                   int channel = 0) {
  const FlatScene flat = compile(scene);
  CpuBackend backend(flat);
  backend.set_light_strategy(strategy);
  Film film = make_film(scene.film);
  const RenderCounts counts = render_samples(backend, film, 0, static_cast<std::uint32_t>(scene.integrator.samples));
  Measured m = measure(film, channel);
  m.counters = counts.paths;
  return m;
}

/// A camera that looks from one point to another with a picture of a few pixels, in an environment of radiance 1.
/// Independent samples, so that the standard error is what it says.
inline SceneDescription scene_seen(Vec3d from, Vec3d to, double fov, int size, int samples) {
  SceneDescription scene;
  scene.camera.eye = from;
  scene.camera.target = to;
  const Vec3d view = normalize(to - from);
  if (std::abs(view.y) > 0.99) scene.camera.up = {0, 0, -1};
  scene.camera.vertical_fov = fov;
  scene.film.width = scene.film.height = size;
  scene.integrator.samples = samples;
  scene.integrator.sampler = SamplerKind::independent;
  scene.integrator.max_depth = 60000;
  return scene;
}

/// All rays of the picture are the same to 1e-5.
inline constexpr double pencil = 1e-3;

inline PatchDescription patch(Vec3d center, Vec3d axis_u, Vec3d axis_v, double half, MaterialDescription material) {
  PatchDescription p;
  p.center = center;
  p.axis_u = axis_u;
  p.axis_v = axis_v;
  p.half_u = p.half_v = half;
  p.material = material;
  return p;
}

/// Walls all round the middle, 1 m away, that shine with 1 and reflect `reflectance`, and no other light.
inline void shut_in_shining_walls(SceneDescription& scene, float reflectance) {
  scene.environment.kind = EnvironmentDescription::Kind::none;
  const Vec3d x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  const auto wall = [&](Vec3d center, Vec3d u, Vec3d v) {
    PatchDescription p = patch(center, u, v, 1, diffuse_material(grey(reflectance)));
    p.radiance = grey(1);
    scene.patches.push_back(p);
  };
  // The normals, u x v, look inwards.
  wall(x, z, y), wall(Vec3d{-1, 0, 0}, y, z), wall(y, x, z), wall(Vec3d{0, -1, 0}, z, x), wall(z, y, x),
      wall(Vec3d{0, 0, -1}, x, y);
}

inline BoxDescription box(Vec3d low, Vec3d high, MaterialDescription material) { return {{low, high}, material}; }

inline BallsDescription balls(std::vector<BallDescription> list, MaterialDescription material) {
  return {std::move(list), material};
}

/// Particles on a cubic lattice of spacing s that fills [low, high].
inline FluidDescription lattice_fluid(Vec3d low, Vec3d high, double s, int order = 3) {
  FluidDescription fluid;
  for (double x = low.x + 0.5 * s; x < high.x; x += s)
    for (double y = low.y + 0.5 * s; y < high.y; y += s)
      for (double z = low.z + 0.5 * s; z < high.z; z += s) fluid.positions.push_back({x, y, z});
  fluid.surface.radius = static_cast<float>(0.5 * s);
  fluid.surface.spacing = s;
  fluid.surface.order = order;
  return fluid;
}

}  // namespace embrun::testing_support
