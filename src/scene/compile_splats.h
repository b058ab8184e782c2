#pragma once

#include "scene/flat_scene.h"

namespace embrun {

/// Builds what rays touch of a cloud, its positions made relative to `center`.
SplatArrays compile_splat_arrays(const SplatsDescription& description, Vec3d center);

/// A view of the arrays.
SplatGeometry splat_geometry(const SplatArrays& arrays, bool closed, CloudSurface surface);

/// What a file's arrays are as a geometry; `detail` as of SplatTreeView.
SplatGeometry splat_geometry(const SplatHierarchy& hierarchy, float detail);

/// The radius of a usual splat.
float median_radius(const SplatsDescription& description);

}  // namespace embrun
