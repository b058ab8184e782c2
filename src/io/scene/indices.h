#pragma once

#include "io/scene/object.h"

namespace embrun {

/// Refractive indices on the two sides of a dielectric's surface.
struct IndexPair {
  double interior = 1, exterior = 1;
};

/// int_ior and ext_ior, as numbers or names ("water"); `interior` in air where they are not given.
IndexPair read_indices(SceneObject& bsdf, std::string_view interior = "bk7");

/// True for the types of <bsdf> that bound an inside by int_ior and ext_ior.
bool bounds_inside(std::string_view type);

/// Complex index of a metal, relative to air: eta + i k, a channel each.
struct ComplexIndex {
  Rgb eta{0, 0, 0}, k{1, 1, 1};
};

/// A conductor's `material`, by name ("Au"), or its `eta` and `k`; where nothing is given, what reflects everything.
ComplexIndex read_complex_index(SceneObject& bsdf);

}  // namespace embrun
