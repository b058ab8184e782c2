#include "render/cloud_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "render/cloud_options.h"
#include "render/color_by.h"
#include "render/default_scene.h"
#include "render/option_names.h"
#include "scene/splats_of_cloud.h"

namespace embrun {

void check_scan_options(const RenderOptions& options, const std::string& file) {
  const std::pair<const char*, bool> of_fluids[] = {{"radius", options.radius.has_value()},
                                                    {"extinction", options.extinction.has_value()},
                                                    {"absorption", options.absorption.has_value()},
                                                    {"container", options.container.has_value()},
                                                    {"tank", options.tank.has_value()},
                                                    {"kinds", !options.kinds.empty()},
                                                    {"fluid", !options.fluids.empty()},
                                                    {"foam", !options.foam.empty()},
                                                    {"bubbles", !options.bubbles.empty()},
                                                    {"sand", !options.sand.empty()},
                                                    {"spray", !options.spray.empty()},
                                                    {"representation", options.representation != "direct"},
                                                    {"method", options.method != "fast"}};
  for (const auto& [name, given] : of_fluids) {
    if (!given) continue;
    throw Error(
        fmt::format("{}: {}: that is for fluids, but the file was taken for a scan; for particles of a fluid, "
                    "say --points fluid",
                    file, name));
  }
}

void check_cloud_surface(const RenderOptions& options) {
  const bool mls = cloud_surface_from_name(options.point_surface) == CloudSurface::mls;
  if (mls && ellipses_from_name(options.cloud.splat_shape))
    throw Error("ellipses are a shape of splats: the surface of points \"mls\" takes them as round");
  if (!options.mls_support) return;
  if (!mls) throw Error("mls support: that is for the surface of points \"mls\"");
  if (!(*options.mls_support >= 1 && *options.mls_support <= 16))
    throw Error(fmt::format("mls support {}: it must be in [1, 16]", *options.mls_support));
}

void check_fluid_options(const RenderOptions& options, const std::string& file) {
  if (cloud_surface_from_name(options.point_surface) == CloudSurface::splats) return;
  throw Error(
      fmt::format("{}: point surface: that is for scans, but the file was taken for particles of a fluid; for points "
                  "of a surface, say --points surface",
                  file));
}

SceneDescription make_cloud_scene(const SplatCloud& cloud, const RenderOptions& options, const std::string& file,
                                  std::vector<std::string>& notes) {
  SceneDescription scene;
  scene.up = up_from_name(options.up);
  SplatsDescription& splats = scene.splats.emplace_back(splats_of_cloud(cloud));
  splats.file = file;
  splats.options = splat_options(options.cloud);
  splats.surface = cloud_surface_from_name(options.point_surface);
  if (options.mls_support) splats.mls_support = *options.mls_support;
  // Clay, which stands out from the floor.
  if (cloud.colours.empty()) splats.material.reflectance.first = {0.68f, 0.52f, 0.4f};
  if (!options.color_by.empty()) {
    ColorsByAttribute colors = color_by_attribute(cloud.particles, options.color_by, options.color_map, file);
    notes.push_back(fmt::format("colours from {:.6g} to {:.6g} of {}; its values go from {:.6g} to {:.6g}", colors.low,
                                colors.high, options.color_by, colors.least, colors.most));
    splats.colors = std::move(colors.colors);
    splats.material = default_splat_material(true);
  }
  Box3d bounds{cloud.particles.positions[0], cloud.particles.positions[0]};
  for (const Vec3d p : cloud.particles.positions) {
    bounds.low = min_of(bounds.low, p);
    bounds.high = max_of(bounds.high, p);
  }
  const double lowest = scene.up == UpAxis::y ? bounds.low.y : bounds.low.z;
  add_surroundings(scene, options, bounds, lowest, notes);
  return scene;
}

}  // namespace embrun
