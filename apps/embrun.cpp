#include <embrun/embrun.h>

#include <cstdio>
#include <exception>

#include "commands.h"
#include "parse_values.h"

namespace embrun {
namespace {

/// The command as it was typed, quoted where a shell would need it.
std::string command_line_of(int argc, char** argv) {
  std::string line = "embrun";
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const bool plain = !argument.empty() && argument.find_first_of(" \t\n\"'\\$&|;<>()*?`") == std::string::npos;
    line += plain ? " " + argument : " '" + argument + "'";
  }
  return line;
}

constexpr const char* footer =
    "Examples:\n"
    "  embrun render dam.bgeo -o dam.png\n"
    "  embrun render scene.xml -o scene.png\n"
    "  embrun mesh dam.bgeo -o dam.ply\n"
    "  embrun splats city.ply -o city.splats\n"
    "  embrun info dam.bgeo\n"
    "  embrun compare dam.exr reference.exr\n"
    "  embrun reproduce dam-break --quick -o out\n"
    "  embrun render --help          every option, with its default\n\n"
    "Exit codes: 0 done, 1 a file or its content is at fault, 2 the command line is,\n"
    "3 pictures that differ by more than the limit given, 130 interrupted.\n"
    "EMBRUN_ISA=baseline|avx2|avx512 pins the instruction set, so that different machines give the same bits.";

int run(int argc, char** argv) {
  CLI::App program{"Physically based pictures of particle fluids, without a mesh"};
  program.name("embrun");
  program.set_version_flag("--version", std::string("embrun ") + version());
  program.require_subcommand(1);
  program.footer(footer);
  int exit_code = exit_done;
  add_render_command(program, command_line_of(argc, argv), exit_code);
  add_info_command(program, exit_code);
  add_mesh_command(program, command_line_of(argc, argv), exit_code);
  add_splats_command(program, exit_code);
  add_scene_command(program, exit_code);
  add_compare_command(program, exit_code);
  add_bench_command(program, exit_code);
  add_reproduce_command(program, command_line_of(argc, argv), exit_code);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? exit_done : exit_usage;
  } catch (const UsageError& error) {
    std::fprintf(stderr, "embrun: %s\n", error.what());
    return exit_usage;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "embrun: %s\n", error.what());
    return exit_bad_input;
  }
  return exit_code;
}

}  // namespace
}  // namespace embrun

int main(int argc, char** argv) { return embrun::run(argc, argv); }
