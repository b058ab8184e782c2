#pragma once

#include <CLI/CLI.hpp>

namespace embrun {

/// The options that say how particles become a surface, in a group of --help; `Options` is RenderOptions or MeshOptions.
template <class Options>
void add_surface_options(CLI::App& c, Options& o, const char* group) {
  c.add_option("--radius", o.radius, "particle radius in metres")
      ->default_str("the file's, else half the rest spacing")
      ->group(group);
  c.add_option("--order", o.order,
               "neighbourhood order n: a particle is felt to 2 n radii. Higher is smoother, and slower")
      ->capture_default_str()
      ->group(group);
  c.add_option("--kernel", o.kernel, "metaball, zhu-bridson, blinn")->capture_default_str()->group(group);
  c.add_option("--threshold", o.threshold,
               "of the field at the surface: auto (half the field inside), thesis (2n-1), or a number")
      ->capture_default_str()
      ->group(group);
  c.add_option(
       "--recover", o.recover,
       "lone particles that the field loses come back as balls: smooth (no popping), thesis (by a hard rule), off")
      ->capture_default_str()
      ->group(group);
  c.add_option("--normal", o.normal, "weighted (smoother), gradient (of the field)")
      ->capture_default_str()
      ->group(group);
}

}  // namespace embrun
