#include "backend/cpu/cpu_backend.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <mutex>
#include <tuple>

#include "backend/cpu/batch_memory.h"
#include "backend/cpu/embree_scene.h"
#include "backend/cpu/guide_learner.h"
#include "base/parallel.h"
#include "integrators/equiangular.h"

namespace embrun {
namespace {

constexpr int tile_side = 16;
constexpr std::uint64_t timed_batches = 16;    // one of so many
constexpr std::size_t most_kept_samples = 16;  // of each fault, that are kept by name

bool earlier(const PixelSample& a, const PixelSample& b) {
  return std::tie(a.y, a.x, a.sample) < std::tie(b.y, b.x, b.sample);
}

/// Adds samples to those that are kept, which are the first few.
void keep_first(std::vector<PixelSample>& kept, const std::vector<PixelSample>& more) {
  kept.insert(kept.end(), more.begin(), more.end());
  std::sort(kept.begin(), kept.end(), earlier);
  if (kept.size() > most_kept_samples) kept.resize(most_kept_samples);
}

/// Gathers what tasks counted, from any thread; the result does not depend on their order.
class Gatherer {
 public:
  void take(const RenderCounts& task) {
    const std::lock_guard lock(mutex_);
    add(counts_.paths, task.paths);
    keep_first(counts_.bad_samples, task.bad_samples);
    keep_first(counts_.contradicting, task.contradicting);
    counts_.cancelled = counts_.cancelled || task.cancelled;
  }
  RenderCounts result() { return std::move(counts_); }

 private:
  std::mutex mutex_;
  RenderCounts counts_;
};

/// One tile's samples, a batch of paths at a time: all pixels' first sample, then all pixels' second, ...
struct TileTask {
  PixelWindow tile;
  std::uint32_t first, count;

