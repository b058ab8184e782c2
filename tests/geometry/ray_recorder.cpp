#include "geometry/ray_recorder.h"

#include <algorithm>
#include <cmath>

namespace embrun::test {

std::string_view name_of(RayClass ray_class) {
  return ray_class == RayClass::camera ? "camera" : ray_class == RayClass::outside ? "outside" : "inside";
}

Vec3 Dice::direction() {
  const double z = 2 * next() - 1, angle = 2 * 3.14159265358979 * next();
  const double ring = std::sqrt(std::max(0.0, 1 - z * z));
  return normalize(Vec3{static_cast<float>(ring * std::cos(angle)), static_cast<float>(ring * std::sin(angle)),
                        static_cast<float>(z)});
}

namespace {

constexpr double water = 1.33;

/// Unpolarised Fresnel reflectance; `cosine` of incidence, `eta` the index ahead over the index behind.
double fresnel(double cosine, double eta, double& cosine_transmitted) {
  const double sine_squared = (1 - cosine * cosine) / (eta * eta);
  if (sine_squared >= 1) return 1;
  cosine_transmitted = std::sqrt(1 - sine_squared);
  const double parallel = (eta * cosine - cosine_transmitted) / (eta * cosine + cosine_transmitted);
  const double across = (cosine - eta * cosine_transmitted) / (cosine + eta * cosine_transmitted);
  return 0.5 * (parallel * parallel + across * across);
}

/// Turns a direction that is on the wrong side of the surface, or along it, just to the right one.
Vec3 to_side(Vec3 direction, Vec3 normal) {
  const float cosine = dot(direction, normal);
  return cosine > 1e-4f ? direction : normalize(direction + normal * (2e-4f - cosine));
}

/// The next ray of a path that met the surface.
TestRay scatter(const Ray& ray, const SurfaceHit& hit, Dice& dice) {
  const float facing = hit.entering ? 1.0f : -1.0f;
  const Vec3 geometric = hit.geometric_normal * facing;
  Vec3 shading = hit.shading_normal * facing;
  shading = to_side(shading, -ray.direction);
  const double eta = hit.entering ? water : 1 / water;
  const double cosine = std::min(1.0, static_cast<double>(-dot(ray.direction, shading)));
  double cosine_transmitted = 0;
  TestRay next;
  const bool reflect = dice.next() < fresnel(cosine, eta, cosine_transmitted);
  if (reflect) {
    next.ray.direction = to_side(ray.direction + shading * static_cast<float>(2 * cosine), geometric);
  } else {
    const Vec3 bent =
        ray.direction * static_cast<float>(1 / eta) + shading * static_cast<float>(cosine / eta - cosine_transmitted);
    next.ray.direction = to_side(normalize(bent), -geometric);
  }
  next.ray.direction = normalize(next.ray.direction);
  next.side = reflect == hit.entering ? Side::outside : Side::inside;
  // A few units in the last place off the surface, as renderers do.
  const Vec3 p = hit.position;
  const float offset = 4e-7f * (fabsf(p.x) + fabsf(p.y) + fabsf(p.z));
  next.ray.origin = p + geometric * (reflect ? offset : -offset);
  next.ray.clearance = clearance_after(hit, next.ray.direction, 0);
  return next;
}

/// Keeps `count` of the rays it is shown, each with the same chance (reservoir sampling).
class Reservoir {
 public:
  Reservoir(std::vector<TestRay>& kept, std::size_t count) : kept_(kept), count_(count) {}
  void show(const TestRay& ray, Dice& dice) {
    ++seen_;
    if (kept_.size() < count_) {
      kept_.push_back(ray);
    } else {
      const auto slot = static_cast<std::size_t>(dice.next() * static_cast<double>(seen_));
      if (slot < count_) kept_[slot] = ray;
    }
  }

 private:
  std::vector<TestRay>& kept_;
  std::size_t count_, seen_ = 0;
};

}  // namespace

RecordedRays record_render(const Intersector& intersect, const Box3& box, std::size_t count, std::uint32_t seed) {
  RecordedRays recorded;
  Dice dice(seed);
  std::array<Reservoir, ray_class_count> reservoirs{
      Reservoir(recorded.rays[0], count), Reservoir(recorded.rays[1], count), Reservoir(recorded.rays[2], count)};
  const auto show = [&](RayClass c, const TestRay& ray) { reservoirs[static_cast<std::size_t>(c)].show(ray, dice); };

  const Vec3 centre = (box.low + box.high) * 0.5f;
  const float radius = 0.5f * length(box.high - box.low);
  // A third of the camera rays miss: enough for `count` of each class from bodies that fill a tenth of the frame.
  const int side = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(count) * 0.25)), 16, 512);
  constexpr int samples = 4;
  constexpr double half_tangent = 0.36;  // a field of view of 40 degrees
  for (const Vec3 from : {Vec3{-0.5f, 0.42f, 0.75f}, Vec3{0.7f, 0.12f, -0.7f}}) {
    const Frame frame(normalize(from));
    const Vec3 eye = centre + frame.n * (2.9f * radius);
    for (int pixel = 0; pixel < side * side * samples; ++pixel) {
      const double x = 2 * (pixel / samples % side + dice.next()) / side - 1;
      const double y = 2 * (pixel / samples / side + dice.next()) / side - 1;
      TestRay ray;
      ray.ray.origin = eye;
      ray.ray.direction = normalize(
          frame.to_world(Vec3{static_cast<float>(x * half_tangent), static_cast<float>(y * half_tangent), -1.0f}));
      show(RayClass::camera, ray);
      for (int bounce = 0; bounce < 8; ++bounce) {
        SurfaceHit hit;
        if (!intersect(ray.ray, ray.side, hit)) break;
        ray = scatter(ray.ray, hit, dice);
        show(ray.side == Side::inside ? RayClass::inside : RayClass::outside, ray);
      }
    }
  }
  return recorded;
}

}  // namespace embrun::test
