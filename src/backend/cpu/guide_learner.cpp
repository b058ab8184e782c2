#include "backend/cpu/guide_learner.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "backend/cpu/batch_memory.h"
#include "base/parallel.h"

namespace embrun {
namespace {

constexpr int most_batches = 1024;
constexpr float guided_share = 0.5f;
/// Samples of the lessons: none that a picture will use.
constexpr std::uint32_t first_lesson = 0x80000000u;

using Table = std::vector<double>;

/// Every cell shares a little with its neighbours: what was met once may be met again nearby.
Table blurred(const Table& cells) {
  Table out(cells.size());
  for (int y = 0; y < guide_rows; ++y)
    for (int x = 0; x < guide_columns; ++x)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const int ny = std::clamp(y + dy, 0, guide_rows - 1), nx = (x + dx + guide_columns) % guide_columns;
          const double weight = (dx == 0 ? 0.5 : 0.25) * (dy == 0 ? 0.5 : 0.25);
          out[static_cast<std::size_t>(ny * guide_columns + nx)] +=
              weight * cells[static_cast<std::size_t>(y * guide_columns + x)];
        }
  return out;
}

/// What was found in the directions of each cell.
class Lessons {
 public:
  void take(const GuideLesson& lesson) {
    const GuideCell cell = guide_cell(lesson.direction);
    const auto i = static_cast<std::size_t>(cell.y * guide_columns + cell.x);
    count_[i] += 1;
    const double light = static_cast<double>(lesson.light);
    squares_[i] += light * light;
  }
  /// The noise is least when directions are drawn in proportion to the root of the mean square of what they bring; the
  /// lessons themselves were drawn by the surfaces' own choice, which their number stands for.
  DistributionTable table() const {
    const Table count = blurred(count_), squares = blurred(squares_);
    std::vector<float> weights(count.size());
    for (std::size_t i = 0; i < count.size(); ++i) weights[i] = static_cast<float>(std::sqrt(count[i] * squares[i]));
    return {weights, guide_columns, guide_rows};
  }

 private:
  Table count_ = Table(guide_columns * guide_rows), squares_ = Table(guide_columns * guide_rows);
};

}  // namespace

DirectionGuide LearnedGuide::view() const {
  DirectionGuide guide;
  guide.cells[0] = air.view();
  guide.cells[1] = body.view();
  guide.share = air.empty() ? 0.0f : guided_share;
  return guide;
}

bool needs_guide(const FlatScene& scene) {
  const LightSet lights = scene.lights.view();
  const bool uniform = lights.count == 1 && lights.environment.kind == EnvironmentKind::constant;
  const bool refracts = std::any_of(scene.media.begin(), scene.media.end(),
                                    [&](const Medium& medium) { return medium.ior != scene.media[0].ior; });
  return lights.count > 0 && !uniform && refracts;
}

LearnedGuide learn_guide(const KernelTable& kernels, const PathScene& scene, const CpuSceneView& view) {
  // A grid of pixels over the picture, four samples a pixel where it is small.
  const double pixels = static_cast<double>(scene.camera.width) * scene.camera.height;
  const int batches = static_cast<int>(std::min(std::ceil(4 * pixels / batch_size), static_cast<double>(most_batches)));
  const int lessons_in_all = batches * batch_size;
  const auto lesson = [&](int i) {
    const auto pixel = static_cast<std::int64_t>(std::fmod(i * std::max(pixels / lessons_in_all, 1.0), pixels));
    return PixelSample{static_cast<int>(pixel % scene.camera.width), static_cast<int>(pixel / scene.camera.width),
                       first_lesson + static_cast<std::uint32_t>(i)};
  };
  std::vector<GuideLesson> lessons(static_cast<std::size_t>(lessons_in_all));
  tbb::enumerable_thread_specific<BatchMemory> memory([&] { return BatchMemory(kernels); });
  parallel_for(static_cast<std::size_t>(batches), 1, [&](std::size_t begin, std::size_t end) {
    PixelSample samples[batch_size];
    for (std::size_t batch = begin; batch < end; ++batch) {
      const int first = static_cast<int>(batch) * batch_size;
      for (int i = 0; i < batch_size; ++i) samples[i] = lesson(first + i);
      kernels.learn_directions(scene, view, samples, batch_size, &lessons[static_cast<std::size_t>(first)],
                               memory.local().batch());
    }
  });

  // Gathered in their order, whoever traced them.
  Lessons gathered[2];
  for (const GuideLesson& found : lessons)
    if (found.light >= 0.0f && std::isfinite(found.light)) gathered[found.in_body ? 1 : 0].take(found);
  return {gathered[0].table(), gathered[1].table()};
}

}  // namespace embrun
