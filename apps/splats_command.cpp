#include <embrun/embrun.h>
#include <fmt/format.h>

#include <memory>

#include "cloud_options.h"
#include "commands.h"
#include "parse_values.h"
#include "progress_display.h"

namespace embrun {
namespace {

struct SplatsArguments {
  SplatFileOptions options;
  std::string input, output, report, sensor;
  bool quiet = false;
};

int run_splats(SplatsArguments& a) {
  try {
    if (!a.sensor.empty()) a.options.cloud.sensor = parse_numbers<3>("--sensor", a.sensor, "x,y,z");
    check_splat_file_options(a.options);
  } catch (const UsageError&) {
    throw;
  } catch (const std::runtime_error& error) {
    throw UsageError(error.what());
  }
  if (is_scene_file(a.input)) throw UsageError("splats are made of a file of points, not of a scene");
  check_splat_output(a.output);
  if (!a.report.empty()) check_text_output(a.report);

  ProgressDisplay display(a.quiet);
  RenderHooks hooks;
  hooks.progress = [&](const Progress& progress) { display.show(progress); };
  const SplatFileReport report = splat_file(a.input, a.output, a.options, hooks);
  display.finish();
  if (!a.report.empty()) write_text_file(a.report, to_json(report));
  if (!a.quiet) fmt::print("{}{}\n", to_text(report), a.output);
  return exit_done;
}

constexpr const char* splats_footer =
    "A render of the file maps it and touches no more of it than its rays come by: one splat stands for all those of\n"
    "a part of the cloud that looks smaller than a pixel (--lod of embrun render; --lod 0 meets every splat). So a\n"
    "cloud that is far larger than the picture, or than memory, costs what the picture needs.\n\n"
    "Binary PLY files of more than 4 million points are read in pieces, twice, and need not fit into memory. They\n"
    "must have normals; radii are theirs, or the least that leave no hole; outliers are not looked for. All else is\n"
    "read whole, and its splats are those that embrun render makes.\n\n"
    "Examples:\n"
    "  embrun splats city.ply -o city.splats\n"
    "  embrun splats city.ply -o city.splats --memory 0.5 --scratch fast-disk\n"
    "  embrun render city.splats -o city.png\n\n"
    "Exit codes: 0 done, 1 a file or its content is at fault, 2 the command line is.";

}  // namespace

void add_splats_command(CLI::App& program, int& exit_code) {
  const auto a = std::make_shared<SplatsArguments>();
  CLI::App* splats =
      program.add_subcommand("splats", "Make splats with levels of detail of a point cloud, however large");
  splats->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  splats->add_option("INPUT", a->input, "points of a scan: a file as of embrun render")->required();
  const char* group = "The file";
  splats->add_option("-o,--output", a->output, "file to write: .splats")->required()->group(group);
  add_cloud_options(*splats, a->options.cloud, a->sensor);
  const char* work = "The work";
  splats->add_flag("--stream", a->options.stream, "read the file in pieces whatever its size")->group(work);
  splats->add_option("--memory", a->options.memory, "GiB of points that are sorted at a time")
      ->capture_default_str()
      ->group(work);
  splats->add_option("--scratch", a->options.scratch, "folder of scratch files: 100 bytes a point at most")
      ->default_str("that of the output")
      ->group(work);
  splats->add_option("--threads", a->options.threads, "0: all that the machine has")
      ->capture_default_str()
      ->group(work);
  splats->add_option("--json", a->report, "write a machine-readable report to this file")->group(work);
  splats->add_flag("-q,--quiet", a->quiet, "print errors only")->group(work);
  splats->footer(splats_footer);
  splats->callback([a, &exit_code] { exit_code = run_splats(*a); });
}

}  // namespace embrun
