#include <embrun/embrun.h>
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "commands.h"
#include "parse_values.h"
#include "progress_display.h"
#include "surface_options.h"

namespace embrun {
namespace {

struct MeshArguments {
  MeshOptions options;
  std::string input, output, report;
  bool quiet = false;
};

int run_mesh(MeshArguments& a, const std::string& command_line) {
  try {
    check_mesh_options(a.options);
  } catch (const std::runtime_error& error) {
    throw UsageError(error.what());
  }
  if (is_scene_file(a.input)) throw UsageError("a mesh is made of a particle file, not of a scene");
  check_mesh_output(a.output);
  if (!a.options.density_file.empty()) check_density_output(a.options.density_file);
  if (a.options.density_file.empty() && (a.options.density_radius || a.options.density_cell))
    throw UsageError(std::string(a.options.density_cell ? "--density-cell" : "--density-radius") +
                     ": it is of what --density writes");
  if (!a.report.empty()) check_text_output(a.report);
  a.options.command = command_line;

  ProgressDisplay display(a.quiet);
  RenderHooks hooks;
  hooks.progress = [&](const Progress& progress) { display.show(progress); };
  const MeshReport report = mesh_file(a.input, a.output, a.options, hooks);
  display.finish();
  if (!a.report.empty()) write_text_file(a.report, to_json(report));
  if (!a.quiet) fmt::print("{}{}\n", to_text(report), a.output);
  return exit_done;
}

constexpr const char* mesh_footer =
    "The mesh is the surface that a render with the same options shows: closed, welded, its vertices on the surface\n"
    "and with the surface's own normals, in the coordinates of the particles. It is marching cubes' of a sparse grid;\n"
    "half the cells' side gives four times the triangles. An OBJ file is text, a PLY file binary.\n\n"
    "Examples:\n"
    "  embrun mesh dam.bgeo -o dam.ply\n"
    "  embrun mesh dam.bgeo -o fine.ply --cell 0.005 --order 2 --json report.json\n"
    "  embrun mesh dam.bgeo -o dam.ply --density dam.vdb\n\n"
    "Exit codes: 0 done, 1 a file or its content is at fault, 2 the command line is.";

}  // namespace

void add_mesh_command(CLI::App& program, const std::string& command_line, int& exit_code) {
  const auto a = std::make_shared<MeshArguments>();
  CLI::App* mesh = program.add_subcommand("mesh", "Write the surface of a particle file as a triangle mesh");
  mesh->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  mesh->add_option("INPUT", a->input, "particle file: BGEO, PLY, legacy VTK, XYZ or CSV, told by its content")
      ->required();
  const char* group = "The mesh";
  mesh->add_option("-o,--output", a->output, "mesh to write: .ply or .obj")->required()->group(group);
  mesh->add_option("--cell", a->options.cell, "metres: side of the cells that the mesh is made from")
      ->default_str("half the particle radius")
      ->group(group);
  mesh->add_option(
          "--density", a->options.density_file,
          "also write the density of the particles, relative to rest density, on a grid: an OpenVDB file, .vdb")
      ->group(group);
  mesh->add_option("--density-cell", a->options.density_cell, "metres: of that grid")
      ->default_str("half the particle radius")
      ->group(group);
  mesh->add_option("--density-radius", a->options.density_radius,
                   "metres: of the balls that make that; 1.6 particle radii leave no gaps")
      ->default_str("the particles' radius")
      ->group(group);
  add_surface_options(*mesh, a->options, "The surface");
  mesh->add_option("--kinds", a->options.kinds, "ATTRIBUTE:VALUE=KIND,...: leaves out what is no water (see render)")
      ->group("The surface");
  mesh->add_option("--threads", a->options.threads, "0: all that the machine has")
      ->capture_default_str()
      ->group("The work");
  mesh->add_option("--json", a->report, "write a machine-readable report to this file")->group("The work");
  mesh->add_flag("-q,--quiet", a->quiet, "print errors only")->group("The work");
  mesh->footer(mesh_footer);
  mesh->callback([a, command_line, &exit_code] { exit_code = run_mesh(*a, command_line); });
}

}  // namespace embrun
