#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "backend/cpu/cpu_backend.h"
#include "image/film.h"
#include "scene/compile.h"

namespace embrun {

/// How a render is watched and stopped.
struct RenderControl {
  int threads = 0;  ///< 0: all that the process may use
  /// Told how many of how many samples are done, about ten times a second, from any thread but by one at a time.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress;
  const std::atomic<bool>* cancel = nullptr;
};

// The steps of a render, for those who drive them themselves (a viewer, a farm):
//   FlatScene flat = compile_meshing(scene);            render/fluid_meshes.h
//   Film film = make_film(scene.film);
//   CpuBackend backend(flat);
//   render_samples(backend, film, 0, samples, control); as often as wanted, with the next samples
//   ImageLayers layers = resolve(film);                 image/film.h

/// Calls `work` in an arena of so many threads; what it parallelises runs there.
void run_on_threads(int threads, const std::function<void()>& work);
/// The number of threads that `threads` stands for in RenderControl.
int thread_count(int threads);

/// An empty film of the description's picture or crop.
Film make_film(const FilmDescription& film);

/// Adds samples first .. first + count - 1 to every pixel of the film, in passes over the whole picture, so that an
/// interrupted one is even. Adds up what the passes counted.
RenderCounts render_samples(const CpuBackend& backend, Film& film, std::uint32_t first, std::uint32_t count,
                            const RenderControl& control = {});

struct RenderResult {
  Film film;
  RenderCounts counts;
  ImageLayers layers;
};

/// All of it in one call, with the samples and settings of the description.
RenderResult render(const SceneDescription& scene, const RenderControl& control = {});

}  // namespace embrun
