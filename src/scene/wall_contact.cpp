#include "scene/wall_contact.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/error.h"
#include "math/median.h"
#include "particles/neighbour_grid.h"

namespace embrun {
namespace {

/// One face of a box. Heights above it are positive on the box's side.
struct Face {
  int axis;
  bool upper;
  double place;

  double height(Vec3d p) const { return upper ? place - component(p) : component(p) - place; }
  /// The point moved so that its height is `height`.
  Vec3d at_height(Vec3d p, double height) const {
    const double c = upper ? place - height : place + height;
    return axis == 0 ? Vec3d{c, p.y, p.z} : axis == 1 ? Vec3d{p.x, c, p.z} : Vec3d{p.x, p.y, c};
  }

 private:
  double component(Vec3d p) const { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }
};

/// Height of the plane that the particles are mirrored at: half a spacing outside the layer that lies at the wall, so that
/// the images go on as the fluid does. Nothing where no particle lies at the wall.
std::optional<double> mirror_height(const Face& face, const FluidDescription& fluid, const WettedParticles& particles) {
  const double radius = static_cast<double>(fluid.surface.radius);
  std::vector<double> heights;
  for (const Vec3d& p : particles.positions) {
    const double height = face.height(p);
    if (height > 0 && height < 2.5 * radius) heights.push_back(height);
  }
  if (heights.empty()) return std::nullopt;
  const double spacing = fluid.surface.spacing > 0 ? fluid.surface.spacing : 2 * radius;
  return std::max(0.0, median_of(heights) - 0.5 * spacing);
}

/// Makes the particles touch one face, if it is a wall.
void wet(const Face& face, const FluidDescription& fluid, WettedParticles& particles) {
  const auto reach = [&](std::size_t i) {
    const float radius = particles.radii.empty() ? fluid.surface.radius : particles.radii[i];
    return 2 * fluid.surface.order * static_cast<double>(radius);
  };
  const std::optional<double> mirror = mirror_height(face, fluid, particles);
  if (!mirror) return;
  std::size_t near = 0, beyond = 0;
  const std::size_t count = particles.positions.size();
  for (std::size_t i = 0; i < count; ++i) {
    const double height = face.height(particles.positions[i]);
    near += height > 0 && height < reach(i);
    beyond += height <= 0 && height > -reach(i);
  }
  if (beyond * 50 > near) return;

  WettedParticles out;
  out.positions.reserve(count + near);
  const auto keep = [&](Vec3d p, std::size_t i) {
    out.positions.push_back(p);
    if (!particles.radii.empty()) out.radii.push_back(particles.radii[i]);
  };
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d p = particles.positions[i];
    const double height = face.height(p);
    if (height <= 0) continue;
    keep(p, i);
    const double image = 2 * *mirror - height;
    // Only what can be felt within the box.
    if (image > -reach(i)) keep(face.at_height(p, image), i);
  }
  particles = std::move(out);
}

/// The faces of the container that particles lie at.
std::vector<Face> walls_of(const FluidDescription& fluid) {
  const Box3d& box = *fluid.container;
  const Face faces[] = {{0, false, box.low.x}, {0, true, box.high.x}, {1, false, box.low.y},
                        {1, true, box.high.y}, {2, false, box.low.z}, {2, true, box.high.z}};
  std::vector<Face> walls;
  for (const Face& face : faces)
    if (mirror_height(face, fluid, {fluid.positions, {}})) walls.push_back(face);
  return walls;
}

/// Solvers round the fluid off along the edges where two walls meet, too: fills the wedge that is missing there with
/// particles on a lattice, where the fluid next to it says that it is full.
void fill_edges(const FluidDescription& fluid, WettedParticles& particles) {
  const double radius = static_cast<double>(fluid.surface.radius);
  const double s = fluid.surface.spacing > 0 ? fluid.surface.spacing : 2 * radius;
  const double wedge = 3 * s;
  const std::vector<Face> walls = walls_of(fluid);
  const NeighbourGrid grid(fluid.positions, 1.5 * s);
  const auto count_within = [&](Vec3d p, double reach) {
    int count = 0;
    grid.for_each_within(p, reach, [&](std::size_t, Vec3d, double) { ++count; });
    return count;
  };

  const Box3d bounds = box_of(fluid.positions);
  const auto consider = [&](Vec3d p) {
    // The place next to the wedge, away from every wall that is near.
    Vec3d full = p;
    int near = 0;
    for (const Face& wall : walls) {
      const double height = wall.height(p);
      if (height < 0.25 * s) return;
      if (height > wedge) continue;
      ++near;
      full = wall.at_height(full, wedge + s);
    }
    // A ball of 1.5 spacings holds 14 particles in the bulk; one of 0.8 spacings without any is a hole.
    if (near < 2 || count_within(p, 0.8 * s) > 0 || count_within(full, 1.5 * s) < 10) return;
    particles.positions.push_back(p);
    if (!particles.radii.empty()) particles.radii.push_back(fluid.surface.radius);
  };
  for (std::size_t i = 0; i < walls.size(); ++i)
    for (std::size_t j = i + 1; j < walls.size(); ++j) {
      const Face &a = walls[i], &b = walls[j];
      if (a.axis == b.axis) continue;
      // Lattice points of the edge's wedge, along the third axis.
      const Vec3d along = a.axis + b.axis == 1   ? Vec3d{0, 0, 1}
                          : a.axis + b.axis == 2 ? Vec3d{0, 1, 0}
                                                 : Vec3d{1, 0, 0};
      const double first = dot(bounds.low, along), last = dot(bounds.high, along);
      for (double t = first; t <= last; t += s)
        for (double u = 0.5 * s; u < wedge; u += s)
          for (double v = 0.5 * s; v < wedge; v += s) consider(b.at_height(a.at_height(t * along, u), v));
    }
}

}  // namespace

WettedParticles wet_walls(const FluidDescription& fluid) {
  EMBRUN_CHECK(fluid.container.has_value());
  WettedParticles particles{fluid.positions, fluid.radii};
  fill_edges(fluid, particles);
  for (const Face& wall : walls_of(fluid)) wet(wall, fluid, particles);
  return particles;
}

}  // namespace embrun
