#pragma once

#include "embrun/cloud_options.h"
#include "particles/cloud_kind.h"
#include "particles/particle_set.h"
#include "particles/splat_cloud.h"

namespace embrun {

/// Throws Error for a name that there is not; what is out of range make_splats() finds.
SplatOptions splat_options(const CloudOptions& options);

/// As the options say, else as the particles do (tell_surface).
CloudVerdict cloud_verdict(const ParticleSet& particles, const CloudOptions& options);

}  // namespace embrun
