#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "math/vec.h"
#include "particles/point_tree.h"

namespace embrun {

/// An elliptical splat: the two half axes, metres, at right angles to each other and to the normal.
struct SplatAxes {
  Vec3 major, minor;
};

/// Those of a disc: any two directions in its plane. Unit normal.
SplatAxes disc_axes(Vec3 normal, float radius);

struct SplatSizes {
  std::vector<float> radii;     ///< metres, of round splats
  std::vector<SplatAxes> axes;  ///< of elliptical ones, where asked for
  std::size_t at_border = 0;    ///< points whose cell is open: at the border of the surface, or alone
};

/// Flat cells do not quite close a curved surface: how much larger splats are than their cells.
inline constexpr float splat_overlap = 1.05f;

/// Sizes that leave no hole at the least overlap. Each splat covers its own cell of the Voronoi diagram of the points,
/// drawn in its tangent plane; the cells tile the surface, so that it is closed, and the radius is splat_overlap times the
/// least for which each splat covers its cell: the distance to the cell's farthest corner [Okabe2000]. Neighbours stand in
/// the tangent plane in their direction, at their full distance, which on a curved surface errs towards larger cells. Those
/// whose normal points the other way (the far side of a thin wall), and those more above than beside the point, do not bound
/// the cell. A cell is open where its corners lie beyond half the distance to the 96th neighbour; there only the corners
/// within count, and the radius is no greater than the greatest of the 8 nearest closed cells.
///
/// Ellipses are the least ones that cover the cell so enlarged, but no longer than 3 times their width; the disc where that
/// is no greater. Unit `normals`, consistently oriented.
SplatSizes estimate_splats(const PointTree& tree, std::span<const Vec3d> points, std::span<const Vec3> normals,
                           bool ellipses);

}  // namespace embrun
