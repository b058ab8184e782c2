#pragma once

#include <string>
#include <vector>

#include "reproduction/plan.h"

namespace embrun {

/// Scenes of figures 67 and 68: bubbles, sand, foam and two fluids. What no solver made (sand, and all of a calm pool) is
/// picked from the water's particles and written to the folder `picked`. `notes` says which are left out because the sample
/// data lack their particles.
std::vector<PictureSpec> showcase_pictures(const ReproduceOptions& options, const std::string& picked,
                                           std::vector<std::string>& notes);

}  // namespace embrun
