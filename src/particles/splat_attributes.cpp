#include "particles/splat_attributes.h"

#include <cmath>

namespace embrun {

const Attribute* number_attribute(const ParticleSet& particles, std::string_view name, int components) {
  const Attribute* attribute = particles.find(name);
  return attribute && attribute->components == components && attribute->strings.empty() ? attribute : nullptr;
}

std::vector<Vec3> normals_of_points(const ParticleSet& particles) {
  const Attribute* attribute = number_attribute(particles, "normal", 3);
  if (!attribute) return {};
  std::vector<Vec3> normals(particles.size());
  bool any = false;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec3d n{attribute->value(3 * i), attribute->value(3 * i + 1), attribute->value(3 * i + 2)};
    const double size = length(n);
    if (!(size > 0) || !std::isfinite(size)) continue;
    normals[i] = to_float(n * (1 / size));
    any = true;
  }
  if (!any) normals.clear();
  return normals;
}

double color_scale(double greatest) { return greatest > 1 && greatest <= 255 ? 1.0 / 255 : 1; }

}  // namespace embrun
