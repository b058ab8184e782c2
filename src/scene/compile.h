#pragma once

#include "scene/flat_scene.h"
#include "scene/scene_description.h"

namespace embrun {

/// Validates a scene and makes the arrays that rays touch: coordinates recentred in double precision, media sorted into
/// priority classes, the fluids' surfaces built. Throws Error for a scene that validate() rejects, and for one with
/// more than 7 different media or 32 fluids.
FlatScene compile(const SceneDescription& scene);

}  // namespace embrun
