#include "measure/ray_recorder.h"

#include <algorithm>
#include <cmath>

#include "camera/framing.h"
#include "materials/smooth_bsdf.h"

namespace embrun::measure {

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

constexpr float water = 1.33f;

/// The next ray of a path that met the surface, as the renderer sends it on.
TestRay scatter(const Ray& ray, const SurfaceHit& hit, Dice& dice) {
  Bsdf bsdf;
  bsdf.kind = BsdfKind::dielectric;
  bsdf.relative_index = hit.entering ? water : 1.0f / water;
  const Vec3 wo = -ray.direction;
  const FacingNormals normals = face_towards({hit.geometric_normal, hit.shading_normal}, wo);
  const BsdfSample sample = sample_dielectric(bsdf, normals, wo, static_cast<float>(dice.next()));
  TestRay next;
  next.ray.direction = sample.wi;
  next.side = sample.transmitted == hit.entering ? Side::inside : Side::outside;
  // A few units in the last place off the surface, as renderers do.
  const Vec3 p = hit.position;
  const float offset = 4e-7f * (fabsf(p.x) + fabsf(p.y) + fabsf(p.z));
  next.ray.origin = p + normals.geometric * (sample.transmitted ? -offset : offset);
  // What the hit knows of the surface around it goes with the ray.
  next.ray.clearance = clearance_after(hit, next.ray.direction, 0);
  return next;
}

constexpr int width = 640, height = 480, tile_side = 8, samples_per_pixel = 4;

/// A pinhole camera.
struct Eye {
  Vec3 position, right, up, back;
  double half_width, half_height;  // of the picture at distance 1
};

Eye framed(const Box3& box, View view) {
  const CameraSettings camera =
      frame_box(to_double(box.low), to_double(box.high), view, UpAxis::y, static_cast<double>(width) / height);
  Eye eye;
  eye.position = to_float(camera.eye);
  eye.back = normalize(to_float(camera.eye - camera.target));
  eye.right = normalize(cross(to_float(camera.up), eye.back));
  eye.up = cross(eye.back, eye.right);
  eye.half_height = std::tan(0.5 * camera.vertical_fov * 3.14159265358979 / 180);
  eye.half_width = eye.half_height * width / height;
  return eye;
}

TestRay camera_ray(const Eye& eye, int column, int row, Dice& dice) {
  const double x = (2 * (column + dice.next()) / width - 1) * eye.half_width;
  const double y = (1 - 2 * (row + dice.next()) / height) * eye.half_height;
  TestRay ray;
  ray.ray.origin = eye.position;
  ray.ray.direction = normalize(eye.right * static_cast<float>(x) + eye.up * static_cast<float>(y) - eye.back);
  return ray;
}

}  // namespace

RecordedRays record_render(const Intersector& intersect, const Box3& box, std::size_t count, std::uint32_t seed) {
  RecordedRays recorded;
  Dice dice(seed), tile_dice(seed + 1);  // the tiles do not depend on what the paths meet
  const auto keep = [&](RayClass c, const TestRay& ray) {
    ++recorded.traced[static_cast<std::size_t>(c)];
    if (recorded.of(c).size() < count) recorded.of(c).push_back(ray);
  };
  const std::array<Eye, 2> eyes{framed(box, View::three_quarter), framed(box, View::front)};
  const auto enough = [&] {
    for (const auto& rays : recorded.rays) {
      if (rays.size() < count) return recorded.traced[0] >= 6 * count + 20000;
    }
    return true;
  };
  while (!enough()) {
    const Eye& eye = eyes[tile_dice.next() < 0.5 ? 0 : 1];
    const int tile_x = static_cast<int>(tile_dice.next() * width / tile_side);
    const int tile_y = static_cast<int>(tile_dice.next() * height / tile_side);
    for (int path = 0; path < tile_side * tile_side * samples_per_pixel; ++path) {
      const int pixel = path / samples_per_pixel;
      TestRay ray =
          camera_ray(eye, tile_x * tile_side + pixel % tile_side, tile_y * tile_side + pixel / tile_side, dice);
      keep(RayClass::camera, ray);
      for (int bounce = 0; bounce < 8; ++bounce) {
        SurfaceHit hit;
        if (!intersect(ray.ray, ray.side, hit)) break;
        ray = scatter(ray.ray, hit, dice);
        keep(ray.side == Side::inside ? RayClass::inside : RayClass::outside, ray);
      }
    }
  }
  return recorded;
}

}  // namespace embrun::measure
