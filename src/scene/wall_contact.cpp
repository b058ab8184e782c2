#include "scene/wall_contact.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/error.h"

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
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  const double spacing = fluid.surface.spacing > 0 ? fluid.surface.spacing : 2 * radius;
  return std::max(0.0, *middle - 0.5 * spacing);
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

}  // namespace

WettedParticles wet_walls(const FluidDescription& fluid) {
  EMBRUN_CHECK(fluid.container.has_value());
  const Box3d& box = *fluid.container;
  WettedParticles particles{fluid.positions, fluid.radii};
  const Face faces[] = {{0, false, box.low.x}, {0, true, box.high.x}, {1, false, box.low.y},
                        {1, true, box.high.y}, {2, false, box.low.z}, {2, true, box.high.z}};
  for (const Face& face : faces) wet(face, fluid, particles);
  return particles;
}

}  // namespace embrun
