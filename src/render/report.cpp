#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "embrun/embrun.h"

namespace embrun {
namespace {

double total_seconds(const RenderReport& r) {
  return r.read_seconds + r.build_seconds + r.render_seconds + r.write_seconds;
}

std::string ray_line(const char* kind, const RayReport& rays) {
  if (rays.rays == 0) return {};
  return fmt::format("    {:<19} {:>12} {:>9.2f} M/s a thread\n", kind, rays.rays, rays.rays_per_second * 1e-6);
}

nlohmann::ordered_json to_object(const RayReport& rays) {
  return {{"count", rays.rays}, {"per_second", rays.rays_per_second}};
}

}  // namespace

std::string to_text(const RenderReport& r) {
  std::string text;
  if (!r.scan.empty()) {
    text += fmt::format("  splats     {}{}, median radius {:.6g} m\n", r.particles,
                        r.dropped > 0 ? fmt::format(" ({} points left out)", r.dropped) : "", r.radius);
    for (const std::string& line : r.scan) text += fmt::format("  scan       {}\n", line);
  } else if (r.particles > 0) {
    text += fmt::format("  particles  {}{}, radius {:.6g} m ({}), spacing {:.6g} m\n", r.particles,
                        r.dropped > 0 ? fmt::format(" ({} left out)", r.dropped) : "", r.radius, r.radius_source,
                        r.spacing);
    text += fmt::format("  surface    threshold {:.6g}, influence radius {:.6g} m, {} particles recovered, {:.1f} MB\n",
                        r.threshold, r.influence_radius, r.recovered, r.surface_bytes / 1e6);
  }
  if (r.mesh_triangles > 0)
    text += fmt::format("  mesh       {} triangles, {} vertices; {:.2f} s, and {:.2f} s for the tree over it\n",
                        r.mesh_triangles, r.mesh_vertices, r.mesh_seconds, r.tree_seconds);
  if (r.grid_cells > 0)
    text += fmt::format("  grid       {} cells of what is in the fluid; {:.2f} s\n", r.grid_cells, r.grid_seconds);
  text +=
      fmt::format("  time       {:.2f} s: read {:.2f}, build {:.2f}, render {:.2f}, write {:.2f}; CPU {:.2f} s\n",
                  total_seconds(r), r.read_seconds, r.build_seconds, r.render_seconds, r.write_seconds, r.cpu_seconds);
  text += fmt::format("  machine    {} threads, {}, {:.0f} MB at most\n", r.threads, r.instruction_set,
                      r.peak_memory_bytes / 1e6);
  text += fmt::format("  samples    {} a pixel, relative error {:.2f} %\n", r.samples, 100 * r.relative_error);
  text += "  rays\n";
  text += ray_line("camera", r.camera_rays) + ray_line("secondary, outside", r.outside_rays) +
          ray_line("secondary, inside", r.inside_rays) + ray_line("shadow", r.shadow_rays);
  if (r.bent_directions > 0)
    text += fmt::format("  normals    {} of {} directions bent to their side of the surface\n", r.bent_directions,
                        r.scatterings);
  if (r.majorants_exceeded > 0)
    text += fmt::format("  error      {} extinctions were above their bound: the picture is wrong; please report it\n",
                        r.majorants_exceeded);
  if (r.medium_contradictions > 0) {
    text += fmt::format("  media      {} crossings contradicted the medium and were put right; to replay:\n",
                        r.medium_contradictions);
    for (const std::string& command : r.contradiction_commands) text += fmt::format("    {}\n", command);
  }
  if (r.bad_samples > 0) {
    text += fmt::format("  bad        {} samples left out (not a number, infinite, negative or stuck); to replay:\n",
                        r.bad_samples);
    for (const std::string& command : r.replay_commands) text += fmt::format("    {}\n", command);
  }
  for (const std::string& note : r.notes) text += fmt::format("  note       {}\n", note);
  return text;
}

std::string to_json(const RenderReport& r) {
  using Json = nlohmann::ordered_json;
  Json json;
  json["version"] = r.version;
  json["input"] = r.input;
  json["format"] = r.format;
  json["machine"] = {{"threads", r.threads},
                     {"instruction_set", r.instruction_set},
                     {"peak_memory_bytes", std::llround(r.peak_memory_bytes)},
                     {"surface_bytes", std::llround(r.surface_bytes)}};
  json["seconds"] = {{"read", r.read_seconds},
                     {"build", r.build_seconds},
                     {"render", r.render_seconds},
                     {"write", r.write_seconds},
                     {"total", total_seconds(r)},
                     {"cpu", r.cpu_seconds},
                     {"meshing", r.mesh_seconds},
                     {"grid", r.grid_seconds},
                     {"tree", r.tree_seconds},
                     {"build_cpu", r.build_cpu_seconds},
                     {"render_cpu", r.render_cpu_seconds}};
  json["mesh"] = {{"vertices", r.mesh_vertices}, {"triangles", r.mesh_triangles}, {"grid_cells", r.grid_cells}};
  if (!r.scan.empty()) json["scan"] = r.scan;
  json["particles"] = {{"count", r.particles},
                       {"dropped", r.dropped},
                       {"recovered", r.recovered},
                       {"radius", r.radius},
                       {"radius_source", r.radius_source},
                       {"spacing", r.spacing > 0 ? Json(r.spacing) : Json()},
                       {"threshold", r.threshold},
                       {"influence_radius", r.influence_radius}};
  json["camera"] = {{"from", r.camera_from}, {"to", r.camera_to}, {"fov", r.fov}};
  json["floor_height"] = r.floor_height ? Json(*r.floor_height) : Json();
  json["pinning_flags"] = r.pinning_flags;
  json["picture"] = {
      {"width", r.width},          {"height", r.height},         {"samples_per_pixel", r.samples},    {"seed", r.seed},
      {"samples", r.samples_done}, {"interrupted", r.cancelled}, {"relative_error", r.relative_error}};
  json["rays"] = {{"camera", to_object(r.camera_rays)},
                  {"secondary_outside", to_object(r.outside_rays)},
                  {"secondary_inside", to_object(r.inside_rays)},
                  {"shadow", to_object(r.shadow_rays)}};
  json["scatterings"] = r.scatterings;
  json["bent_directions"] = r.bent_directions;
  json["medium_contradictions"] = r.medium_contradictions;
  json["contradiction_commands"] = r.contradiction_commands;
  json["medium_collisions"] = r.medium_collisions;
  json["majorants_exceeded"] = r.majorants_exceeded;
  json["bad_samples"] = {{"count", r.bad_samples}, {"replay_commands", r.replay_commands}};
  json["notes"] = r.notes;
  return json.dump(2) + "\n";
}

}  // namespace embrun
