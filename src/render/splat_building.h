#pragma once

#include <functional>

#include "io/point_stream.h"
#include "io/write_splat_file.h"
#include "particles/splat_options.h"

// From the points of a file, as many as there may be, to a file of splats with their levels of detail.

namespace embrun {

struct SplatBuildOptions {
  SplatOptions splats;                            ///< what makes_splats_of_streams() allows
  std::uint64_t memory = std::uint64_t{2} << 30;  ///< bytes of points that are sorted at a time
  std::filesystem::path scratch;                  ///< folder of scratch files
  std::size_t brick = std::size_t{1} << 16;       ///< most points of a brick
};

struct SplatBuildReport {
  std::uint64_t points = 0, dropped = 0, duplicates = 0, splats = 0, bricks = 0, runs = 0;
  std::uint64_t blocks = 0, nodes = 0;
  bool estimated_radii = false, has_colors = false, closed = false;
  double least_radius = 0, median_radius = 0, greatest_radius = 0;
  double sort_seconds = 0, build_seconds = 0;
};

/// Told what is done and which share of it.
using BuildProgress = std::function<void(const char* stage, double fraction)>;

/// Reads the stream twice, sorts its points along a curve and writes splats brick after brick. The same bytes whatever
/// the memory and the number of threads. `name` is what messages call the cloud. Normals are those of the file, turned to
/// the sensor if there is one; radii those of the options or the file, else the least that leave no hole, each brick with so
/// much of its neighbours as it takes. Throws Error where there are no normals, or nothing that makes a splat.
SplatBuildReport write_splats_of(PointStream& stream, const SplatBuildOptions& options, const std::string& name,
                                 const ByteSink& sink, const BuildProgress& progress);

}  // namespace embrun
