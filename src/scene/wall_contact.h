#pragma once

#include <vector>

#include "scene/scene_description.h"

namespace embrun {

/// Particles of a fluid in a container, made to touch its walls. Solvers leave a gap there (1.4 to 1.8 radii). Where
/// particles lie within 2.5 radii of a face, all those whose field reaches it get a mirror image, the mirror standing
/// half a spacing outside the layer at the wall: the field runs on to the wall and behind it as it does within the fluid.
/// Wedges that are missing along the edges where two such faces meet are filled.
/// Particles beyond such a face (a solver lets a few through) are left out. A face that cuts through the fluid, which
/// goes on behind it, is none that the fluid lies at: nothing is done there.
struct WettedParticles {
  std::vector<Vec3d> positions;
  std::vector<float> radii;  ///< empty as the fluid's are
};

/// `fluid.container` must be given.
WettedParticles wet_walls(const FluidDescription& fluid);

}  // namespace embrun
