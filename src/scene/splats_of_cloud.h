#pragma once

#include "particles/splat_cloud.h"
#include "scene/scene_description.h"

namespace embrun {

/// What a cloud's surface looks like if nothing is said of it: diffuse, in its own colours where it has any, else grey, and
/// alike from both sides.
MaterialDescription default_splat_material(bool has_colors);

/// The splats of a cloud as a shape of a scene, of that default material.
SplatsDescription splats_of_cloud(const SplatCloud& cloud);

/// The same of splats that lie in a file.
SplatsDescription splats_of_file(std::shared_ptr<const SplatHierarchy> hierarchy, const std::string& file);

/// Footprints that a part of a cloud may be large where there is nothing else to go by: pixels, for the camera's rays.
inline constexpr double usual_detail = 1;

}  // namespace embrun
