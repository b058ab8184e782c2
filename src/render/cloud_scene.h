#pragma once

#include <string>
#include <vector>

#include "embrun/embrun.h"
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

}  // namespace embrun
