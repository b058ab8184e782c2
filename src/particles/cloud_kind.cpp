#include "particles/cloud_kind.h"

#include <span>
#include <string_view>

#include "particles/point_tree.h"

namespace embrun {

namespace {

/// The first of the names that is an attribute, or null.
const char* first_present(const ParticleSet& particles, std::span<const char* const> names) {
  for (const char* name : names) {
    if (particles.find(name)) return name;
  }
  return nullptr;
}

}  // namespace

CloudVerdict tell_surface(const ParticleSet& particles) {
  constexpr const char* of_solvers[] = {"velocity", "density", "mass", "pressure", "id"};
  constexpr const char* of_scanners[] = {"intensity", "confidence", "return_number"};
  constexpr const char* of_surfaces[] = {"normal", "color"};
  CloudVerdict verdict;
  const auto has = [](const char* name) { return std::string("the file has the attribute ") + name; };
  if (const char* name = first_present(particles, of_solvers)) {
    verdict.reason = has(name);
    return verdict;
  }
  if (const char* name = first_present(particles, of_scanners)) {
    verdict.is_surface = true;
    verdict.reason = has(name);
    return verdict;
  }
  verdict.has_shape = true;
  verdict.shape = measure_cloud(PointTree(particles.positions), particles.positions);
  if (const char* name = first_present(particles, of_surfaces)) {
    verdict.is_surface = verdict.shape.variation < CloudVerdict::of_volumes;
    verdict.reason = verdict.is_surface ? has(name) : std::string("the points fill space");
  } else if (particles.size() < CloudShape::least_points) {
    verdict.reason = "there are too few points to tell a surface";
  } else {
    verdict.is_surface = verdict.shape.is_surface;
    verdict.reason =
        verdict.is_surface ? "most points' neighbours lie in a plane" : "most points' neighbours lie in no plane";
  }
  return verdict;
}

}  // namespace embrun
