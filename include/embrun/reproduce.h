#pragma once

// The experiments of the thesis that Embrun builds on, done again.

#include <embrun/embrun.h>

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace embrun {

struct ReproduceOptions {
  std::string folder;                      ///< that everything is written to; made if it is not there
  std::string data = "data";               ///< the sample particles: dam_break, calm_pool, ... by any format's name
  bool quick = false;                      ///< small and noisy, to see that it works; its times say little
  double radius = 0.025;                   ///< R0, metres: that of the solver which made the sample data
  std::optional<std::array<int, 2>> size;  ///< default: the thesis's 768x574; quick: 192x144
  std::optional<int> samples;              ///< per pixel, in two halves; default: the thesis's 128; quick: 8
  std::optional<int> thesis_samples;       ///< of the one row by the thesis's own tracer, a quarter as wide; default: 2
  std::uint32_t seed = 0;
  int threads = 0;      ///< 0: as many as the machine has
  std::string command;  ///< named in the document
};

struct ReproduceHooks {
  /// Before each step: what it is, how many are done and how many there are.
  std::function<void(const std::string& what, int done, int total)> step;
  RenderHooks render;  ///< of the renders; when its `cancel` becomes true, all of it stops soon
};

struct ReproduceReport {
  std::string document;  ///< the file with the tables; empty when it was cancelled
  int rendered = 0;      ///< pictures
  int kept = 0;          ///< pictures that an earlier run with the same options had left
  bool cancelled = false;
};

/// Throws when an option is out of range.
void check_options(const ReproduceOptions& options);

/// Renders the dam break as chapter 5 of the thesis does, directly and as a mesh with a grid, and writes tables, curves and
/// pictures beside the thesis's figures: FOLDER/reproduction.md. What an earlier run with the same options has rendered
/// into the folder is kept. Throws when there is no dam break in the data, or a file cannot be read or written.
ReproduceReport reproduce_dam_break(const ReproduceOptions& options, const ReproduceHooks& hooks = {});

struct ReproduceSplatsOptions {
  std::string folder;  ///< that everything is written to; made if it is not there
  std::string
      data;  ///< folder with the scans: bunny_35947.ply, igea_70658.ply; empty, or without them: the sphere alone
  bool quick = false;   ///< small pictures and short measurements, to see that it works
  int threads = 0;      ///< of the builds and pictures; what is timed runs on one. 0: as many as the machine has
  std::string command;  ///< named in the document
};

/// Measures what finds the splats along a ray as chapter 2 of the thesis does, for its three clouds, and how far Gauss's
/// quadrature and path tracing are off in the box of its section 3.3; writes tables, plots and pictures beside the thesis's
/// figures: FOLDER/splats.md. `rendered` counts clouds. Throws when a file cannot be read
/// or written.
ReproduceReport reproduce_splats(const ReproduceSplatsOptions& options, const ReproduceHooks& hooks = {});

}  // namespace embrun
