#include "particles/particle_kinds.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "base/error.h"

namespace embrun {
namespace {

constexpr std::pair<const char*, ParticleKind> names[] = {
    {"water", ParticleKind::water},   {"foam", ParticleKind::foam}, {"spray", ParticleKind::spray},
    {"bubble", ParticleKind::bubble}, {"sand", ParticleKind::sand}, {"none", ParticleKind::none}};

/// What one particle's value of the attribute stands for.
ParticleKind kind_of(const Attribute& attribute, std::size_t particle, const KindMapping& mapping) {
  const double value = attribute.value(particle);
  for (const auto& [text, kind] : mapping.kinds) {
    if (!attribute.strings.empty()) {
      if (value >= 0 && value < static_cast<double>(attribute.strings.size()) &&
          attribute.strings[static_cast<std::size_t>(value)] == text)
        return kind;
      continue;
    }
    if (std::strtod(text.c_str(), nullptr) == value) return kind;
  }
  return ParticleKind::water;
}

}  // namespace

ParticleKind kind_from_name(std::string_view name) {
  std::string known;
  for (const auto& [text, kind] : names) {
    if (name == text) return kind;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  throw Error("kind of particle \"" + std::string(name) + "\" is unknown: there are " + known);
}

const char* to_string(ParticleKind kind) {
  const auto* found = std::find_if(std::begin(names), std::end(names), [&](const auto& n) { return n.second == kind; });
  return found->first;
}

KindMapping kind_mapping_from_text(const std::string& text) {
  const std::string wanted =
      "kinds \"" + text + "\": give an attribute and what its values stand for, such as type:0=foam,1=spray,2=bubble";
  const std::size_t colon = text.find(':');
  if (colon == 0 || colon == std::string::npos) throw Error(wanted);
  KindMapping mapping;
  mapping.attribute = text.substr(0, colon);
  for (std::size_t begin = colon + 1; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string entry = text.substr(begin, end - begin);
    const std::size_t equals = entry.find('=');
    if (equals == 0 || equals == std::string::npos) throw Error(wanted);
    mapping.kinds.emplace_back(entry.substr(0, equals), kind_from_name(entry.substr(equals + 1)));
    begin = end + 1;
  }
  return mapping;
}

std::array<ParticleSet, particle_kind_count> split_by_kind(const ParticleSet& particles, const KindMapping& mapping,
                                                           std::string_view file) {
  const Attribute* attribute = particles.find(mapping.attribute);
  if (attribute == nullptr || attribute->components != 1) {
    std::string known;
    for (const Attribute& a : particles.attributes)
      if (a.components == 1) known += (known.empty() ? "" : ", ") + a.name;
    throw Error(std::string(file) + ": the particles have no attribute \"" + mapping.attribute +
                "\" with one value each to tell their kinds by; they have: " + (known.empty() ? "none" : known));
  }
  if (attribute->strings.empty()) {
    for (const auto& [text, kind] : mapping.kinds) {
      char* end = nullptr;
      const double value = std::strtod(text.c_str(), &end);
      if (*end != '\0' || !std::isfinite(value))
        throw Error(std::string(file) + ": the attribute \"" + mapping.attribute + "\" holds numbers; \"" + text +
                    "\" is none");
    }
  }
  std::vector<ParticleKind> kinds(particles.size());
  for (std::size_t i = 0; i < particles.size(); ++i) kinds[i] = kind_of(*attribute, i, mapping);
  std::array<ParticleSet, particle_kind_count> sets;
  std::vector<std::uint8_t> keep(particles.size());
  for (int k = 0; k < particle_kind_count; ++k) {
    std::transform(kinds.begin(), kinds.end(), keep.begin(),
                   [&](ParticleKind kind) { return static_cast<std::uint8_t>(kind == static_cast<ParticleKind>(k)); });
    ParticleSet& set = sets[static_cast<std::size_t>(k)];
    set = particles;
    keep_particles(set, keep);
  }
  return sets;
}

}  // namespace embrun
