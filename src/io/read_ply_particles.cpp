#include <fmt/format.h>

#include "io/particle_readers.h"
#include "io/ply.h"
#include "io/text.h"

namespace embrun {

ParticleSet read_ply_particles(std::span<const std::byte> file, std::string_view name) {
  PlyFile ply(file, name);
  const std::size_t vertex = ply.find("vertex");
  if (vertex == ply.elements().size()) ply.cursor().fail("header", "there is no element \"vertex\"");
  for (std::size_t i = 0; i < vertex; ++i) ply.skip();
  const PlyElement& element = ply.elements()[vertex];
  if (element.count == 0) ply.cursor().fail("element 'vertex'", no_particles);
  PlyRows rows = ply.read();
  if (rows.columns.empty()) ply.cursor().fail("element 'vertex'", "it has no properties x, y, z");

  ParticleSet set =
      particles_from_columns(name, static_cast<std::size_t>(element.count), std::move(rows.columns), rows.place);
  set.format = ply.format();
  for (const PlyProperty& property : element.properties) {
    if (property.is_list) set.notes.push_back(fmt::format("list property {} was left out", quoted(property.name)));
  }
  return set;
}

}  // namespace embrun
