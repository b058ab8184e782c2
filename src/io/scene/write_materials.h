#pragma once

#include <string>
#include <vector>

#include "io/scene/xml_writer.h"
#include "scene/scene_description.h"

// The parts of write_scene() that are materials and media.

namespace embrun {

using Pictures = std::vector<PictureDescription>;

/// Nothing for an isotropic one.
void write_phase(Xml& xml, const PhaseFunction& phase);
/// What textures show of pictures needs the scene's list of them. `id`: to be referred to by.
void write_bsdf(Xml& xml, const Pictures& pictures, const MaterialDescription& material, const std::string& id = {});
/// The interior <medium> of a shape, or one to be referred to by `id`; a reference for a medium on a grid.
void write_interior(Xml& xml, const MaterialDescription& material, const std::string& id = {});
/// The id of a medium on a grid.
std::string grid_medium_id(int index);
/// Media on grids, which bodies refer to. Throws Error for what a scene file cannot say.
void write_grid_media(Xml& xml, const SceneDescription& scene);

}  // namespace embrun
