#pragma once

#include "math/up_axis.h"
#include "scene/scene_description.h"

namespace embrun {

/// A tank that is open at the top: walls and a bottom of `thickness` metres (> 0) round a box, as one closed mesh. The
/// material should have a higher priority than what the tank holds.
MeshDescription make_tank(const Box3d& inside, double thickness, UpAxis up, const MaterialDescription& material);

/// Lets a fluid that has a container touch the walls of a tank round it: the fluid ends within the glass, by its lower
/// priority at the glass's inner face, without a gap and without two surfaces at one place.
void press_into_walls(FluidDescription& fluid, double thickness);

}  // namespace embrun
