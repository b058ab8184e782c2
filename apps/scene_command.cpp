#include <embrun/embrun.h>
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "commands.h"
#include "parse_values.h"

namespace embrun {
namespace {

struct SceneArguments {
  std::string file;
  std::vector<std::string> definitions;
  bool dump = false;
};

}  // namespace

void add_scene_command(CLI::App& program, int& exit_code) {
  const auto arguments = std::make_shared<SceneArguments>();
  CLI::App* scene = program.add_subcommand("scene", "Check a scene file, and say what was understood of it");
  scene->add_option("FILE", arguments->file, "scene file: Mitsuba 3's XML, see docs/scene-files.md")->required();
  scene->add_option("-D,--define", arguments->definitions, "name=value: what $name stands for; may be repeated")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false);
  scene->add_flag("--dump", arguments->dump, "print it as a scene file, everything spelt out");
  scene->footer(
      "Reads the scene and every file it names. What is not supported is an error that names its line; what has no\n"
      "effect is a warning.\n\n"
      "Example: embrun scene water.xml -D frame=12 --dump > understood.xml");
  scene->callback([arguments, &exit_code] {
    SceneInput input;
    input.file = arguments->file;
    input.parameters = parse_definitions(arguments->definitions);
    std::vector<std::string> warnings;
    const std::string text = describe_scene(input, warnings);
    for (const std::string& warning : warnings) fmt::print(stderr, "embrun: {}\n", warning);
    if (arguments->dump)
      std::fputs(text.c_str(), stdout);
    else
      fmt::print("{}: understood, with {} warnings\n", arguments->file, warnings.size());
    exit_code = exit_done;
  });
}

}  // namespace embrun
