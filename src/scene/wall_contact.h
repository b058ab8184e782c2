#pragma once

#include <vector>

#include "scene/scene_description.h"

namespace embrun {

/// Particles of a fluid in a container, made to touch its walls: those that lie within their influence radius of a face
/// get a mirror image behind it, so that the field runs on to the wall as it does within the fluid and the gap that
/// solvers leave there (1.4 to 1.8 radii) is closed. Those beyond such a face (a solver lets a few through) are left out.
/// A face that cuts through the fluid, which goes on behind it, is none that the fluid lies at: nothing is done there.
struct WettedParticles {
  std::vector<Vec3d> positions;
  std::vector<float> radii;  ///< empty as the fluid's are
};

/// `fluid.container` must be given.
WettedParticles wet_walls(const FluidDescription& fluid);

}  // namespace embrun
