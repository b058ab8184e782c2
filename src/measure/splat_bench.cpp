#include "measure/splat_bench.h"

#include <time.h>

#include <algorithm>
#include <cmath>

#include "backend/cpu/embree_discs.h"
#include "backend/cpu/kernel_table.h"
#include "render/stopwatch.h"
#include "scene/compile_splats.h"

namespace embrun {
namespace {

/// The camera is so many half extents of the cloud away from its middle.
constexpr float camera_distance = 4;

double thread_seconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A room of panels for mirrors: bright above, a grid of dark lines round about.
float room_light(Vec3 direction) {
  const float turn = std::atan2(direction.x, direction.z) * (8 / pi), height = direction.y * 6;
  const bool line = turn - std::floor(turn) < 0.12f || height - std::floor(height) < 0.12f;
  return line ? 0.05f : 0.35f + 0.45f * (direction.y + 1) * 0.5f;
}

}  // namespace

SplatBench::SplatBench(const std::vector<Splat>& splats, bool closed, int pixels) : side_(pixels) {
  const Stopwatch watch;
  arrays_.tree = build_splat_tree(splats);
  tree_seconds_ = watch.seconds();
  packed_ = pack_splats(arrays_.tree);
  grid_ = build_splat_grid(packed_.splats);
  discs_ = std::make_unique<EmbreeDiscs>(packed_);
  const SplatGeometry geometry = splat_geometry(arrays_, closed, CloudSurface::splats);
  trial_.set = geometry.set;
  trial_.tree = geometry.tree;
  trial_.packed = &packed_;
  trial_.grid = &grid_;
  trial_.discs = discs_->scene();

  const Box3 bounds = geometry.set.bounds;
  const Vec3 middle = 0.5f * (bounds.low + bounds.high), extent = bounds.high - bounds.low;
  const float half = 0.5f * std::max({extent.x, extent.y, extent.z}), front = 0.5f * extent.z;
  const Vec3 eye = middle + Vec3{0, 0, front + camera_distance * half};
  for (int y = 0; y < side_; ++y)
    for (int x = 0; x < side_; ++x) {
      const auto place = [&](int i) { return 2 * (static_cast<float>(i) + 0.5f) / static_cast<float>(side_) - 1; };
      Ray ray;
      ray.origin = eye;
      // The cloud's nearest face just fits.
      ray.direction = normalize(Vec3{1.05f * half * place(x), -1.05f * half * place(y), -camera_distance * half});
      const BoxSpan span = clip_line(bounds, ray);
      if (span.empty() || !(span.exit > 0)) continue;
      rays_.push_back(ray);
      pixels_.push_back(static_cast<std::size_t>(y) * static_cast<std::size_t>(side_) + static_cast<std::size_t>(x));
    }
}

SplatBench::~SplatBench() = default;

SplatSearchTime SplatBench::time(const SplatSearchChoice& choice, double seconds) const {
  const auto run = [&](std::size_t count, std::vector<SurfaceHit>& hits, double& share) {
    std::vector<Ray> some;
    for (std::size_t i = 0; i < count; ++i) some.push_back(rays_[i * rays_.size() / count]);
    hits.resize(count);
    const auto found = std::make_unique<bool[]>(count);
    const double start = thread_seconds();
    select_kernels().trace_splats(trial_, choice, some.data(), static_cast<int>(count), hits.data(), found.get());
    const double spent = thread_seconds() - start;
    share = static_cast<double>(std::count(found.get(), found.get() + count, true)) / static_cast<double>(count);
    return spent;
  };
  SplatSearchTime result;
  std::vector<SurfaceHit> hits;
  // A few rays tell how many can be had; then three times, of which the least is the least disturbed.
  const std::size_t first = std::min<std::size_t>(rays_.size(), 32);
  const double guess = run(first, hits, result.hits) / static_cast<double>(first);
  const double most = std::max(seconds / 3 / std::max(guess, 1e-9), 64.0);
  result.rays = std::min(rays_.size(), static_cast<std::size_t>(most));
  double least = HUGE_VAL;
  for (int i = 0; i < 3; ++i) least = std::min(least, run(result.rays, hits, result.hits));
  result.ns_per_ray = 1e9 * least / static_cast<double>(result.rays);
  return result;
}

double SplatBench::disagreement(const SplatSearchChoice& choice, std::size_t most_rays) const {
  const std::size_t count = std::min(rays_.size(), most_rays);
  std::size_t differ = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Ray& ray = rays_[i * rays_.size() / count];
    SurfaceHit a, b;
    bool found_a, found_b;
    select_kernels().trace_splats(trial_, {}, &ray, 1, &a, &found_a);
    select_kernels().trace_splats(trial_, choice, &ray, 1, &b, &found_b);
    const bool same =
        found_a == found_b &&
        (!found_a || (std::abs(a.t - b.t) <= 1e-5f * a.t && length(a.shading_normal - b.shading_normal) < 1e-3f));
    differ += same ? 0 : 1;
  }
  return static_cast<double>(differ) / static_cast<double>(count);
}

Image SplatBench::picture(SplatRules rules, bool mirror, bool closed) const {
  SplatTrial trial = trial_;
  trial.rules = rules;
  trial.set.closed = closed;
  Image image = make_image(side_, side_, 3);
  std::vector<SurfaceHit> hits(rays_.size());
  const auto found = std::make_unique<bool[]>(rays_.size());
  select_kernels().trace_splats(trial, {}, rays_.data(), static_cast<int>(rays_.size()), hits.data(), found.get());
  const Vec3 light = normalize(Vec3{0.4f, 0.6f, 1});
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (!found[i]) continue;
    Vec3 n = hits[i].shading_normal;
    const Vec3 d = rays_[i].direction;
    if (dot(n, d) > 0) n = -n;
    const float value = mirror ? room_light(d - 2 * dot(d, n) * n) : 0.04f + 0.7f * std::max(dot(n, light), 0.0f);
    for (int c = 0; c < 3; ++c) image.pixels[3 * pixels_[i] + static_cast<std::size_t>(c)] = value;
  }
  return image;
}

SplatRulesDifference compare_splat_rules(const SplatBench& bench) {
  SplatRulesDifference result;
  result.without = bench.picture(SplatRules::first_hit, false, true);
  result.with = bench.picture(SplatRules::resolve, false, true);
  result.difference = result.with;
  std::size_t shown = 0, changed = 0, removed = 0;
  for (std::size_t i = 0; i < result.with.pixels.size(); i += 3) {
    const bool before = result.without.pixels[i] > 0, after = result.with.pixels[i] > 0;
    // Channel by channel, as the thesis has it; they are alike here.
    const float difference = std::abs(result.with.pixels[i] - result.without.pixels[i]);
    for (std::size_t c = 0; c < 3; ++c) result.difference.pixels[i + c] = difference;
    if (before || after) ++shown;
    if (difference > 0.02f) ++changed;
    if (before && !after) ++removed;
  }
  result.changed = static_cast<double>(changed) / static_cast<double>(std::max<std::size_t>(shown, 1));
  result.removed = static_cast<double>(removed) / static_cast<double>(std::max<std::size_t>(shown, 1));
  return result;
}

}  // namespace embrun
