#include "render/cloud_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/error.h"
#include "geometry/mls_support.h"
#include "render/cloud_options.h"
#include "render/color_by.h"
#include "render/default_scene.h"
#include "render/option_names.h"
#include "scene/splats_of_cloud.h"

namespace embrun {

static_assert(default_mls_support == mls_default_support, "the public face and what is rendered have one default");

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
  if (mls && options.lod.value_or(0) > 0)
    throw Error("levels of detail are of splats: the surface of points \"mls\" has none");
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

namespace {

constexpr Rgb clay{0.68f, 0.52f, 0.4f};  // stands out from the floor

void stand_on_floor(SceneDescription& scene, const RenderOptions& options, const Box3d& bounds,
                    std::vector<std::string>& notes) {
  add_surroundings(scene, options, bounds, scene.up == UpAxis::y ? bounds.low.y : bounds.low.z, notes);
}

}  // namespace

SceneDescription make_cloud_scene(const SplatCloud& cloud, const RenderOptions& options, const std::string& file,
                                  std::vector<std::string>& notes) {
  SceneDescription scene;
  scene.up = up_from_name(options.up);
  SplatsDescription& splats = scene.splats.emplace_back(splats_of_cloud(cloud));
  splats.file = file;
  splats.options = splat_options(options.cloud);
  splats.surface = cloud_surface_from_name(options.point_surface);
  if (options.mls_support) splats.mls_support = *options.mls_support;
  splats.detail = options.lod.value_or(0);
  if (cloud.colours.empty()) splats.material.reflectance.first = clay;
  if (!options.color_by.empty()) {
    ColorsByAttribute colors = color_by_attribute(cloud.particles, options.color_by, options.color_map, file);
    notes.push_back(fmt::format("colours from {:.6g} to {:.6g} of {}; its values go from {:.6g} to {:.6g}", colors.low,
                                colors.high, options.color_by, colors.least, colors.most));
    splats.colors = std::move(colors.colors);
    splats.material = default_splat_material(true);
  }
  stand_on_floor(scene, options, box_of(cloud.particles.positions), notes);
  return scene;
}

SceneDescription make_splat_file_scene(const std::shared_ptr<const SplatHierarchy>& splats,
                                       const RenderOptions& options, const std::string& file,
                                       std::vector<std::string>& notes) {
  if (!options.color_by.empty())
    throw Error(
        fmt::format("{}: color by {}: a file of splats has kept no attributes but colours", file, options.color_by));
  if (cloud_surface_from_name(options.point_surface) != CloudSurface::splats)
    throw Error(fmt::format("{}: point surface: a file of splats holds splats alone", file));
  SceneDescription scene;
  scene.up = up_from_name(options.up);
  scene.splats.push_back(splats_of_file(splats, file));
  scene.splats[0].detail = options.lod.value_or(usual_detail);
  if (splats->colors == nullptr) scene.splats[0].material.reflectance.first = clay;
  // The box is of the splats, the floor for their centres.
  const float reach = splats->median_radius;
  const Vec3 room{reach, reach, reach};
  stand_on_floor(
      scene, options,
      {splats->center + to_double(splats->bounds.low + room), splats->center + to_double(splats->bounds.high - room)},
      notes);
  return scene;
}

std::string describe_splat_file(const SplatHierarchy& splats) {
  return fmt::format("{} splats in {} nodes of levels of detail, median radius {:.6g} m; {}{}", splats.splat_count,
                     splats.node_count, splats.median_radius, splats.closed ? "closed" : "open",
                     splats.colors != nullptr ? ", with colours" : "");
}

std::string describe_splat_file(const SplatHierarchy& splats, const std::string& file, bool json) {
  const Vec3d low = splats.center + to_double(splats.bounds.low), high = splats.center + to_double(splats.bounds.high);
  if (!json)
    return fmt::format("{}: a file of splats\n{}\nbounds: {:.6g} {:.6g} {:.6g} to {:.6g} {:.6g} {:.6g}\n", file,
                       describe_splat_file(splats), low.x, low.y, low.z, high.x, high.y, high.z);
  const nlohmann::ordered_json object = {{"file", file},
                                         {"format", "splats"},
                                         {"splats", splats.splat_count},
                                         {"nodes", splats.node_count},
                                         {"median_radius", splats.median_radius},
                                         {"closed", splats.closed},
                                         {"colors", splats.colors != nullptr},
                                         {"bounds", {{low.x, low.y, low.z}, {high.x, high.y, high.z}}}};
  return object.dump(2) + "\n";
}

}  // namespace embrun
