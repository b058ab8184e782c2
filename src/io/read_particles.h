#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "particles/particle_set.h"

namespace embrun {

/// Particles of a BGEO, PLY, PCD, LAS, OBJ, legacy VTK or XYZ/CSV file (see io/particle_readers.h for what of each).
/// The format is found by the file's content, whatever its name. Particles with a non-finite coordinate are left out
/// and counted. Throws Error, naming the file, the line or offset and the attribute, when the file cannot be read as
/// particles, and NoParticles when it holds none.
ParticleSet read_particles(const std::string& path);

/// The same for a file in memory; `name` is what error messages call it.
ParticleSet read_particles_from_memory(std::span<const std::byte> file, std::string_view name);

}  // namespace embrun
