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

/// Calls visit(values, how many a particle) for all that particles have; arrays of other types than an attribute's are empty.
template <class Visit>
void for_each_array(ParticleSet& set, const Visit& visit) {
  visit(set.positions, 1);
  for (Attribute& attribute : set.attributes) {
    const std::size_t components = static_cast<std::size_t>(attribute.components);
    visit(attribute.floats, components);
    visit(attribute.ints, components);
    visit(attribute.longs, components);
  }
}

}  // namespace

void keep_particles(ParticleSet& set, const std::vector<std::uint8_t>& keep) {
  EMBRUN_CHECK(keep.size() == set.size());
  for_each_array(set, [&](auto& values, std::size_t components) { keep_values(values, components, keep); });
}

void reorder_particles(ParticleSet& set, const std::vector<std::uint32_t>& order) {
  EMBRUN_CHECK(order.size() == set.size());
  for_each_array(set, [&](auto& values, std::size_t components) { reorder_values(values, components, order); });
}

}  // namespace embrun
