#pragma once

#include <cstddef>
#include <span>

#include "geometry/surface_model.h"
#include "geometry/triangle_mesh.h"

namespace embrun {

/// How the surface is turned into a mesh.
struct IsosurfaceSettings {
  float cell = 0;              ///< side of a sampling cell, metres; 0: R0/2
  bool exact_vertices = true;  ///< move vertices along their grid edge onto the surface; false: linear interpolation
};

/// What it took.
struct IsosurfaceStats {
  std::size_t blocks = 0;  ///< of 8^3 samples
  std::size_t samples = 0;
  double sampling_seconds = 0, extraction_seconds = 0;
};

/// The surface max(D/T, D'/T') = 1 of `model` as a closed, welded, indexed triangle mesh, counter-clockwise seen from
/// outside: the field sampled on a sparse grid of blocks, and marching cubes. Normals are the field's own at the
/// vertices, weighted or gradient as the model says, of the larger branch. Runs on the threads of the enclosing TBB
/// arena; the mesh does not depend on their number.
/// `radii` as for resolve_surface_model. Throws Error when the cells are too many to number.
TriangleMesh extract_isosurface(std::span<const Vec3> positions, std::span<const float> radii,
                                const SurfaceModel& model, const IsosurfaceSettings& settings = {},
                                IsosurfaceStats* stats = nullptr);

/// Volume enclosed by a closed mesh, by the divergence theorem, and its area.
double enclosed_volume(const TriangleMesh& mesh);
double surface_area(const TriangleMesh& mesh);

}  // namespace embrun
