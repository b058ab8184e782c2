#include <embrun/embrun.h>

#include <cstdio>
#include <memory>
#include <optional>

#include "commands.h"

namespace embrun {
namespace {

struct InfoArguments {
  std::string file;
  bool json = false;
  std::optional<double> radius;
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
  info->footer(
      "Prints count, attributes with types and ranges, bounds, the rest spacing (from the number density in the bulk)\n"
      "beside the median distance to the nearest neighbour, and the radius that a render would use.\n\n"
      "Example: embrun info dam.bgeo --json");
  info->callback([arguments, &exit_code] {
    const std::string text = describe_file(arguments->file, arguments->json, arguments->radius);
    std::fputs(text.c_str(), stdout);
    exit_code = exit_done;
  });
}

}  // namespace embrun