  std::uint64_t total() const { return pixels() * count; }
  std::uint64_t pixels() const {
    return static_cast<std::uint64_t>(tile.width) * static_cast<std::uint64_t>(tile.height);
  }
  PixelSample sample(std::uint64_t index) const {
    const int pixel = static_cast<int>(index % pixels());
    return {tile.x + pixel % tile.width, tile.y + pixel / tile.width,
            first + static_cast<std::uint32_t>(index / pixels())};
  }
};

/// True when any light is at one place.
bool has_lamps(const LightSet& lights) {
  Vec3 middle;
  float reach = 0;
  return std::any_of(lights.lights, lights.lights + lights.count,
                     [&](const Light& light) { return lamp_middle(light, middle, reach); });
}

}  // namespace

CpuBackend::CpuBackend(const FlatScene& scene) : CpuBackend(scene, select_kernels()) {}

CpuBackend::CpuBackend(const FlatScene& scene, const KernelTable& kernels) : kernels_(kernels) {
  const auto start = std::chrono::steady_clock::now();
  embree_ = std::make_unique<EmbreeScene>(scene, kernels);
  tree_seconds_ = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  view_.flat = scene.view();
  view_.fluid_meshes = embree_->fluid_meshes().data();
  view_.top = embree_->top();
  view_.ball_sets = embree_->ball_sets().data();
  view_.has_meshes = std::any_of(scene.instances.begin(), scene.instances.end(),
                                 [](const Instance& instance) { return instance.kind == GeometryKind::mesh; });
  view_.ball_set_count = static_cast<int>(embree_->ball_sets().size());
  path_scene_.materials = scene.materials.data();
  for (std::size_t i = 0; i < scene.media.size(); ++i) path_scene_.media[i] = scene.media[i];
  path_scene_.density = scene.density.view();
  path_scene_.volumes = scene.volumes;
  path_scene_.grids = scene.grids.data();
  path_scene_.lights = scene.lights.view();
  path_scene_.camera = scene.camera;
  path_scene_.detail = {scene.detail_grid, scene.detail_filled.data()};
  path_scene_.camera_media = kernels_.media_at(view_, scene.camera.eye, 0.0f);
  PathSettings& settings = path_scene_.settings;
  settings.integrator = scene.integrator.kind;
  settings.seed = scene.integrator.seed;
  settings.sampler = scene.integrator.sampler;
  settings.max_depth = scene.integrator.max_depth;
  settings.max_refractions = scene.integrator.max_refractions;
  settings.roulette_depth = scene.integrator.roulette_depth;
  settings.hide_emitters = scene.integrator.hide_emitters;
  settings.straight_shadows = scene.integrator.straight_shadows;
  settings.equiangular = scene.integrator.equiangular && has_lamps(path_scene_.lights);
  settings.clamp = static_cast<float>(scene.integrator.clamp);
  settings.occlusion_distance = static_cast<float>(scene.integrator.occlusion_distance);
  path_scene_.rule = {scene.hemisphere_nodes.data(), static_cast<std::uint32_t>(scene.hemisphere_nodes.size())};
  // Others than path tracers have no stages for these, and ambient occlusion takes what refracts for opaque. A guide would
  // have its say in where the rule's nodes are.
  const bool is_path = settings.integrator == IntegratorKind::path;
  settings.equiangular = settings.equiangular && (is_path || settings.integrator == IntegratorKind::gauss);
  if (settings.integrator == IntegratorKind::ambient_occlusion) settings.max_refractions = -1;
  if (is_path && scene.integrator.guide && needs_guide(scene)) {
    guide_ = std::make_unique<LearnedGuide>(learn_guide(kernels_, path_scene_, view_));
    path_scene_.guide = guide_->view();
  }
}

CpuBackend::~CpuBackend() = default;

std::vector<PixelSample> CpuBackend::find_contradicting(const PixelSample* samples, int count, PathBatch& batch) const {
  const auto trace_samples = kernels_.trace_samples[static_cast<int>(path_scene_.settings.integrator)];
  std::vector<PixelSample> found;
  for (int i = 0; i < count; ++i) {
    FilmSample ignored;
    PathCounters alone;
    trace_samples(path_scene_, view_, &samples[i], 1, &ignored, false, batch, alone);
    if (alone.contradictions > 0) found.push_back(samples[i]);
  }
  return found;
}

RenderCounts CpuBackend::render_samples(Film& film, std::uint32_t first, std::uint32_t count,
                                        const std::atomic<bool>* cancel,
                                        const std::function<void(std::uint64_t)>& done) const {
  const PixelWindow window = film.window;
  const int columns = (window.width + tile_side - 1) / tile_side;
  const int rows = (window.height + tile_side - 1) / tile_side;
  tbb::enumerable_thread_specific<BatchMemory> memory([&] { return BatchMemory(kernels_); });
  Gatherer gatherer;
  const auto trace_samples = kernels_.trace_samples[static_cast<int>(path_scene_.settings.integrator)];

  const auto render_tile = [&](int index) {
    TileTask task;
    task.tile.x = window.x + index % columns * tile_side;
    task.tile.y = window.y + index / columns * tile_side;
    task.tile.width = std::min(tile_side, window.x + window.width - task.tile.x);
    task.tile.height = std::min(tile_side, window.y + window.height - task.tile.y);
    task.first = first;
    task.count = count;

    PathBatch& batch = memory.local().batch();
    PixelSample samples[batch_size];
    FilmSample results[batch_size];
    RenderCounts counts;
    for (std::uint64_t begin = 0; begin < task.total(); begin += batch_size) {
      if (cancel != nullptr && cancel->load(std::memory_order_relaxed)) {
        counts.cancelled = true;
        break;
      }
      const int n = static_cast<int>(std::min<std::uint64_t>(batch_size, task.total() - begin));
      for (int i = 0; i < n; ++i) samples[i] = task.sample(begin + static_cast<std::uint64_t>(i));
      const bool timed = (static_cast<std::uint64_t>(index) + begin / batch_size) % timed_batches == 0;
      const std::uint64_t contradictions = counts.paths.contradictions;
      trace_samples(path_scene_, view_, samples, n, results, timed, batch, counts.paths);
      for (int i = 0; i < n; ++i)
        if (!add_sample(film, film.pixel_index(samples[i].x, samples[i].y), results[i]) &&
            counts.bad_samples.size() < most_kept_samples)
          counts.bad_samples.push_back(samples[i]);
      if (counts.paths.contradictions > contradictions && counts.contradicting.size() < most_kept_samples)
        keep_first(counts.contradicting, find_contradicting(samples, n, batch));
      if (done) done(static_cast<std::uint64_t>(n));
    }
    gatherer.take(counts);
  };
  parallel_for(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 1,
               [&](std::size_t begin, std::size_t end) {
                 for (std::size_t i = begin; i < end; ++i) render_tile(static_cast<int>(i));
               });
  return gatherer.result();
}

}  // namespace embrun
