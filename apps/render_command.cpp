#include <embrun/embrun.h>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <limits>
#include <memory>

#include "cloud_options.h"
#include "commands.h"
#include "interruption.h"
#include "parse_values.h"
#include "progress_display.h"
#include "surface_options.h"

namespace embrun {
namespace {

/// The command line as text; what is empty was not given.
struct RenderArguments {
  RenderOptions options;
  std::string input, output, report;
  std::string size, crop, sun, refractions = "all", camera_from, camera_to, absorption, container, scene_output, clamp;
  std::vector<std::string> definitions;
  std::string extinction, albedo, foam_extinction, sand_color;
  std::vector<std::string> fluids;
  std::string sensor;
  bool quiet = false;
};

// ---- options -----------------------------------------------------------------------------------------------------

void add_picture_options(CLI::App& c, RenderArguments& a) {
  RenderOptions& o = a.options;
  const char* group = "The picture";
  c.add_option("-o,--output", a.output, "picture to write: .png, .exr, .pfm or .hdr")->group(group);
  c.add_option("--size", a.size, "WxH in pixels")->default_str("1280x720")->group(group);
  c.add_option("--crop", a.crop, "x,y,w,h: render this part of the picture only (from the top left corner)")
      ->group(group);
  c.add_option("--spp", o.samples, "samples per pixel: four times as many halve the noise")
      ->capture_default_str()
      ->group(group);
  c.add_option("--seed", o.seed, "another one gives another noise; the same one the same bits")
      ->capture_default_str()
      ->group(group);
  c.add_option(
       "--layer", o.layer,
       "what a format with one layer gets: beauty, albedo, normal, depth (metres along the camera ray, infinite where "
       "nothing is), samples, variance. EXR gets all")
      ->capture_default_str()
      ->group(group);
  c.add_option("--exposure", o.exposure, "of PNG, in stops: 1 doubles")->capture_default_str()->group(group);
  c.add_option("--tone", o.tone, "tone curve of PNG: filmic (rolls off up to radiance 10), srgb (clips at 1)")
      ->capture_default_str()
      ->group(group);
  c.add_option("--filter", o.filter, "of a pixel: box, tent, gaussian, blackman-harris")
      ->capture_default_str()
      ->group(group);
  c.add_flag("--denoise", o.denoise, "filter the noise, guided by albedo, normal, depth and variance")->group(group);
}

void add_camera_options(CLI::App& c, RenderArguments& a) {
  RenderOptions& o = a.options;
  const char* group = "The camera";
  c.add_option("--view", o.view, "framed on the particles: front, side, top, three-quarter")
      ->capture_default_str()
      ->group(group);
  c.add_option("--camera-from", a.camera_from, "x,y,z: where the camera is, in place of a view")->group(group);
  c.add_option("--camera-to", a.camera_to, "x,y,z: what it looks at (default: the middle of the particles)")
      ->group(group);
  c.add_option("--fov", o.fov, "vertical field of view in degrees")->default_str("35")->group(group);
  c.add_option("--up", o.up, "the axis that points up: y, z")->capture_default_str()->group(group);
}

void add_surface_options(CLI::App& c, RenderArguments& a) {
  RenderOptions& o = a.options;
  const char* group = "The surface";
  add_surface_options(c, o, group);
  c.add_option("--method", o.method, "fast, thesis (the original tracer, a baseline: hundreds of times slower)")
      ->capture_default_str()
      ->group(group);
  c.add_option("--representation", o.representation,
               "direct: rays meet the particles themselves; mesh: a triangle mesh of the same surface, for comparison")
      ->capture_default_str()
      ->group(group);
  c.add_option("--mesh-cell", o.mesh_cell, "metres: cells that the mesh is made from")
      ->default_str("half the particle radius")
      ->group(group);
  c.add_option("--density-cell", o.density_cell, "metres: cells of the grid that holds what is inside the mesh")
      ->default_str("half the particle radius")
      ->group(group);
}

void add_scene_options(CLI::App& c, RenderArguments& a) {
  RenderOptions& o = a.options;
  const char* group = "Water and surroundings";
  c.add_option("--ior", o.ior, "refractive index of the fluid")->capture_default_str()->group(group);
  c.add_option("--absorption", a.absorption, "r,g,b per metre")->default_str("clear water")->group(group);
  c.add_option("--env", o.environment,
               "light all round: sky, studio, white (radiance 1), or a lat-long EXR or HDR file")
      ->capture_default_str()
      ->group(group);
  c.add_option(
       "--sun", a.sun,
       "diameter in degrees of the sky's sun, or off. Below 5 it is a sharp disk (the real one's is 0.53), which "
       "is met under water by chance alone: much noise there")
      ->default_str("26, a soft glow")
      ->group(group);
  c.add_option("--floor", o.floor, "none, plain, checker")->capture_default_str()->group(group);
  c.add_option("--floor-height", o.floor_height, "in metres along the up axis")
      ->default_str("cuts through the lowest layer of particles")
      ->group(group);
  c.add_option(
       "--container", a.container,
       "x0,y0,z0,x1,y1,z1: the box that holds the fluid, which ends flat at its faces and touches them without a gap")
      ->group(group);
  c.add_option("--mesh", o.meshes, "PLY or OBJ file to show as a grey object; may be repeated")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false)
      ->group(group);
}

/// An option that may be repeated.
void add_files(CLI::App& c, const char* name, std::vector<std::string>& files, const char* meaning, const char* group) {
  c.add_option(name, files, meaning)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false)
      ->group(group);
}

