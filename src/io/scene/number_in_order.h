#pragma once

#include "scene/scene_description.h"

namespace embrun {

/// Numbers the scene's pictures and grid media in the order in which the materials name them, so that a scene that is
/// written and read again has the same numbers. What no material names is dropped.
void number_in_order(SceneDescription& scene);

}  // namespace embrun
