#include "reproduction/ball_search.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <random>

#include "base/error.h"

namespace embrun {
namespace {

constexpr float unbounded = std::numeric_limits<float>::infinity();

/// The part of a line in a box.
bool clip(Vec3 low, Vec3 high, Vec3 origin, Vec3 direction, float& begin, float& end) {
  for (int axis = 0; axis < 3; ++axis) {
    const float inverse = 1.0f / direction[axis];
    float near = (low[axis] - origin[axis]) * inverse, far = (high[axis] - origin[axis]) * inverse;
    if (near > far) std::swap(near, far);
    // Along a face 0 times infinity is no number, and bounds nothing.
    if (near > begin) begin = near;
    if (far < end) end = far;
  }
  return begin <= end;
}

void add_chord(Vec3 center, float radius, Vec3 origin, Vec3 direction, float t_end, std::uint32_t ball,
               std::vector<BallChord>& chords) {
  const Vec3 to = center - origin;
  const float middle = dot(to, direction);
  const Vec3 beside = to - middle * direction;
  const float half_squared = radius * radius - dot(beside, beside);
  if (!(half_squared > 0)) return;
  const float half = std::sqrt(half_squared);
  if (middle + half <= 0 || middle - half >= t_end) return;
  chords.push_back({middle - half, middle + half, ball});
}

void find_bounds(std::span<const Vec3> centers, float radius, Vec3& low, Vec3& high) {
  low = high = centers.front();
  for (const Vec3& c : centers) {
    low = min_of(low, c);
    high = max_of(high, c);
  }
  const Vec3 reach{radius, radius, radius};
  low = low - reach;
  high = high + reach;
}

}  // namespace

// ---- grid --------------------------------------------------------------------------------------------------------

BallGrid::BallGrid(std::span<const Vec3> centers, float radius)
    : centers_(centers), radius_(radius), cell_(2 * radius) {
  find_bounds(centers, radius, low_, high_);
  for (int axis = 0; axis < 3; ++axis)
    cells_[axis] = std::max(1, static_cast<int>(std::ceil((high_[axis] - low_[axis]) / cell_)));
  high_ =
      low_ + cell_ * Vec3{static_cast<float>(cells_[0]), static_cast<float>(cells_[1]), static_cast<float>(cells_[2])};
  const auto for_cells = [&](const Vec3& center, const auto& visit) {
    int first[3], last[3];
    for (int axis = 0; axis < 3; ++axis) {
      const float at = center[axis] - low_[axis];
      first[axis] = std::clamp(static_cast<int>((at - radius_) / cell_), 0, cells_[axis] - 1);
      last[axis] = std::clamp(static_cast<int>((at + radius_) / cell_), 0, cells_[axis] - 1);
    }
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int x = first[0]; x <= last[0]; ++x) {
          const int cell[3] = {x, y, z};
          visit(index(cell));
        }
  };
  // Counts, sums of them, then the balls from the back of each cell's part.
  starts_.assign(
      static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(cells_[1]) * static_cast<std::size_t>(cells_[2]) +
          1,
      0);
  for (const Vec3& center : centers) for_cells(center, [&](std::size_t cell) { ++starts_[cell]; });
  std::uint32_t sum = 0;
  for (std::uint32_t& start : starts_) start = sum += start;
  balls_.resize(sum);
  for (std::size_t i = centers.size(); i-- > 0;)
    for_cells(centers[i], [&](std::size_t cell) { balls_[--starts_[cell]] = static_cast<std::uint32_t>(i); });
}

std::size_t BallGrid::index(const int cell[3]) const {
  return (static_cast<std::size_t>(cell[2]) * static_cast<std::size_t>(cells_[1]) + static_cast<std::size_t>(cell[1])) *
             static_cast<std::size_t>(cells_[0]) +
         static_cast<std::size_t>(cell[0]);
}

/// From cell to cell by the next face [AmanatidesWoo1987].
void BallGrid::gather(Vec3 origin, Vec3 direction, float t_end, MetBalls& met, std::vector<BallChord>& chords) const {
  float begin = 0, end = t_end;
  if (!clip(low_, high_, origin, direction, begin, end)) return;
  const Vec3 start = origin + begin * direction;
  int cell[3], step[3], stop[3];
  float next[3], stride[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float d = direction[axis];
    cell[axis] = std::clamp(static_cast<int>((start[axis] - low_[axis]) / cell_), 0, cells_[axis] - 1);
    step[axis] = d > 0 ? 1 : -1;
    stop[axis] = d > 0 ? cells_[axis] : -1;
    stride[axis] = d != 0 ? cell_ / std::abs(d) : unbounded;
    const float face = low_[axis] + cell_ * static_cast<float>(cell[axis] + (d > 0 ? 1 : 0));
    next[axis] = d != 0 ? (face - origin[axis]) / d : unbounded;
  }
  while (true) {
    const std::size_t at = index(cell);
    for (std::uint32_t i = starts_[at]; i < starts_[at + 1]; ++i)
      if (met.meet(balls_[i])) add_chord(centers_[balls_[i]], radius_, origin, direction, t_end, balls_[i], chords);
    const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    if (!(next[axis] <= end)) return;
    cell[axis] += step[axis];
    if (cell[axis] == stop[axis]) return;
    next[axis] += stride[axis];
  }
}

