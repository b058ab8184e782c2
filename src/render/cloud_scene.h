#pragma once

#include <string>
#include <vector>

#include "embrun/embrun.h"
#include "particles/splat_cloud.h"
#include "scene/scene_description.h"

namespace embrun {

/// Throws Error where the options say something of a fluid, naming the option: `file` is a scan.
void check_scan_options(const RenderOptions& options, const std::string& file);

/// The scene of a scan: its splats, diffuse, in the colours of the file (or by RenderOptions::color_by), standing on the
/// floor, and surroundings and camera as make_scene() has them. `notes` receives what was put right.
SceneDescription make_cloud_scene(const SplatCloud& cloud, const RenderOptions& options, const std::string& file,
                                  std::vector<std::string>& notes);

}  // namespace embrun