void add_inside_options(CLI::App& c, RenderArguments& a) {
  RenderOptions& o = a.options;
  const char* group = "Inside the fluid";
  c.add_option("--extinction", a.extinction,
               "r,g,b (or one number, or inf: opaque) per metre: the fluid's particles scatter and absorb light")
      ->default_str("none: clear")
      ->group(group);
  c.add_option("--albedo", a.albedo, "r,g,b (or one number): how much of that is scattering")
      ->default_str("1,1,1")
      ->group(group);
  c.add_option("--phase-g", o.phase_g, "mean cosine of scattering, -1 to 1: 0 is even, above 0 goes on forwards")
      ->capture_default_str()
      ->group(group);
  c.add_option("--density-radius", o.density_radius,
               "metres: of the balls that fill the fluid with it; 1.6 particle radii leave no gaps")
      ->default_str("the particles' radius")
      ->group(group);
  c.add_option("--color-by", o.color_by,
               "attribute that colours the fluid (albedo); vectors count by their length. The range is printed")
      ->group(group);
  c.add_option("--color-map", o.color_map, "spectrum, heat, grey")->capture_default_str()->group(group);
  c.add_option("--overlap", o.overlap, "where particles of several fluids overlap: min, max, sum")
      ->capture_default_str()
      ->group(group);
}

void add_kind_options(CLI::App& c, RenderArguments& a) {
  RenderOptions& o = a.options;
  const char* group = "Other fluids and particles";
  add_files(c, "--fluid", a.fluids,
            "FILE[:key=value...]: another fluid, which wins over those before it; keys: ior, absorption, extinction, "
            "albedo, g. May be repeated, as all below that name a file",
            group);
  add_files(c, "--foam", o.foam, "FILE of foam: scatters light, without a surface", group);
  add_files(c, "--bubbles", o.bubbles, "FILE of air bubbles", group);
  add_files(c, "--spray", o.spray, "FILE of drops on their own", group);
  add_files(c, "--sand", o.sand, "FILE of opaque grains", group);
  c.add_option(
       "--kinds", o.kinds,
       "ATTRIBUTE:VALUE=KIND,...: kinds in the input itself, such as type:0=foam,1=spray,2=bubble; kinds: water "
       "(all other values), foam, spray, bubble, sand, none")
      ->group(group);
  c.add_option("--foam-radius", o.foam_radius, "metres, where the file has none")
      ->default_str("1/2 of the water's")
      ->group(group);
  c.add_option("--bubble-radius", o.bubble_radius, "metres")->default_str("1/4 of the water's")->group(group);
  c.add_option("--spray-radius", o.spray_radius, "metres")->default_str("1/4 of the water's")->group(group);
  c.add_option("--sand-radius", o.sand_radius, "metres")->default_str("the water's")->group(group);
  c.add_option("--foam-extinction", a.foam_extinction,
               "r,g,b (or one number, or inf: opaque) per metre, where foam lies as close as its diameters")
      ->default_str("1 / diameter")
      ->group(group);
  c.add_option("--sand-color", a.sand_color, "r,g,b (or one number): reflectance")->default_str("brown")->group(group);
  c.add_option("--tank", o.tank, "metres: thickness of a glass tank, open at the top, round the container")
      ->group(group);
  c.add_option("--tank-ior", o.tank_ior, "refractive index of its glass")->capture_default_str()->group(group);
}

