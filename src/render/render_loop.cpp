#include "render/render_loop.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <mutex>

#include "render/fluid_meshes.h"

namespace embrun {
namespace {

/// Passes on how far a render is, now and then.
class ProgressMeter {
 public:
  ProgressMeter(const RenderControl& control, std::uint64_t total) : control_(control), total_(total) {}

  void add(std::uint64_t samples) {
    const std::uint64_t done = done_.fetch_add(samples, std::memory_order_relaxed) + samples;
    if (!control_.progress) return;
    // Whoever comes while another one tells has nothing to add.
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    control_.progress(done, total_);
  }

 private:
  const RenderControl& control_;
  std::uint64_t total_;
  std::atomic<std::uint64_t> done_{0};
  std::mutex mutex_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

void merge_counts(RenderCounts& sum, RenderCounts&& pass) {
  add(sum.paths, pass.paths);
  sum.bad_samples.insert(sum.bad_samples.end(), pass.bad_samples.begin(), pass.bad_samples.end());
  sum.contradicting.insert(sum.contradicting.end(), pass.contradicting.begin(), pass.contradicting.end());
  sum.cancelled = sum.cancelled || pass.cancelled;
}

}  // namespace

void run_on_threads(int threads, const std::function<void()>& work) {
  // More threads than processors is the caller's to ask for.
  const auto wanted = static_cast<std::size_t>(thread_count(threads));
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, wanted);
  tbb::task_arena arena(static_cast<int>(wanted));
  arena.execute(work);
}

int thread_count(int threads) { return threads > 0 ? threads : tbb::this_task_arena::max_concurrency(); }

Film make_film(const FilmDescription& film) {
  return film.crop ? make_film(film.width, film.height, *film.crop) : make_film(film.width, film.height);
}

RenderCounts render_samples(const CpuBackend& backend, Film& film, std::uint32_t first, std::uint32_t count,
                            const RenderControl& control) {
  constexpr std::uint32_t longest_pass = 16;
  const std::uint64_t total = film.pixel_count() * count;
  ProgressMeter meter(control, total);
  RenderCounts counts;
  run_on_threads(control.threads, [&] {
    // 1, 1, 2, 4, ... samples: something to look at soon, and few passes in all.
    std::uint32_t done = 0;
    while (done < count && !counts.cancelled) {
      const std::uint32_t pass = std::min({std::max(done, 1u), longest_pass, count - done});
      merge_counts(counts, backend.render_samples(film, first + done, pass, control.cancel,
                                                  [&](std::uint64_t samples) { meter.add(samples); }));
      done += pass;
    }
  });
  if (control.progress && !counts.cancelled) control.progress(total, total);
  return counts;
}

RenderResult render(const SceneDescription& scene, const RenderControl& control) {
  RenderResult result;
  FlatScene flat;
  std::unique_ptr<CpuBackend> backend;
  run_on_threads(control.threads, [&] {
    flat = compile_meshing(scene);
    backend = std::make_unique<CpuBackend>(flat);
  });
  result.film = make_film(scene.film);
  result.counts =
      render_samples(*backend, result.film, 0, static_cast<std::uint32_t>(scene.integrator.samples), control);
  result.layers = resolve(result.film);
  return result;
}

}  // namespace embrun
