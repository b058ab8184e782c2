#pragma once

#include <memory>
#include <string>
#include <vector>

#include "embrun/embrun.h"
#include "geometry/splat_hierarchy.h"
#include "particles/splat_cloud.h"
#include "scene/scene_description.h"

namespace embrun {

/// Throws Error where the options say something of a fluid, naming the option: `file` is a scan.
void check_scan_options(const RenderOptions& options, const std::string& file);

/// Throws Error where the options name a surface of points that there is not, or one that cannot be.
void check_cloud_surface(const RenderOptions& options);
/// Throws Error where they say something of a scan, naming the option: `file` holds a fluid.
void check_fluid_options(const RenderOptions& options, const std::string& file);

/// The scene of a scan: its splats, diffuse, in the colours of the file (or by RenderOptions::color_by), standing on the
/// floor, and surroundings and camera as make_scene() has them. `notes` receives what was put right.
SceneDescription make_cloud_scene(const SplatCloud& cloud, const RenderOptions& options, const std::string& file,
                                  std::vector<std::string>& notes);

/// The same of a file of splats.
SceneDescription make_splat_file_scene(const std::shared_ptr<const SplatHierarchy>& splats,
                                       const RenderOptions& options, const std::string& file,
                                       std::vector<std::string>& notes);

/// A sentence about a file of splats; all about it, as text or as a JSON object.
std::string describe_splat_file(const SplatHierarchy& splats);
std::string describe_splat_file(const SplatHierarchy& splats, const std::string& file, bool json);

}  // namespace embrun