void add_work_options(CLI::App& c, RenderArguments& a) {
  RenderOptions& o = a.options;
  const char* group = "The work";
  c.add_option("--threads", o.threads, "0: all that the machine has")->capture_default_str()->group(group);
  c.add_option(
       "--integrator", o.integrator,
       "how light is followed: path (all of it), whitted (direct light from every light, mirror reflection and "
       "refraction; nothing is lit by way of another matt surface), ao (ambient occlusion of what is seen, water and "
       "glass too: white where nothing is near, dark in corners; no lights, no colours, no media), gauss (as path, but "
       "the directions in which paths leave the first matt surface are the nodes of Gauss's quadrature, one for each "
       "sample of a pixel, the same in all pixels: bands in place of noise, for comparison; what is glossy, media and "
       "all later reflections are as with path)")
      ->capture_default_str()
      ->group(group);
  c.add_option("--ao-distance", o.occlusion_distance, "metres: of ao, what is farther away occludes nothing")
      ->default_str("no limit")
      ->group(group);
  c.add_option("--gauss-nodes", o.gauss_nodes,
               "of gauss: nodes of its rule, which the samples of a pixel take in turn: heights times 1 to 8 azimuths "
               "for each")
      ->default_str("--spp")
      ->group(group);
  c.add_option("--max-depth", o.max_depth, "most reflections and refractions of a path")
      ->capture_default_str()
      ->group(group);
  c.add_option(
       "--refractions", a.refractions,
       "1, 2, ... or all: after the last one allowed a ray goes straight on through every surface. For comparisons "
       "with renderers that stop there; it looks wrong")
      ->capture_default_str()
      ->group(group);
  c.add_option(
       "--boundary-nee", o.boundary_nee,
       "how shadow rays meet the surface of water and glass: off (they end there; small lights reach the inside by "
       "chance alone), straight (straight on through it: quiet, but biased, as if it did not bend light), or auto "
       "(straight with --integrator whitted, else off)")
      ->capture_default_str()
      ->group(group);
  c.add_option(
       "--clamp", a.clamp,
       "most radiance, per channel, that light found after the first scattering brings to a sample, or off: fewer "
       "bright specks, but biased: too dark")
      ->default_str("off")
      ->group(group);
  c.add_option("--first-sample", o.first_sample, "index of the first sample: with --crop and --spp 1, replays one path")
      ->capture_default_str()
      ->group(group);
  c.add_option("-D,--define", a.definitions, "name=value: what $name stands for in a scene file; may be repeated")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false)
      ->group(group);
  c.add_option("--write-scene", a.scene_output,
               "write a scene file that says what these options say, to this file, and render nothing")
      ->group(group);
  c.add_option("--json", a.report, "write a machine-readable report to this file")->group(group);
  c.add_flag("-q,--quiet", a.quiet, "print errors only")->group(group);
}

/// Reads the options that are text. Throws UsageError.
void parse_text(RenderArguments& a) {
  RenderOptions& o = a.options;
  if (!a.size.empty()) {
    const auto size = parse_size("--size", a.size);
    o.width = size[0];
    o.height = size[1];
  }
  if (!a.crop.empty()) {
    const auto crop = parse_numbers<4>("--crop", a.crop, "x,y,w,h");
    o.crop.emplace();
    for (std::size_t i = 0; i < 4; ++i) (*o.crop)[i] = as_integer("--crop", crop[i]);
  }
  if (!a.sun.empty()) o.sun = a.sun == "off" ? 0 : parse_numbers<1>("--sun", a.sun, "degrees, or off")[0];
  o.refractions = parse_refractions("--refractions", a.refractions);
  if (!a.camera_from.empty()) o.camera_from = parse_numbers<3>("--camera-from", a.camera_from, "x,y,z");
  if (!a.camera_to.empty()) o.camera_to = parse_numbers<3>("--camera-to", a.camera_to, "x,y,z");
  if (!a.sensor.empty()) o.cloud.sensor = parse_numbers<3>("--sensor", a.sensor, "x,y,z");
  if (!a.container.empty()) o.container = parse_numbers<6>("--container", a.container, "x0,y0,z0,x1,y1,z1");
  if (!a.absorption.empty()) o.absorption = parse_color("--absorption", a.absorption);
  if (!a.clamp.empty() && a.clamp != "off") o.clamp = parse_numbers<1>("--clamp", a.clamp, "a radiance, or off")[0];
  if (!a.extinction.empty()) o.extinction = parse_extinction("--extinction", a.extinction);
  if (!a.albedo.empty()) o.albedo = parse_color("--albedo", a.albedo);
  if (!a.foam_extinction.empty()) o.foam_extinction = parse_extinction("--foam-extinction", a.foam_extinction);
  if (!a.sand_color.empty()) o.sand_color = parse_color("--sand-color", a.sand_color);
  for (const std::string& text : a.fluids) o.fluids.push_back(parse_fluid("--fluid", text));
  try {
    check_options(o);
  } catch (const std::runtime_error& error) {
    throw UsageError(error.what());
  }
}

