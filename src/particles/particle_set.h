#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "math/vec.h"

namespace embrun {

/// Storage type of an attribute's components.
enum class AttributeType { float32, int32 };

/// One named per-particle array, `components` values a particle, interleaved.
/// Exactly one of `floats` and `ints` is filled, as `type` says, with components * count values.
struct Attribute {
  std::string name;
  AttributeType type = AttributeType::float32;
  int components = 1;
  std::vector<float> floats;
  std::vector<std::int32_t> ints;
};

/// Particles as a structure of arrays: positions in metres, double precision as the file's frame of
/// reference may be far away, and every other attribute of the file under its own name
/// ("velocity", "density", "radius", "id", "type", "color", ...; readers map the usual aliases).
/// All positions and float attributes used for rendering are finite: readers see to it.
struct ParticleSet {
  std::vector<Vec3d> positions;
  std::vector<Attribute> attributes;
  /// Particles of the file that were left out because a coordinate was not finite.
  std::size_t dropped_non_finite = 0;

  std::size_t size() const { return positions.size(); }
  /// The attribute of that name, or null.
  const Attribute* find(std::string_view name) const {
    for (const Attribute& attribute : attributes) {
      if (attribute.name == name) return &attribute;
    }
    return nullptr;
  }
};

}  // namespace embrun
