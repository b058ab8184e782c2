// Compiled by nvcc in CI and never run: shows that the per-ray code is fit for the device. The kernel
// calls what a path calls, so that templates and inline functions are really instantiated.
#include "camera/camera.h"
#include "lights/light_set.h"
#include "materials/bsdf.h"
#include "math/ray.h"
#include "math/rgb.h"
#include "sampling/sampler.h"

namespace embrun {
namespace {

/// What the kernel reads: views of arrays in device memory.
struct DeviceScene {
  Camera camera;
  LightSet lights;
  Bsdf bsdf;
};

EMBRUN_FN Ray first_ray(const DeviceScene& scene, const SampleKey& key) {
  const CameraSample sample{sample_2d(SamplerKind::sobol, key, Dimension::camera_film),
                            sample_2d(SamplerKind::sobol, key, Dimension::camera_lens),
                            sample_1d(SamplerKind::sobol, key, Dimension::time)};
  const int x = static_cast<int>(key.pixel) % scene.camera.width;
  const int y = static_cast<int>(key.pixel) / scene.camera.width;
  return camera_ray(scene.camera, x, y, sample);
}

/// Light that a surface point sends back along the ray: one sample of the BSDF, one of the lights.
EMBRUN_FN Rgb scattered_light(const DeviceScene& scene, const Ray& ray, const SampleKey& key) {
  const SurfaceNormals normals{-ray.direction, -ray.direction};
  const BsdfSample scattered =
      sample_bsdf(scene.bsdf, normals, -ray.direction, sample_1d(SamplerKind::sobol, key, Dimension::bsdf_lobe),
                  sample_2d(SamplerKind::sobol, key, Dimension::bsdf_direction));
  const LightSample light =
      sample_lights(scene.lights, ray.at(1.0f), sample_1d(SamplerKind::independent, key, Dimension::light_choice),
                    sample_2d(SamplerKind::independent, key, Dimension::light_position));
  Rgb sum = scattered.weight * escaped_light(scene.lights, scattered.wi).radiance;
  if (light.valid) {
    sum += eval_bsdf(scene.bsdf, normals, -ray.direction, light.direction) * light.radiance *
           (1.0f / (light.pdf + pdf_bsdf(scene.bsdf, normals, -ray.direction, light.direction)));
  }
  return sum + intersect_lights(scene.lights, ray).radiance;
}

}  // namespace

__global__ void device_check(const DeviceScene* scene, Rgb* results, int count) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= count) return;
  const SampleKey key{0, static_cast<uint32_t>(i), 0, 0};
  results[i] = scattered_light(*scene, first_ray(*scene, key), key);
}

}  // namespace embrun
