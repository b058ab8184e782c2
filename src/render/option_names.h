#pragma once

#include <optional>
#include <string>

#include "camera/framing.h"
#include "embrun/embrun.h"
#include "geometry/surface_settings.h"
#include "math/up_axis.h"
#include "particles/splat_cloud.h"
#include "scene/scene_description.h"

namespace embrun {

// The names of RenderOptions as what they mean. Each throws Error for an unknown one, and lists the known.

Kernel kernel_from_name(const std::string& name);
RecoverMode recover_from_name(const std::string& name);
NormalMode normal_from_name(const std::string& name);
/// By RenderOptions::method and representation.
SurfaceMethod method_from_names(const std::string& method, const std::string& representation);
enum class Representation { direct, mesh };
Representation representation_from_name(const std::string& name);
UpAxis up_from_name(const std::string& name);
PixelFilter filter_from_name(const std::string& name);

MediaOverlap overlap_from_name(const std::string& name);

enum class FloorKind { none, plain, checker };
IntegratorKind integrator_from_name(const std::string& name);
/// Sets what is given, and with another kind how its shadow rays go. A distance is for ambient occlusion alone, nodes
/// are for gauss alone.
void set_integrator(IntegratorDescription& integrator, const std::optional<std::string>& name,
                    std::optional<double> occlusion_distance, std::optional<int> gauss_nodes);
bool straight_shadows_from_name(const std::string& name, IntegratorKind kind);  ///< off, straight, auto: the kind's
FloorKind floor_from_name(const std::string& name);
NormalChoice normal_choice_from_name(const std::string& name);
bool ellipses_from_name(const std::string& name);                ///< disc, ellipse
CloudSurface cloud_surface_from_name(const std::string& name);   ///< splats, mls
std::optional<bool> closed_from_name(const std::string& name);   ///< auto, yes, no
std::optional<bool> surface_from_name(const std::string& name);  ///< auto, surface, fluid

/// "auto", "thesis" or a positive number.
struct ThresholdChoice {
  ThresholdMode mode = ThresholdMode::automatic;
  float value = 0;
};
ThresholdChoice threshold_from_text(const std::string& text);

}  // namespace embrun
