#include "scene/splats_of_cloud.h"

#include <utility>

#include "geometry/splat_hierarchy.h"

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

SplatsDescription splats_of_file(std::shared_ptr<const SplatHierarchy> hierarchy, const std::string& file) {
  SplatsDescription splats;
  splats.closed = hierarchy->closed;
  splats.material = default_splat_material(hierarchy->colors != nullptr);
  splats.hierarchy = std::move(hierarchy);
  splats.detail = usual_detail;
  splats.file = file;
  return splats;
}

}  // namespace embrun
