#include "particles/particle_set.h"

#include "base/error.h"

namespace embrun {

namespace {

template <class Value>
void keep_values(std::vector<Value>& values, std::size_t components, const std::vector<std::uint8_t>& keep) {
  if (values.empty()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (!keep[i]) continue;
    for (std::size_t c = 0; c < components; ++c) values[kept++] = values[i * components + c];
  }
  values.resize(kept);
}

}  // namespace

void keep_particles(ParticleSet& set, const std::vector<std::uint8_t>& keep) {
  EMBRUN_CHECK(keep.size() == set.size());
  keep_values(set.positions, 1, keep);
  for (Attribute& attribute : set.attributes) {
    const std::size_t components = static_cast<std::size_t>(attribute.components);
    keep_values(attribute.floats, components, keep);
    keep_values(attribute.ints, components, keep);
    keep_values(attribute.longs, components, keep);
  }
}

}  // namespace embrun
