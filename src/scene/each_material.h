#pragma once

#include <cstddef>

#include "scene/scene_description.h"

namespace embrun {

/// Calls visit(material, what, index) for the materials of all elements, in the order in which scene files are written;
/// `what` names the kind of element ("mesh"), `index` counts from 0. What a material has on its back is not visited.
template <class Scene, class Visit>
void each_material(Scene& scene, const Visit& visit) {
  const auto of_all = [&](auto& elements, const char* what) {
    for (std::size_t i = 0; i < elements.size(); ++i) visit(elements[i].material, what, i);
  };
  of_all(scene.fluids, "fluid");
  of_all(scene.balls, "set of balls");
  of_all(scene.boxes, "box");
  of_all(scene.patches, "patch");
  of_all(scene.cylinders, "cylinder");
  of_all(scene.meshes, "mesh");
  of_all(scene.splats, "splats");
}

}  // namespace embrun
