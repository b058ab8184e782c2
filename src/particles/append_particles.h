#pragma once

#include "particles/particle_set.h"

namespace embrun {

/// Puts the particles of `more` behind those of `set`. Attributes that not both have, with as many components, are left
/// out, with a note; numbers of different types become the type that holds both.
void append_particles(ParticleSet& set, ParticleSet more);

}  // namespace embrun
