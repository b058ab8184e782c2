#include "particles/cloud_closedness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "base/error.h"
#include "base/parallel.h"
#include "math/median.h"

namespace embrun {

namespace {

constexpr std::size_t directions = 32;
constexpr std::size_t most_splats = 1 << 18;
constexpr double most_pixels = 256;  // across the cloud

struct Disc {
  Vec3d centre, normal;
  double radius = 0;
};

enum class Side : std::uint8_t { nothing, front, back };

/// A picture of the nearest splats, one direction's view.
class View {
 public:
  /// `extent` is half the width of what is looked at.
  View(Vec3d direction, Vec3d middle, double extent, double pitch)
      : direction_(direction), middle_(middle), pitch_(pitch), half_(static_cast<int>(std::ceil(extent / pitch)) + 1) {
    const Tangents across = tangents_of(direction);
    right_ = across.u;
    up_ = across.v;
    width_ = 2 * static_cast<std::size_t>(half_) + 1;
    pixels_.resize(width_ * width_);
  }

  void draw(const Disc& disc) {
    const double away = dot(disc.normal, direction_);
    constexpr double edge_on = 1e-3;
    if (std::abs(away) < edge_on) return;
    const Vec3d offset = disc.centre - middle_;
    const double x = dot(offset, right_) / pitch_, y = dot(offset, up_) / pitch_, depth = dot(offset, direction_);
    const double slope_x = -dot(disc.normal, right_) / away, slope_y = -dot(disc.normal, up_) / away;
    const double reach = disc.radius / pitch_, squared = reach * reach;
    const int x_low = first_pixel(x - reach), x_high = last_pixel(x + reach);
    const int y_low = first_pixel(y - reach), y_high = last_pixel(y + reach);
    for (int j = y_low; j <= y_high; ++j) {
      for (int i = x_low; i <= x_high; ++i) {
        const double a = i - x, b = j - y, rise = slope_x * a + slope_y * b;
        if (a * a + b * b + rise * rise > squared) continue;
        Pixel& pixel = at(i, j);
        const auto here = static_cast<float>(depth + rise * pitch_);
        if (here < pixel.depth) pixel = {here, away > 0 ? Side::back : Side::front};
      }
    }
  }

  std::size_t filled() const {
    const auto is_filled = [](const Pixel& pixel) { return pixel.side != Side::nothing; };
    return static_cast<std::size_t>(std::count_if(pixels_.begin(), pixels_.end(), is_filled));
  }

  /// Pixels in squares of 3 by 3 that show nothing but this side.
  std::size_t squares_of(Side side) const {
    std::vector<std::uint8_t> in_square(pixels_.size());
    for (int j = 1 - half_; j < half_; ++j) {
      for (int i = 1 - half_; i < half_; ++i) {
        if (!is_square_of(side, i, j)) continue;
        for (int v = j - 1; v <= j + 1; ++v) {
          for (int u = i - 1; u <= i + 1; ++u) in_square[index(u, v)] = 1;
        }
      }
    }
    return static_cast<std::size_t>(std::count(in_square.begin(), in_square.end(), std::uint8_t{1}));
  }

 private:
  struct Pixel {
    float depth = std::numeric_limits<float>::infinity();
    Side side = Side::nothing;
  };

  Vec3d direction_, middle_, right_, up_;
  double pitch_;
  int half_;
  std::size_t width_ = 0;
  std::vector<Pixel> pixels_;

  int first_pixel(double x) const { return static_cast<int>(std::ceil(std::max(x, static_cast<double>(-half_)))); }
  int last_pixel(double x) const { return static_cast<int>(std::floor(std::min(x, static_cast<double>(half_)))); }
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j + half_) * width_ + static_cast<std::size_t>(i + half_);
  }
  Pixel& at(int i, int j) { return pixels_[index(i, j)]; }
  bool is_square_of(Side side, int i, int j) const {
    for (int v = j - 1; v <= j + 1; ++v) {
      for (int u = i - 1; u <= i + 1; ++u) {
        if (pixels_[index(u, v)].side != side) return false;
      }
    }
    return true;
  }
};

/// Directions spread over the sphere along a spiral of golden angles.
Vec3d spread_direction(std::size_t i) {
  constexpr double golden_angle = 2.39996322972865332;
  const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(directions);
  const double angle = golden_angle * static_cast<double>(i), across = std::sqrt(1 - z * z);
  return {across * std::cos(angle), across * std::sin(angle), z};
}

/// All splats, or every so manieth along `order`, grown to cover as much.
std::vector<Disc> take_discs(std::span<const Vec3d> points, std::span<const Vec3> normals, std::span<const float> radii,
                             std::span<const std::uint32_t> order) {
  const SplatThinning thinning(points.size());
  std::vector<Disc> discs;
  discs.reserve(points.size() / thinning.step + 1);
  for (std::size_t place = 0; place < order.size(); place += thinning.step) {
    const std::uint32_t i = order[place];
    discs.push_back({points[i], to_double(normals[i]), static_cast<double>(thinning.growth * radii[i])});
  }
  return discs;
}

double median_radius(const std::vector<Disc>& discs) {
  std::vector<double> radii;
  radii.reserve(discs.size());
  for (const Disc& disc : discs) radii.push_back(disc.radius);
  return median_of(radii);
}

}  // namespace

SplatThinning::SplatThinning(std::size_t splats)
    : step(std::max<std::size_t>((splats + most_splats - 1) / most_splats, 1)) {
  // Every so manieth point is less even than a sample of that size.
  constexpr double unevenness = 1.5;
  if (step > 1) growth = static_cast<float>(unevenness * std::sqrt(static_cast<double>(step)));
}

CloudClosedness look_for_holes(std::span<const Vec3d> points, std::span<const Vec3> normals,
                               std::span<const float> radii, std::span<const std::uint32_t> order) {
  EMBRUN_CHECK(points.size() == normals.size() && points.size() == radii.size() && points.size() == order.size());
  CloudClosedness found;
  if (points.empty()) return found;
  const std::vector<Disc> discs = take_discs(points, normals, radii, order);
  Vec3d low = discs[0].centre, high = low;
  for (const Disc& disc : discs) {
    const Vec3d c = disc.centre;
    low = min_of(low, c);
    high = max_of(high, c);
  }
  const Vec3d middle = (low + high) * 0.5;
  double extent = 0;
  for (const Disc& disc : discs) extent = std::max(extent, length(disc.centre - middle) + disc.radius);
  if (!(extent > 0)) return found;
  const double pitch = std::max(2 * median_radius(discs), 2 * extent / most_pixels);
  std::array<std::size_t, directions> filled{}, fronts{}, open{};
  parallel_for(directions, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t d = begin; d < end; ++d) {
      View view(spread_direction(d), middle, extent, pitch);
      for (const Disc& disc : discs) view.draw(disc);
      filled[d] = view.filled();
      fronts[d] = view.squares_of(Side::front);
      open[d] = view.squares_of(Side::back);
    }
  });
  double seen = 0, seen_fronts = 0, seen_open = 0;
  for (std::size_t d = 0; d < directions; ++d) {
    seen += static_cast<double>(filled[d]);
    seen_fronts += static_cast<double>(fronts[d]);
    seen_open += static_cast<double>(open[d]);
  }
  if (seen > 0) found.open_share = seen_open / seen;
  // A handful of splats, of which no square is seen, is nothing.
  found.closed = seen_fronts > 0 && found.open_share <= CloudClosedness::most_open;
  return found;
}

}  // namespace embrun
