#include "scene/wall_contact.h"

#include "base/error.h"

namespace embrun {
namespace {

/// One face of a box: `height` above it is positive on the box's side.
struct Face {
  int axis;
  bool upper;
  double place;

  double height(Vec3d p) const {
    const double c = component(p);
    return upper ? place - c : c - place;
  }
  Vec3d mirror(Vec3d p) const {
    const double c = 2 * place - component(p);
    return axis == 0 ? Vec3d{c, p.y, p.z} : axis == 1 ? Vec3d{p.x, c, p.z} : Vec3d{p.x, p.y, c};
  }

 private:
  double component(Vec3d p) const { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }
};

/// Makes the particles touch one face, if it is a wall.
void wet(const Face& face, const FluidDescription& fluid, WettedParticles& particles) {
  const double order = 2 * fluid.surface.order;
  const auto reach = [&](std::size_t i) {
    const float radius = particles.radii.empty() ? fluid.surface.radius : particles.radii[i];
    return order * static_cast<double>(radius);
  };
  std::size_t near = 0, beyond = 0;
  const std::size_t count = particles.positions.size();
  for (std::size_t i = 0; i < count; ++i) {
    const double height = face.height(particles.positions[i]);
    near += height > 0 && height < reach(i);
    beyond += height <= 0 && height > -reach(i);
  }
  if (near == 0 || beyond * 50 > near) return;

  WettedParticles out;
  out.positions.reserve(count + near);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d p = particles.positions[i];
    const double height = face.height(p);
    if (height <= 0) continue;
    out.positions.push_back(p);
    if (!particles.radii.empty()) out.radii.push_back(particles.radii[i]);
    if (height >= reach(i)) continue;
    out.positions.push_back(face.mirror(p));
    if (!particles.radii.empty()) out.radii.push_back(particles.radii[i]);
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
