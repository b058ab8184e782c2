// The versions of the per-ray code: every instruction set must find the same crossings and the same light.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "backend/cpu/cpu_backend.h"
#include "render/transport.h"
#include "scene/compile.h"

namespace embrun {
namespace {

using namespace testing_support;

std::vector<InstructionSet> sets_of_this_machine() {
  std::vector<InstructionSet> sets;
  for (const InstructionSet set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512})
    if (set <= instruction_set()) sets.push_back(set);
  return sets;
}

/// One of everything that a ray can meet.
SceneDescription full_scene() {
  SceneDescription scene = scene_seen({1.7, 1.1, 2.6}, {0, 0, 0}, 45, 24, 32);
  FluidDescription fluid = lattice_fluid({-0.6, -0.4, -0.6}, {0.3, 0.3, 0.6}, 0.15, 2);
  fluid.container = Box3d{{-2, -2, -0.5}, {2, 2, 2}};
  scene.fluids.push_back(fluid);
  scene.balls.push_back(balls({{{0.6, -0.2, 0.2}, 0.2}}, diffuse_material({0.7f, 0.5f, 0.3f})));
  scene.balls.push_back(balls({{{-0.2, 0, 0}, 0.1}, {{-0.1, 0, 0.1}, 0.1}}, dielectric_material(1, {}, 2)));
  scene.boxes.push_back(box({0.5, -0.4, -0.6}, {0.8, -0.1, -0.3}, dielectric_material(1.5)));
  scene.patches.push_back(patch({0, -0.4, 0}, {1, 0, 0}, {0, 0, -1}, 3, diffuse_material(grey(0.5f))));
  MeshDescription mesh;
  mesh.mesh.positions = {{-1, -0.4f, -1}, {1, -0.4f, -1}, {0, 1, -1}};
  mesh.mesh.triangles = {{{0, 1, 2}}};
  scene.meshes.push_back(mesh);
  LightDescription lamp;
  lamp.kind = LightDescription::Kind::sphere;
  lamp.position = {1, 2, 1};
  lamp.radius = 0.3;
  lamp.radiance = grey(10);
  scene.lights.push_back(lamp);
  scene.environment.constant = grey(0.3f);
  return scene;
}

TEST(Kernels, FindTheSameCrossings) {
  const FlatScene flat = compile(full_scene());
  constexpr int count = 20000;
  std::vector<Ray> rays(count);
  std::vector<MediaState> media(count);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(-1, 1);
  const CpuBackend reference(flat, kernels_of(InstructionSet::baseline));
  for (int i = 0; i < count; ++i) {
    rays[i].origin = {uniform(random), 0.3f * uniform(random), uniform(random)};
    rays[i].direction = normalize(Vec3{uniform(random), uniform(random), uniform(random)});
    media[i] = reference.kernels().media_at(reference.view(), rays[i].origin, 0.0f);
  }
  std::vector<SceneHit> expected(count), hits(count);
  std::vector<char> found_expected(count), found(count);
  const auto trace = [&](const CpuBackend& backend, std::vector<char>& f, std::vector<SceneHit>& h) {
    backend.kernels().intersect(backend.view(), rays.data(), media.data(), count, reinterpret_cast<bool*>(f.data()),
                                h.data());
  };
  trace(reference, found_expected, expected);
  for (const InstructionSet set : sets_of_this_machine()) {
    const CpuBackend backend(flat, kernels_of(set));
    trace(backend, found, hits);
    int different = 0, hit = 0;
    for (int i = 0; i < count; ++i) {
      hit += found[i];
      const bool same =
          found[i] == found_expected[i] && (!found[i] || (std::abs(hits[i].surface.t - expected[i].surface.t) < 1e-4f &&
                                                          hits[i].material == expected[i].material &&
                                                          hits[i].surface.entering == expected[i].surface.entering));
      different += !same;
    }
    // Rounding may decide which of two surfaces at one place is met.
    EXPECT_LE(different, count / 2000) << name_of(set);
    EXPECT_GT(hit, count / 3);
    EXPECT_LT(hit, count);
  }
}

TEST(Kernels, SeeTheSameLight) {
  const SceneDescription scene = full_scene();
  const FlatScene flat = compile(scene);
  std::vector<Measured> pictures;
  for (const InstructionSet set : sets_of_this_machine()) {
    const CpuBackend backend(flat, kernels_of(set));
    Film film = make_film(scene.film);
    const RenderCounts counts = render_samples(backend, film, 0, 32);
    pictures.push_back(measure(film));
    EXPECT_EQ(counts.paths.contradictions, 0u) << name_of(set);
    EXPECT_EQ(pictures.back().bad, 0u) << name_of(set);
  }
  // The same random numbers: only the few paths that rounding sends elsewhere differ.
  for (const Measured& picture : pictures) EXPECT_NEAR(picture.mean, pictures[0].mean, 0.5 * picture.standard_error);
}

// A path that brings NaN is left out, counted and named; which ones does not depend on the threads, and each is bad
// again when it is traced alone.
TEST(Kernels, BadSamplesAreCountedAndNamed) {
  SceneDescription scene = full_scene();
  scene.fluids.clear();
  FlatScene flat = compile(scene);
  // The ball's reflectance, as no description could have it.
  flat.materials[flat.instances[0].material].reflectance.first.g = std::nanf("");
  const CpuBackend backend(flat);
  Film film = make_film(scene.film), other = make_film(scene.film);
  RenderCounts counts;
  run_on_threads(1, [&] { counts = backend.render_samples(film, 0, 4); });
  RenderCounts again;
  run_on_threads(5, [&] { again = backend.render_samples(other, 0, 4); });
  EXPECT_GT(bad_samples(film), 16u);
  EXPECT_EQ(bad_samples(film) + good_samples(film), 24u * 24u * 4u);
  EXPECT_EQ(bad_samples(film), bad_samples(other));
  for (const FilmPixel& pixel : film.pixels) EXPECT_TRUE(std::isfinite(pixel.radiance[1]));
  ASSERT_EQ(counts.bad_samples.size(), 16u);
  for (std::size_t i = 0; i < 16; ++i) {
    const PixelSample& bad = counts.bad_samples[i];
    EXPECT_EQ(bad.x, again.bad_samples[i].x);
    EXPECT_EQ(bad.y, again.bad_samples[i].y);
    EXPECT_EQ(bad.sample, again.bad_samples[i].sample);
    Film alone = make_film(24, 24, PixelWindow{bad.x, bad.y, 1, 1});
    backend.render_samples(alone, bad.sample, 1);
    EXPECT_EQ(bad_samples(alone), 1u);
  }
}

TEST(Kernels, TheCameraRaysOfABatchAreCounted) {
  const SceneDescription scene = full_scene();
  const FlatScene flat = compile(scene);
  const CpuBackend backend(flat);
  Film film = make_film(scene.film);
  const RenderCounts counts = backend.render_samples(film, 0, 3);
  EXPECT_EQ(counts.paths.camera.rays, 24u * 24u * 3u);
  EXPECT_EQ(counts.paths.paths, 24u * 24u * 3u);
  EXPECT_GT(counts.paths.outside.rays, 0u);
  EXPECT_GT(counts.paths.inside.rays, 0u);
  EXPECT_GT(counts.paths.shadow.rays, 0u);
  EXPECT_GT(counts.paths.camera.timed_rays, 0u);
  EXPECT_LE(counts.paths.camera.timed_rays, counts.paths.camera.rays);
}

}  // namespace
}  // namespace embrun
