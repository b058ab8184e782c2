#include <embrun/embrun.h>

#include <cstdio>
#include <memory>
#include <optional>

#include "cloud_options.h"
#include "commands.h"
#include "parse_values.h"

namespace embrun {
namespace {

struct InfoArguments {
  std::string file;
  bool json = false;
  std::optional<double> radius;
  CloudOptions cloud;
  std::string sensor;
};

}  // namespace

void add_info_command(CLI::App& program, int& exit_code) {
  const auto arguments = std::make_shared<InfoArguments>();
  CLI::App* info = program.add_subcommand("info", "Say what is in a particle file");
  info->add_option("FILE", arguments->file,
                   "particle file: BGEO, PLY, PCD, LAS, OBJ, legacy VTK, XYZ or CSV, told by its content")
      ->required();
  info->add_flag("--json", arguments->json, "as a JSON object");
  info->add_option("--radius", arguments->radius, "particle radius in metres, in place of the file's");
  add_cloud_options(*info, arguments->cloud, arguments->sensor);
  info->footer(
      "Prints count, attributes with types and ranges, and bounds. Of a fluid, the rest spacing (from the number "
      "density in\n"
      "the bulk) beside the median distance to the nearest neighbour, and the radius that a render would use. Of a "
      "scan,\n"
      "what its splats would be: spacing, noise, normals, radii, what was left out, and whether it is closed.\n\n"
      "Examples:\n"
      "  embrun info dam.bgeo --json\n"
      "  embrun info scan.ply --point-normals estimate --sensor 0,1.6,3");
  info->callback([arguments, &exit_code] {
    InfoArguments& a = *arguments;
    if (!a.sensor.empty()) a.cloud.sensor = parse_numbers<3>("--sensor", a.sensor, "x,y,z");
    const std::string text = describe_file(a.file, a.json, a.radius, a.cloud);
    std::fputs(text.c_str(), stdout);
    exit_code = exit_done;
  });
}

}  // namespace embrun
