#include <embrun/reproduce.h>
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "commands.h"
#include "interruption.h"
#include "parse_values.h"
#include "progress_display.h"

namespace embrun {
namespace {

struct ReproduceArguments {
  ReproduceOptions options;
  std::string what, size;
  bool quiet = false;
};

/// The sample data: those of the installed program, or of the source tree that it was built in, or of this folder.
std::string find_data() {
  namespace fs = std::filesystem;
  std::error_code none;
  const fs::path program = fs::read_symlink("/proc/self/exe", none).parent_path();
  for (const fs::path& folder : {program / "../share/embrun/data", program / "../../../data"})
    if (fs::is_directory(folder, none)) return fs::weakly_canonical(folder, none).string();
  return "data";
}

int run_splats(const ReproduceArguments& a, const std::string& command_line) {
  if (a.options.folder.empty()) throw UsageError("there is no folder to write to: give --output FOLDER");
  ReproduceSplatsOptions options;
  options.folder = a.options.folder;
  options.data = a.options.data;
  options.quick = a.options.quick;
  options.threads = a.options.threads;
  options.command = command_line;
  ReproduceHooks hooks;
  hooks.render.cancel = &catch_interrupts();
  hooks.step = [&](const std::string& what, int done, int total) {
    if (!a.quiet) fmt::print(stderr, "{}/{} {}\n", done + 1, total, what);
  };
  const ReproduceReport report = reproduce_splats(options, hooks);
  if (report.cancelled) {
    fmt::print(stderr, "embrun: interrupted; nothing was written down\n");
    return exit_interrupted;
  }
  if (!a.quiet) fmt::print("  clouds     {} of 3\n{}\n", report.rendered, report.document);
  return exit_done;
}

int run_reproduce(ReproduceArguments& a, const std::string& command_line) {
  if (a.what == "splats") return run_splats(a, command_line);
  if (a.what != "dam-break") throw UsageError("\"" + a.what + "\" cannot be reproduced; there are: dam-break, splats");
  if (!a.size.empty()) a.options.size = parse_size("--size", a.size);
  if (a.options.data.empty()) a.options.data = find_data();
  try {
    check_options(a.options);
  } catch (const std::runtime_error& error) {
    throw UsageError(error.what());
  }
  a.options.command = command_line;
  ProgressDisplay display(a.quiet);
  ReproduceHooks hooks;
  hooks.render.cancel = &catch_interrupts();
  hooks.render.progress = [&](const Progress& progress) { display.show(progress); };
  hooks.step = [&](const std::string& what, int done, int total) {
    display.finish();
    if (!a.quiet) fmt::print(stderr, "{}/{} {}\n", done + 1, total, what);
  };
  const ReproduceReport report = reproduce_dam_break(a.options, hooks);
  display.finish();
  if (report.cancelled) {
    fmt::print(stderr, "embrun: interrupted after {} pictures; the same command goes on from there\n",
               report.rendered + report.kept);
    return exit_interrupted;
  }
  if (!a.quiet)
    fmt::print("  pictures   {} rendered, {} kept from before\n{}\n", report.rendered, report.kept, report.document);
  return exit_done;
}

constexpr const char* reproduce_footer =
    "dam-break renders the dam break as chapter 5 of the thesis that Embrun builds on does, directly and as a mesh, "
    "and writes\n"
    "FOLDER/reproduction.md: its tables and figures beside ours. All of it takes hours on few cores; interrupted\n"
    "(Ctrl-C), the same command goes on where it was.\n\n"
    "splats measures what finds the splats of point clouds along a ray, as chapter 2 does, in some minutes:\n"
    "FOLDER/splats.md. The scans bunny_35947.ply and igea_70658.ply are taken from --data where they are there; the\n"
    "mirror sphere is made. Of the other options --quick and --threads apply.\n\n"
    "Examples:\n"
    "  embrun reproduce dam-break --quick -o out/quick\n"
    "  embrun reproduce dam-break -o out/reproduction\n"
    "  embrun reproduce splats --data scans -o out/splats\n\n"
    "Exit codes: 0 done, 1 a file or its content is at fault, 2 the command line is, 130 interrupted.";

}  // namespace

void add_reproduce_command(CLI::App& program, const std::string& command_line, int& exit_code) {
  const auto a = std::make_shared<ReproduceArguments>();
  a->options.data.clear();
  CLI::App* c = program.add_subcommand("reproduce", "Reproduce the thesis's tables and figures");
  c->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  c->add_option("WHAT", a->what, "dam-break or splats")->required();
  c->add_option("-o,--output", a->options.folder, "folder to write to; made if it is not there")->required();
  c->add_flag("--quick", a->options.quick, "small and noisy: 192x144, 8 samples");
  c->add_option("--data", a->options.data, "folder of the sample data: dam_break.bgeo, calm_pool.bgeo, ...")
      ->default_str("where the program is from");
  c->add_option("--radius", a->options.radius, "metres: R0 of the particles")->capture_default_str();
  c->add_option("--size", a->size, "WxH in pixels")->default_str("768x574");
  c->add_option("--spp", a->options.samples, "samples per pixel, an even number")->default_str("128");
  c->add_option("--thesis-spp", a->options.thesis_samples,
                "of the one picture by the thesis's own tracer, which is a quarter as wide and high")
      ->default_str("2");
  c->add_option("--seed", a->options.seed, "another one gives another noise")->capture_default_str();
  c->add_option("--threads", a->options.threads, "0: all that the machine has")->capture_default_str();
  c->add_flag("-q,--quiet", a->quiet, "print errors only");
  c->footer(reproduce_footer);
  c->callback([a, &exit_code, command_line] { exit_code = run_reproduce(*a, command_line); });
}

}  // namespace embrun
