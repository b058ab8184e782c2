#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "particles/particle_set.h"

namespace embrun {

/// What a particle stands for. Spray is water as drops on their own; `none` is left out.
enum class ParticleKind : std::uint8_t { water, foam, spray, bubble, sand, none };
inline constexpr int particle_kind_count = 6;

/// "water", "foam", "spray", "bubble", "sand", "none"; throws Error for another name, and lists these.
ParticleKind kind_from_name(std::string_view name);
const char* to_string(ParticleKind kind);

/// Which kind a particle is, by the value of an attribute.
struct KindMapping {
  std::string attribute;
  /// Values, as text, and what they stand for; all others are water.
  std::vector<std::pair<std::string, ParticleKind>> kinds;

  bool empty() const { return attribute.empty(); }
};

/// "type:0=foam,1=spray,2=bubble". A value is a number, or a text of an attribute that has texts. Throws Error.
KindMapping kind_mapping_from_text(const std::string& text);

/// The particles of each kind, in their order, with all their attributes; indexed by ParticleKind. Throws Error naming
/// `file` when there is no such attribute, with one component.
std::array<ParticleSet, particle_kind_count> split_by_kind(const ParticleSet& particles, const KindMapping& mapping,
                                                           std::string_view file);

}  // namespace embrun
