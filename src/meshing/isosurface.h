#pragma once

#include <cstddef>
#include <functional>
#include <span>

#include "geometry/surface_model.h"
#include "geometry/triangle_mesh.h"

namespace embrun {

/// How the surface is turned into a mesh.
struct IsosurfaceSettings {
  float cell = 0;              ///< side of a sampling cell, metres; 0: R0/2
  bool exact_vertices = true;  ///< move vertices along their grid edge onto the surface; false: linear interpolation
  /// Told now and then how much is done, 0 to 1, from any thread but by one at a time.
  std::function<void(double fraction)> progress = {};
};

/// What it took.
struct IsosurfaceStats {
  std::size_t tiles = 0;      ///< of 16^3 samples, where particles are felt
  std::uint64_t samples = 0;  ///< of the field; what is proven to be inside or outside has none
  double sampling_seconds = 0, extraction_seconds = 0;
};

/// The surface max(D/T, D'/T') = 1 of `model` as a closed, welded, indexed triangle mesh, counter-clockwise seen from
/// outside: the field's signs on a sparse grid, and marching cubes. Vertices lie on the surface to some 1e-5 R0 (the
/// precision of the coordinates). Normals are the field's own at the vertices, weighted or gradient as the model says,
/// of the larger branch. Runs on the threads of the enclosing TBB arena; the mesh does not depend on their number.
/// `radii` as for resolve_surface_model. Throws Error when the cells are too many to number, or too fine.
TriangleMesh extract_isosurface(std::span<const Vec3> positions, std::span<const float> radii,
                                const SurfaceModel& model, const IsosurfaceSettings& settings = {},
                                IsosurfaceStats* stats = nullptr);

/// The pieces of a mesh that hang together by vertices.
std::size_t component_count(const TriangleMesh& mesh);
/// Volume enclosed by a closed mesh, by the divergence theorem, and its area.
double enclosed_volume(const TriangleMesh& mesh);
double surface_area(const TriangleMesh& mesh);

}  // namespace embrun
