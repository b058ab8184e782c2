#include "particles/particle_set.h"

#include <utility>

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

template <class Value>
void reorder_values(std::vector<Value>& values, std::size_t components, const std::vector<std::uint32_t>& order) {
  if (values.empty()) return;
  std::vector<Value> moved;
  moved.reserve(values.size());
  for (const std::uint32_t from : order) {
    for (std::size_t c = 0; c < components; ++c) moved.push_back(values[from * components + c]);
  }
  values = std::move(moved);
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

void reorder_particles(ParticleSet& set, const std::vector<std::uint32_t>& order) {
  EMBRUN_CHECK(order.size() == set.size());
  reorder_values(set.positions, 1, order);
  for (Attribute& attribute : set.attributes) {
    const std::size_t components = static_cast<std::size_t>(attribute.components);
    reorder_values(attribute.floats, components, order);
    reorder_values(attribute.ints, components, order);
    reorder_values(attribute.longs, components, order);
  }
}

}  // namespace embrun
