#include "scene/splats_of_cloud.h"

namespace embrun {

MaterialDescription default_splat_material(bool has_colors) {
  MaterialDescription material = diffuse_material({0.5f, 0.5f, 0.5f});
  if (has_colors) material.reflectance.kind = TextureKind::own;
  return material;
}

SplatsDescription splats_of_cloud(const SplatCloud& cloud) {
  SplatsDescription splats;
  splats.centers = cloud.particles.positions;
  splats.normals = cloud.normals;
  splats.radii = cloud.radii;
  for (const SplatAxes& axes : cloud.axes) splats.lesser_axes.push_back(axes.minor);
  splats.colors = cloud.colours;
  splats.closed = cloud.closed;
  splats.material = default_splat_material(!cloud.colours.empty());
  return splats;
}

}  // namespace embrun