std::size_t BallGrid::bytes() const { return sizeof(std::uint32_t) * (starts_.size() + balls_.size()); }

// ---- kd-tree -----------------------------------------------------------------------------------------------------

/// Splits where the surface area heuristic finds it cheapest, among all faces of the balls' boxes, by sorting these anew at
/// each node; constants as in [WaldHavran2006].
class BallTreeBuilder {
 public:
  explicit BallTreeBuilder(BallKdTree& tree) : tree_(tree) {}

  void build() {
    std::vector<std::uint32_t> all(tree_.centers_.size());
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
    const int depth = 8 + static_cast<int>(1.3 * std::log2(static_cast<double>(all.size())));
    tree_.nodes_.emplace_back();
    build(0, std::move(all), tree_.low_, tree_.high_, depth);
  }

 private:
  static constexpr float traversal = 15, intersection = 20, empty_bonus = 0.8f;

  struct Split {
    float cost = unbounded, at = 0;
    int axis = -1;
  };
  struct Face {
    float at;
    bool begins;
    bool operator<(const Face& other) const { return at != other.at ? at < other.at : !begins && other.begins; }
  };

  static float area(Vec3 size) { return size.x * size.y + size.y * size.z + size.z * size.x; }

  Split cheapest(const std::vector<std::uint32_t>& balls, Vec3 low, Vec3 high) {
    Split best;
    const Vec3 size = high - low;
    const float whole = area(size);
    for (int axis = 0; axis < 3; ++axis) {
      faces_.clear();
      for (const std::uint32_t ball : balls) {
        const float center = tree_.centers_[ball][axis];
        faces_.push_back({std::max(center - tree_.radius_, low[axis]), true});
        faces_.push_back({std::min(center + tree_.radius_, high[axis]), false});
      }
      std::sort(faces_.begin(), faces_.end());
      std::size_t below = 0, above = balls.size();
      for (const Face& face : faces_) {
        if (!face.begins) --above;
        if (face.at > low[axis] && face.at < high[axis]) {
          Vec3 left = size, right = size;
          left[axis] = face.at - low[axis];
          right[axis] = high[axis] - face.at;
          const float cost =
              (traversal + intersection / whole *
                               (area(left) * static_cast<float>(below) + area(right) * static_cast<float>(above))) *
              (below == 0 || above == 0 ? empty_bonus : 1.0f);
          if (cost < best.cost) best = {cost, face.at, axis};
        }
        if (face.begins) ++below;
      }
    }
    return best;
  }

  void build(std::size_t node, std::vector<std::uint32_t> balls, Vec3 low, Vec3 high, int depth) {
    const Split split = depth > 0 && !balls.empty() ? cheapest(balls, low, high) : Split{};
    if (split.axis < 0 || split.cost >= intersection * static_cast<float>(balls.size())) {
      tree_.nodes_[node].first = static_cast<std::uint32_t>(tree_.balls_.size());
      tree_.nodes_[node].count = static_cast<std::uint32_t>(balls.size());
      tree_.balls_.insert(tree_.balls_.end(), balls.begin(), balls.end());
      return;
    }
    std::vector<std::uint32_t> below, above;
    for (const std::uint32_t ball : balls) {
      const float center = tree_.centers_[ball][split.axis];
      if (center - tree_.radius_ <= split.at) below.push_back(ball);
      if (center + tree_.radius_ >= split.at) above.push_back(ball);
    }
    balls = {};
    const std::size_t children = tree_.nodes_.size();
    tree_.nodes_[node] = {split.at, split.axis, static_cast<std::uint32_t>(children), 0};
    tree_.nodes_.resize(children + 2);
    Vec3 low_end = high, high_begin = low;
    low_end[split.axis] = high_begin[split.axis] = split.at;
    build(children, std::move(below), low, low_end, depth - 1);
    build(children + 1, std::move(above), high_begin, high, depth - 1);
  }

  BallKdTree& tree_;
  std::vector<Face> faces_;
};

BallKdTree::BallKdTree(std::span<const Vec3> centers, float radius) : centers_(centers), radius_(radius) {
  find_bounds(centers, radius, low_, high_);
  BallTreeBuilder(*this).build();
}

