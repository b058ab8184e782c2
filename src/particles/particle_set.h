#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "math/vec.h"

namespace embrun {

/// Storage type of an attribute's components. Integers are int32 wherever all of the attribute's values
/// fit, whatever the file's type was; only an attribute with a value outside int32 is int64.
enum class AttributeType { float32, int32, int64 };

/// One named per-particle array, `components` values a particle, interleaved.
/// Exactly one of `floats`, `ints` and `longs` is filled, as `type` says, with components * count values.
struct Attribute {
  std::string name;
  AttributeType type = AttributeType::float32;
  int components = 1;
  std::vector<float> floats;
  std::vector<std::int32_t> ints;
  std::vector<std::int64_t> longs;
  /// What the values of a text attribute (type int32) index into; a value outside it has no text. Else empty.
  std::vector<std::string> strings;
  /// The name (or names, "red,green,blue") in the file where that differs from `name`, else empty.
  std::string file_name;
  /// Values that were NaN, infinite or missing in the file; they are 0 here.
  std::size_t replaced_non_finite = 0;

  /// Number of values: components * particles.
  std::size_t value_count() const {
    return type == AttributeType::float32 ? floats.size() : type == AttributeType::int32 ? ints.size() : longs.size();
  }
  /// Value number i (particle * components + component), whatever the type.
  double value(std::size_t i) const {
    return type == AttributeType::float32 ? static_cast<double>(floats[i])
           : type == AttributeType::int32 ? static_cast<double>(ints[i])
                                          : static_cast<double>(longs[i]);
  }
};

/// Particles as a structure of arrays: positions in metres, double precision as the file's frame of
/// reference may be far away, and every other attribute of the file under its own name
/// ("velocity", "density", "radius", "id", "type", "color", ...; readers map the usual aliases and keep
/// the original in `file_name`). All positions and float attributes are finite: readers see to it.
struct ParticleSet {
  std::vector<Vec3d> positions;
  std::vector<Attribute> attributes;
  /// Particles of the file that were left out because a coordinate was not finite.
  std::size_t dropped_non_finite = 0;
  /// Where the scanner stood, in the frame of the positions, where the file says so.
  std::optional<Vec3d> sensor;
  /// What the file was, for people: "BGEO V5, gzip".
  std::string format;
  /// What a reader changed or left out, one sentence each.
  std::vector<std::string> notes;

  std::size_t size() const { return positions.size(); }
  /// The attribute of that name, or else the one that had it in the file ("pscale" finds "radius"); or null.
  const Attribute* find(std::string_view name) const {
    for (const Attribute& attribute : attributes) {
      if (attribute.name == name) return &attribute;
    }
    for (const Attribute& attribute : attributes) {
      if (!attribute.file_name.empty() && attribute.file_name == name) return &attribute;
    }
    return nullptr;
  }
};

/// Keeps the particles whose `keep` is not 0, in their order, with all their attributes.
void keep_particles(ParticleSet& set, const std::vector<std::uint8_t>& keep);

/// Puts the particles, with all their attributes, in that order: particle i is then what order[i] was. Each index once.
void reorder_particles(ParticleSet& set, const std::vector<std::uint32_t>& order);

}  // namespace embrun