// ---- scene files -------------------------------------------------------------------------------------------------

/// What may be said of a scene file on the command line; the rest it says itself.
constexpr const char* scene_options[] = {"--output",         "--size",         "--crop",         "--spp",
                                         "--seed",           "--layer",        "--exposure",     "--tone",
                                         "--filter",         "--denoise",      "--threads",      "--max-depth",
                                         "--refractions",    "--first-sample", "--define",       "--boundary-nee",
                                         "--clamp",          "--write-scene",  "--json",         "--quiet",
                                         "--representation", "--mesh-cell",    "--density-cell", "--integrator",
                                         "--ao-distance",    "--gauss-nodes",  "--lod"};

/// The scene file and the options that were given with it. Throws UsageError for those that a scene says itself.
SceneInput scene_input(const CLI::App& command, const RenderArguments& a) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_lnames().empty()) continue;
    const std::string name = "--" + option->get_lnames().front();
    const auto same = [&](const char* known) { return name == known; };
    if (std::none_of(std::begin(scene_options), std::end(scene_options), same))
      throw UsageError(name + ": a scene file says that itself");
  }
  const auto given = [&](const char* option) { return command.count(option) > 0; };
  const RenderOptions& o = a.options;
  SceneInput scene;
  scene.file = a.input;
  scene.parameters = parse_definitions(a.definitions);
  if (given("--size")) scene.size = {o.width, o.height};
  scene.crop = o.crop;
  if (given("--spp")) scene.samples = o.samples;
  if (given("--max-depth")) scene.max_depth = o.max_depth;
  if (given("--refractions")) scene.refractions = o.refractions;
  if (given("--integrator")) scene.integrator = o.integrator;
  scene.occlusion_distance = o.occlusion_distance;
  scene.gauss_nodes = o.gauss_nodes;
  if (given("--boundary-nee")) scene.boundary_nee = o.boundary_nee;
  if (given("--clamp")) scene.clamp = o.clamp.value_or(std::numeric_limits<double>::infinity());
  if (given("--seed")) scene.seed = o.seed;
  if (given("--filter")) scene.filter = o.filter;
  scene.lod = o.lod;
  if (given("--representation")) scene.representation = o.representation;
  scene.mesh_cell = o.mesh_cell;
  scene.density_cell = o.density_cell;
  return scene;
}

/// Writes the scene instead of a picture.
int write_scene_file(const CLI::App& command, const RenderArguments& a) {
  check_text_output(a.scene_output);
  std::vector<std::string> warnings;
  const std::string text = is_scene_file(a.input) ? describe_scene(scene_input(command, a), warnings)
                                                  : describe_scene(a.input, a.options, warnings);
  write_text_file(a.scene_output, text);
  for (const std::string& warning : warnings) fmt::print(stderr, "embrun: {}\n", warning);
  return exit_done;
}

// ---- rendering ---------------------------------------------------------------------------------------------------

