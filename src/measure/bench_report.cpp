#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>

#include "embrun/bench.h"

namespace embrun {

namespace {

/// The kinds of ray, in the order of BenchReport::embree_ways.
constexpr const char* ray_kinds[] = {"camera", "outside", "inside", "shuffled"};

}  // namespace

std::vector<std::pair<std::string, double>> figures(const BenchReport& r) {
  std::vector<std::pair<std::string, double>> all;
  const auto add_rates = [&](const std::string& name, const BenchRates& rates) {
    all.emplace_back(name + ".direct", rates.direct);
    all.emplace_back(name + ".mesh", rates.mesh);
    all.emplace_back(name + ".ratio", rates.ratio());
  };
  const BenchRates* const rates[] = {&r.camera, &r.outside, &r.inside, &r.shuffled};
  for (std::size_t i = 0; i < std::size(ray_kinds); ++i) add_rates(fmt::format("rays.{}", ray_kinds[i]), *rates[i]);
  all.emplace_back("build.direct_s", r.build_direct);
  all.emplace_back("build.mesh_s", r.build_mesh);
  all.emplace_back("build.ratio", r.build_direct > 0 ? r.build_mesh / r.build_direct : 0);
  all.emplace_back("memory.bytes_per_particle", r.bytes_per_particle);
  all.emplace_back("memory.mesh_bytes_per_particle", r.mesh_bytes_per_particle);
  all.emplace_back("oracle.rays", static_cast<double>(r.oracle_rays));
  all.emplace_back("oracle.wrong", static_cast<double>(r.oracle_wrong));
  add_rates("freeflight.mfp10", r.flights_10);
  add_rates("freeflight.mfp100", r.flights_100);
  return all;
}

std::string to_text(const BenchReport& r) {
  std::string text = fmt::format("  particles  {}, radius {:.6g} m, spacing {:.6g} m; {} triangles of cells of R0/2\n",
                                 r.particles, r.radius, r.spacing, r.triangles);
  text += fmt::format("  machine    one thread, {}; rates are millions a second\n", r.instruction_set);
  for (const auto& [name, value] : figures(r)) text += fmt::format("  {:<32}{:>12.5g}\n", name, value);
  for (std::size_t i = 0; i < r.embree_ways.size(); ++i)
    text += fmt::format("  {:<32}{:>12}\n", fmt::format("rays.{}.embree", ray_kinds[i]), r.embree_ways[i]);
  for (const std::string& note : r.notes) text += fmt::format("  note       {}\n", note);
  return text;
}

std::string to_json(const BenchReport& r) {
  using Json = nlohmann::ordered_json;
  Json json;
  json["version"] = r.version;
  json["input"] = r.input;
  json["instruction_set"] = r.instruction_set;
  json["particles"] = {{"count", r.particles}, {"radius", r.radius}, {"spacing", r.spacing}};
  json["triangles"] = r.triangles;
  for (const auto& [name, value] : figures(r)) {
    Json* place = &json;
    std::string rest = name;
    for (std::size_t dot = rest.find('.'); dot != std::string::npos; dot = rest.find('.')) {
      place = &(*place)[rest.substr(0, dot)];
      rest = rest.substr(dot + 1);
    }
    (*place)[rest] = value;
  }
  json["oracle"] = {{"rays", r.oracle_rays}, {"wrong", r.oracle_wrong}};
  for (std::size_t i = 0; i < r.embree_ways.size(); ++i) json["rays"][ray_kinds[i]]["embree"] = r.embree_ways[i];
  json["notes"] = r.notes;
  return json.dump(2) + "\n";
}

}  // namespace embrun
