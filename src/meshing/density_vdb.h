#pragma once

#include <string>

#include "meshing/density_grid.h"

namespace embrun {

/// Whether this build has OpenVDB.
bool can_write_vdb();
/// Throws Error that says how to get it when it has not.
void require_vdb();

/// The bytes of an OpenVDB file that holds a grid of one channel as a FloatGrid named "density", of class fog volume:
/// values are those of cells, whose side is the grid's voxel size. What is 0 takes no room. `origin` is what the grid's
/// coordinates are relative to; `comment` goes into the metadata. Throws Error without OpenVDB.
std::string encode_vdb(const DensityGrid& grid, Vec3d origin, const std::string& comment);

}  // namespace embrun
