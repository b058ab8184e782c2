#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace embrun {

/// What the program returns to the shell.
enum ExitCode : int {
  exit_done = 0,
  exit_bad_input = 1,     ///< a file that cannot be read or written, particles that cannot be rendered
  exit_usage = 2,         ///< an option that is unknown, out of range or missing
  exit_over_limit = 3,    ///< pictures further apart than a limit that was given
  exit_interrupted = 130  ///< stopped by Ctrl-C or SIGTERM; what there was has been written
};

// Each adds its command to the program; `command_line` is the whole of it, for the picture's metadata. The exit code of
// the command that was called ends up in `exit_code`.

void add_render_command(CLI::App& program, const std::string& command_line, int& exit_code);
void add_info_command(CLI::App& program, int& exit_code);
void add_mesh_command(CLI::App& program, const std::string& command_line, int& exit_code);
void add_splats_command(CLI::App& program, int& exit_code);
void add_scene_command(CLI::App& program, int& exit_code);
void add_compare_command(CLI::App& program, int& exit_code);
void add_bench_command(CLI::App& program, int& exit_code);
void add_reproduce_command(CLI::App& program, const std::string& command_line, int& exit_code);

}  // namespace embrun