int run_render(const CLI::App& command, RenderArguments& a, const std::string& command_line) {
  const bool is_scene = is_scene_file(a.input);
  // Until the scene says how large its picture is, any crop may lie in it.
  if (is_scene && a.size.empty()) a.size = "65536x65536";
  // And until it says how light is followed, what belongs to an integrator may be given.
  if (is_scene && command.count("--integrator") == 0) {
    if (a.options.occlusion_distance) a.options.integrator = "ao";
    if (a.options.gauss_nodes) a.options.integrator = "gauss";
  }
  parse_text(a);
  if (!is_scene && a.options.mesh_cell && a.options.representation != "mesh")
    throw UsageError("--mesh-cell: only a mesh has cells; add --representation mesh");
  if (!is_scene && a.options.density_cell && a.options.representation != "mesh")
    throw UsageError("--density-cell: only what is inside a mesh is on a grid; add --representation mesh");
  if (!is_scene && !a.definitions.empty()) throw UsageError("--define: only a scene file has parameters");
  if (!a.scene_output.empty()) return write_scene_file(command, a);
  if (a.output.empty()) throw UsageError("--output is required");
  check_output(a.output, a.options);
  if (!a.report.empty()) check_text_output(a.report);
  a.options.command = command_line;

  ProgressDisplay display(a.quiet);
  RenderHooks hooks;
  hooks.progress = [&](const Progress& progress) { display.show(progress); };
  hooks.cancel = &catch_interrupts();
  const RenderReport report = is_scene ? render_file(scene_input(command, a), a.output, a.options, hooks)
                                       : render_file(a.input, a.output, a.options, hooks);
  display.finish();

  if (!a.report.empty()) write_text_file(a.report, to_json(report));
  if (!a.quiet) {
    std::fputs(to_text(report).c_str(), stdout);
    if (!report.pinning_flags.empty()) fmt::print("  pin with   {}\n", report.pinning_flags);
  }
  if (report.majorants_exceeded > 0)
    fmt::print(stderr, "embrun: {} extinctions were above their bound: the picture is wrong; please report it\n",
               report.majorants_exceeded);
  if (report.cancelled) {
    if (report.samples_done > 0)
      fmt::print(stderr, "embrun: interrupted: {} holds what there is, {:.1f} of {} samples per pixel\n", a.output,
                 static_cast<double>(report.samples_done) / (static_cast<double>(report.width) * report.height),
                 report.planned_samples);
    else
      fmt::print(stderr, "embrun: interrupted before the first sample: nothing was written\n");
    return exit_interrupted;
  }
  if (!a.quiet) fmt::print("{}\n", a.output);
  return exit_done;
}

constexpr const char* render_footer =
    "Without options the camera is framed on the particles, which are water on a floor under a sky; the points of a "
    "scan\n"
    "are a diffuse surface, in their own colours where the file has any, that stands on the floor.\n"
    "The report names the flags that pin what was chosen, for the other frames of a sequence.\n\n"
    "Examples:\n"
    "  embrun render dam.bgeo -o dam.png --spp 256\n"
    "  embrun render dam.bgeo -o dam.exr --size 1920x1080 --view side --env studio --floor checker\n"
    "  embrun render pool.bgeo -o pool.png --container -2.25,-0.05,-1.5,2.25,5.95,1.5\n"
    "  embrun render dam.bgeo -o depth.pfm --layer depth --spp 4\n"
    "  embrun render scene.xml -o scene.png -D frame=12 --spp 256\n"
    "  embrun render dam.bgeo -o foam.png --foam foam.bgeo --bubbles bubbles.bgeo --spray spray.bgeo\n"
    "  embrun render dam.bgeo -o milk.png --extinction 20 --albedo 0.99\n"
    "  embrun render red.bgeo -o two.png --absorption 0.1,4,4 --fluid blue.bgeo:absorption=4,2,0.1\n"
    "  embrun render scan.ply -o scan.png\n"
    "  embrun render city.splats -o city.png --up z\n"
    "  embrun render dam.bgeo -o clean.png --spp 16 --denoise --json report.json\n\n"
    "Exit codes: 0 done, 1 a file or its content is at fault, 2 the command line is,\n"
    "130 interrupted (Ctrl-C); the picture then holds the samples there were.";

}  // namespace

void add_render_command(CLI::App& program, const std::string& command_line, int& exit_code) {
  const auto arguments = std::make_shared<RenderArguments>();
  CLI::App* render = program.add_subcommand("render", "Render a particle file or a scene");
  // A command may be repeated with other options after its own: to replay a sample, to change one thing.
  render->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  render
      ->add_option("INPUT", arguments->input,
                   "particle file: BGEO, PLY, PCD, LAS, OBJ, legacy VTK, XYZ or CSV, or a file of splats, told by its "
                   "content; or a scene file, *.xml")
      ->required();
  add_picture_options(*render, *arguments);
  add_camera_options(*render, *arguments);
  add_surface_options(*render, *arguments);
  add_cloud_options(*render, arguments->options.cloud, arguments->sensor);
  add_cloud_surface_options(*render, arguments->options);
  render
      ->add_option(
          "--lod", arguments->options.lod,
          "level of detail, pixels: one splat stands for all those of a part of a cloud that looks smaller; of a\n"
          "fluid of which twice the spacing of the particles looks smaller, a coarse surface is rendered. 0: off")
      ->default_str("1 for files of splats, else off");
  add_scene_options(*render, *arguments);
  add_inside_options(*render, *arguments);
  add_kind_options(*render, *arguments);
  add_work_options(*render, *arguments);
  render->footer(render_footer);
  render->callback(
      [render, arguments, command_line, &exit_code] { exit_code = run_render(*render, *arguments, command_line); });
}

}  // namespace embrun
