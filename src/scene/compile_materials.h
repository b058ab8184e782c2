#pragma once

#include "materials/material.h"
#include "scene/flat_scene.h"

namespace embrun {

/// Adds a material, and what it has on its back, to the scene's; returns its index. The scene's recentring and pictures
/// must be there.
std::uint32_t add_material(const MaterialDescription& description, FlatScene& flat);

/// Mean Fresnel reflectance for diffuse light that comes from within a body of that index at its smooth surface.
double inner_diffuse_reflectance(double index);

}  // namespace embrun
