// Compiled by nvcc in CI and never run: shows that the per-ray code is fit for the device. The kernel
// calls what a path calls, so that templates and inline functions are really instantiated.
#include "math/ray.h"
#include "math/rgb.h"

namespace embrun {
namespace {

/// A use of the vector, colour and frame functions that the compiler cannot fold away.
EMBRUN_FN Rgb check_math(const Ray& ray) {
  const Frame frame(normalize(ray.direction));
  const Vec3 local = frame.to_local(ray.at(1.0f));
  return exp_of(Rgb{local.x, local.y, local.z} * -1.0f);
}

}  // namespace

__global__ void device_check(const Ray* rays, Rgb* results, int count) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= count) return;
  results[i] = check_math(rays[i]);
}

}  // namespace embrun
