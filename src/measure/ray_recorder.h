#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "geometry/box.h"
#include "geometry/sided_ray.h"

namespace embrun::measure {

using TestRay = SidedRay;

/// What a ray has done before: it comes from the camera, or left the surface to the outside or the inside.
enum class RayClass { camera, outside, inside };
inline constexpr int ray_class_count = 3;
std::string_view name_of(RayClass ray_class);

using Intersector = std::function<bool(const Ray&, Side, SurfaceHit&)>;

/// Rays of each class, as a path tracer of the bare body (glass 1.33 in air) traces them.
struct RecordedRays {
  std::array<std::vector<TestRay>, ray_class_count> rays;
  std::array<std::size_t, ray_class_count> traced{};  ///< how many of each there were, kept or not

  std::vector<TestRay>& of(RayClass c) { return rays[static_cast<std::size_t>(c)]; }
  const std::vector<TestRay>& of(RayClass c) const { return rays[static_cast<std::size_t>(c)]; }
};

/// Renders two views of the box, framed as the renderer frames them by itself, 640 x 480 with four paths a pixel, tile
/// by tile in random order until there are `count` rays of each class, or six times as many camera rays and 20,000: each path is reflected or refracted as the Fresnel
/// term draws it, by the shading normal but on the side of the geometric one, at most 8 times. The rays keep the order
/// in which they were traced; no class has more than `count`.
RecordedRays record_render(const Intersector& intersect, const Box3& box, std::size_t count, std::uint32_t seed);

/// A small keyed generator: uniform in [0, 1).
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ull + 0x632be59bd9b4e019ull) {}
  double next() {
    state_ += 0x9e3779b97f4a7c15ull;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }
  float uniform(double low, double high) { return static_cast<float>(low + (high - low) * next()); }
  Vec3 direction();

 private:
  std::uint64_t state_;
};

}  // namespace embrun::measure