void BallKdTree::gather(Vec3 origin, Vec3 direction, float t_end, MetBalls& met, std::vector<BallChord>& chords) const {
  float begin = 0, end = t_end;
  if (!clip(low_, high_, origin, direction, begin, end)) return;
  struct Part {
    std::uint32_t node;
    float begin, end;
  };
  std::array<Part, 64> later;
  std::size_t waiting = 0;
  Part part{0, begin, end};
  while (true) {
    const Node& node = nodes_[part.node];
    if (node.axis >= 0) {
      const float o = origin[node.axis], d = direction[node.axis];
      const std::uint32_t low_first = o < node.split || (o == node.split && d <= 0) ? 0u : 1u;
      const std::uint32_t near = node.first + low_first, far = node.first + 1 - low_first;
      const float t = d != 0 ? (node.split - o) / d : unbounded;
      if (t > part.end || t <= 0) {
        part.node = near;
      } else if (t < part.begin) {
        part.node = far;
      } else {
        later[waiting++] = {far, t, part.end};
        part = {near, part.begin, t};
      }
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i)
      if (met.meet(balls_[i])) add_chord(centers_[balls_[i]], radius_, origin, direction, t_end, balls_[i], chords);
    if (waiting == 0) return;
    part = later[--waiting];
  }
}

std::size_t BallKdTree::bytes() const { return nodes_.size() * sizeof(Node) + balls_.size() * sizeof(std::uint32_t); }

// ---- measuring ---------------------------------------------------------------------------------------------------

namespace {

struct SearchRay {
  Vec3 origin, direction;
};

std::vector<SearchRay> random_rays(std::span<const Vec3> centers, float radius, std::size_t count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  std::uniform_int_distribution<std::size_t> any(0, centers.size() - 1);
  const auto in_ball = [&] {
    while (true) {
      const Vec3 p{uniform(random), uniform(random), uniform(random)};
      const float squared = dot(p, p);
      if (squared <= 1 && squared > 1e-4f) return p;
    }
  };
  std::vector<SearchRay> rays;
  for (std::size_t i = 0; i < count; ++i)
    rays.push_back({centers[any(random)] + radius * in_ball(), normalize(in_ball())});
  return rays;
}

double seconds_of(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// All rays through a structure; `length` is the sum of the chords'.
template <class Structure>
std::size_t gather_all(const Structure& structure, const std::vector<SearchRay>& rays, std::size_t balls,
                       double& length) {
  MetBalls met(balls);
  std::vector<BallChord> chords;
  std::size_t count = 0;
  length = 0;
  for (const SearchRay& ray : rays) {
    chords.clear();
    met.next_ray();
    structure.gather(ray.origin, ray.direction, unbounded, met, chords);
    count += chords.size();
    for (const BallChord& chord : chords) length += static_cast<double>(chord.exit - chord.enter);
  }
  return count;
}

}  // namespace

BallSearchFigures compare_ball_search(std::span<const Vec3> centers, float radius, std::size_t count) {
  if (centers.empty()) throw Error("no balls to search");
  BallSearchFigures result;
  result.balls = centers.size();
  result.rays = count;
  const std::vector<SearchRay> rays = random_rays(centers, radius, count);
  const auto start = std::chrono::steady_clock::now();
  const BallGrid grid(centers, radius);
  const auto middle = std::chrono::steady_clock::now();
  const BallKdTree tree(centers, radius);
  const auto end = std::chrono::steady_clock::now();
  result.grid.build_seconds = std::chrono::duration<double>(middle - start).count();
  result.tree.build_seconds = std::chrono::duration<double>(end - middle).count();
  result.grid.bytes_per_ball = static_cast<double>(grid.bytes()) / static_cast<double>(centers.size());
  result.tree.bytes_per_ball = static_cast<double>(tree.bytes()) / static_cast<double>(centers.size());

  // Turn by turn, and the best of each, so that a busy machine troubles both alike.
  std::size_t grid_chords = 0, tree_chords = 0;
  double grid_length = 0, tree_length = 0, grid_best = 1e30, tree_best = 1e30;
  for (int turn = 0; turn < 3; ++turn) {
    grid_best =
        std::min(grid_best, seconds_of([&] { grid_chords = gather_all(grid, rays, centers.size(), grid_length); }));
    tree_best =
        std::min(tree_best, seconds_of([&] { tree_chords = gather_all(tree, rays, centers.size(), tree_length); }));
  }
  result.grid.rays_per_second = static_cast<double>(count) / grid_best;
  result.tree.rays_per_second = static_cast<double>(count) / tree_best;
  result.chords_per_ray = static_cast<double>(grid_chords) / static_cast<double>(count);
  // A ball that a ray just grazes may be missed by either, for rounding.
  const double more = static_cast<double>(std::max(grid_chords, tree_chords)),
               fewer = static_cast<double>(std::min(grid_chords, tree_chords));
  result.agree = fewer > 0 && more - fewer <= 1e-5 * more && std::abs(grid_length - tree_length) <= 1e-5 * grid_length;
  return result;
}

}  // namespace embrun
