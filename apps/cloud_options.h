#pragma once

#include <embrun/cloud_options.h>
#include <embrun/embrun.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>

namespace embrun {

inline constexpr const char* cloud_options_group = "Scans: points of surfaces";

/// The options that say how the points of a scan become splats, in a group of --help. `sensor` receives a text for
/// parse_numbers().
inline void add_cloud_options(CLI::App& c, CloudOptions& o, std::string& sensor) {
  const char* group = cloud_options_group;
  c.add_option("--points", o.points,
               "what the points are: auto (told by their attributes and neighbourhoods), surface (a scan), fluid")
      ->capture_default_str()
      ->group(group);
  c.add_option("--point-normals", o.normals, "auto (the file's, else estimated), file, estimate")
      ->capture_default_str()
      ->group(group);
  c.add_option("--neighbours", o.neighbours, "3 to 256: how many nearest points a normal is estimated from")
      ->default_str("16, more where there is noise")
      ->group(group);
  c.add_option("--sensor", sensor, "x,y,z where the scanner stood: normals are turned to it")
      ->default_str("the file's, else outwards")
      ->group(group);
  c.add_option("--splat-radius", o.splat_radius, "metres, of all splats")
      ->default_str("the file's, else the least that leave no hole")
      ->group(group);
  c.add_option("--splat-scale", o.splat_scale, "factor to the radii otherwise")->capture_default_str()->group(group);
  c.add_option("--splat-shape", o.splat_shape, "disc, ellipse (less overlap where points are denser one way)")
      ->capture_default_str()
      ->group(group);
  c.add_option("--closed", o.closed, "whether the cloud bounds a body: auto (looked at from all around), yes, no")
      ->capture_default_str()
      ->group(group);
  c.add_option("--outlier-ratio", o.outlier_ratio,
               "points are left out that are so many times as far from their neighbours as those are; 0: none are")
      ->capture_default_str()
      ->group(group);
  c.add_flag("--keep-duplicates", o.keep_duplicates, "keep all points that are in one place")->group(group);
  c.add_option("--thin", o.thin, "metres: keep one point in each cube of this edge")->default_str("all")->group(group);
}

/// What surface is rendered of them.
inline void add_cloud_surface_options(CLI::App& c, RenderOptions& o) {
  c.add_option("--point-surface", o.point_surface,
               "splats (the points as discs), mls (a smooth moving least squares surface, which evens out noise)")
      ->capture_default_str()
      ->group(cloud_options_group);
  c.add_option("--mls-support", o.mls_support,
               "1 to 16: how far a point is felt by mls, in splat radii; more is smoother")
      ->default_str(fmt::format("{}", default_mls_support))
      ->group(cloud_options_group);
}

}  // namespace embrun
