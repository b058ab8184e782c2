#pragma once

#include <string_view>
#include <vector>

#include "math/rgb.h"
#include "math/vec.h"
#include "particles/particle_set.h"

// What the attributes of a cloud's file say of its splats.

namespace embrun {

/// The attribute if it holds numbers, so many a point; or null.
const Attribute* number_attribute(const ParticleSet& particles, std::string_view name, int components);

/// Unit normals of the file; the zero vector for those that have no direction. Empty where it has none at all.
std::vector<Vec3> normals_of_points(const ParticleSet& particles);

/// What values of the attribute "color" are multiplied by so that they go from 0 to 1, given the greatest of them: floats of
/// some files go to 255.
double color_scale(double greatest);

}  // namespace embrun
