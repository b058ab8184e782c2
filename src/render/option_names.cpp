#include "render/option_names.h"

#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <utility>

#include "base/error.h"

namespace embrun {
namespace {

/// The value whose name was given.
template <class Value>
Value pick(const char* what, const std::string& name, std::initializer_list<std::pair<const char*, Value>> choices) {
  std::string known;
  for (const auto& [choice, value] : choices) {
    if (name == choice) return value;
    known += (known.empty() ? "" : ", ") + std::string(choice);
  }
  throw Error(std::string(what) + " \"" + name + "\" is unknown: there are " + known);
}

}  // namespace

Kernel kernel_from_name(const std::string& name) {
  return pick<Kernel>("kernel", name,
                      {{"metaball", Kernel::metaball}, {"zhu-bridson", Kernel::zhu_bridson}, {"blinn", Kernel::blinn}});
}

RecoverMode recover_from_name(const std::string& name) {
  return pick<RecoverMode>(
      "recovery", name, {{"smooth", RecoverMode::smooth}, {"thesis", RecoverMode::thesis}, {"off", RecoverMode::off}});
}

NormalMode normal_from_name(const std::string& name) {
  return pick<NormalMode>("normal", name, {{"weighted", NormalMode::weighted}, {"gradient", NormalMode::gradient}});
}

SurfaceMethod method_from_names(const std::string& method, const std::string& representation) {
  const auto direct =
      pick<SurfaceMethod>("method", method, {{"fast", SurfaceMethod::fast}, {"thesis", SurfaceMethod::thesis}});
  if (representation_from_name(representation) == Representation::direct) return direct;
  if (direct != SurfaceMethod::fast) throw Error("method \"" + method + "\" is for particles, not for a mesh of them");
  return SurfaceMethod::mesh;
}

Representation representation_from_name(const std::string& name) {
  return pick<Representation>("representation", name,
                              {{"direct", Representation::direct}, {"mesh", Representation::mesh}});
}

UpAxis up_from_name(const std::string& name) {
  return pick<UpAxis>("up axis", name, {{"y", UpAxis::y}, {"z", UpAxis::z}});
}

PixelFilter filter_from_name(const std::string& name) {
  return pick<PixelFilter>("filter", name,
                           {{"box", PixelFilter{FilterKind::box, 0.5f}},
                            {"tent", PixelFilter{FilterKind::tent, 1.0f}},
                            {"gaussian", PixelFilter{FilterKind::gaussian, 1.5f}},
                            {"blackman-harris", PixelFilter{FilterKind::blackman_harris, 1.5f}}});
}

MediaOverlap overlap_from_name(const std::string& name) {
  return pick<MediaOverlap>("overlap", name,
                            {{"min", MediaOverlap::min}, {"max", MediaOverlap::max}, {"sum", MediaOverlap::sum}});
}

IntegratorKind integrator_from_name(const std::string& name) {
  return pick<IntegratorKind>("integrator", name,
                              {{"path", IntegratorKind::path},
                               {"whitted", IntegratorKind::whitted},
                               {"ao", IntegratorKind::ambient_occlusion},
                               {"gauss", IntegratorKind::gauss}});
}

void set_integrator(IntegratorDescription& integrator, const std::optional<std::string>& name,
                    std::optional<double> occlusion_distance, std::optional<int> gauss_nodes) {
  const IntegratorKind before = integrator.kind;
  if (name) integrator.kind = integrator_from_name(*name);
  if (integrator.kind != before) integrator.straight_shadows = straight_shadows_of(integrator.kind);
  if (occlusion_distance) {
    if (integrator.kind != IntegratorKind::ambient_occlusion)
      throw Error("a distance of ambient occlusion is given, but the integrator is not ao");
    integrator.occlusion_distance = *occlusion_distance;
  }
  if (gauss_nodes) {
    if (integrator.kind != IntegratorKind::gauss)
      throw Error("nodes of Gauss's rule are given, but the integrator is not gauss");
    if (*gauss_nodes < 1) throw Error(std::to_string(*gauss_nodes) + " nodes of Gauss's rule: give 1 or more");
    integrator.gauss_nodes = *gauss_nodes;
  }
}

bool straight_shadows_from_name(const std::string& name, IntegratorKind kind) {
  return pick<bool>("boundary NEE", name, {{"auto", straight_shadows_of(kind)}, {"off", false}, {"straight", true}});
}

FloorKind floor_from_name(const std::string& name) {
  return pick<FloorKind>("floor", name,
                         {{"none", FloorKind::none}, {"plain", FloorKind::plain}, {"checker", FloorKind::checker}});
}

ThresholdChoice threshold_from_text(const std::string& text) {
  if (text == "auto") return {ThresholdMode::automatic, 0};
  if (text == "thesis") return {ThresholdMode::thesis, 0};
  char* end = nullptr;
  const float value = std::strtof(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !(value > 0) || !std::isfinite(value))
    throw Error("threshold \"" + text + "\" is not auto, thesis or a positive number");
  return {ThresholdMode::number, value};
}

NormalChoice normal_choice_from_name(const std::string& name) {
  return pick<NormalChoice>(
      "choice of normals", name,
      {{"auto", NormalChoice::automatic}, {"file", NormalChoice::file}, {"estimate", NormalChoice::estimate}});
}

bool ellipses_from_name(const std::string& name) {
  return pick<bool>("shape of splats", name, {{"disc", false}, {"ellipse", true}});
}

CloudSurface cloud_surface_from_name(const std::string& name) {
  return pick<CloudSurface>("surface of points", name, {{"splats", CloudSurface::splats}, {"mls", CloudSurface::mls}});
}

std::optional<bool> closed_from_name(const std::string& name) {
  return pick<std::optional<bool>>("choice for closed", name, {{"auto", std::nullopt}, {"yes", true}, {"no", false}});
}

std::optional<bool> surface_from_name(const std::string& name) {
  return pick<std::optional<bool>>("kind of points", name,
                                   {{"auto", std::nullopt}, {"surface", true}, {"fluid", false}});
}

}  // namespace embrun
