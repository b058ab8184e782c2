#include <embrun/bench.h>
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "commands.h"
#include "parse_values.h"
#include "progress_display.h"

namespace embrun {
namespace {

struct BenchArguments {
  BenchOptions options;
  std::string input;
  bool json = false, quiet = false;
};

int run_bench(const BenchArguments& a) {
  try {
    check_options(a.options);
  } catch (const std::runtime_error& error) {
    throw UsageError(error.what());
  }
  if (is_scene_file(a.input)) throw UsageError("a particle file is measured, not a scene");
  ProgressDisplay display(a.quiet);
  RenderHooks hooks;
  hooks.progress = [&](const Progress& progress) { display.show(progress); };
  const BenchReport report = bench_file(a.input, a.options, hooks);
  display.finish();
  std::fputs((a.json ? to_json(report) : to_text(report)).c_str(), stdout);
  return exit_done;
}

constexpr const char* bench_footer =
    "Rays are recorded from a small render of the file: from the camera, from the surface outwards and inwards\n"
    "(outside, inside), and the last in random order (shuffled). Embree finds them on a mesh of cells of R0/2, in\n"
    "whichever of its ways is the fastest. One thread; run it on an idle machine. The oracle judges the answers in\n"
    "double precision: oracle.wrong is 0, or there is a defect to report.\n\n"
    "Examples:\n"
    "  embrun bench dam.bgeo\n"
    "  embrun bench dam.bgeo --order 2 --json > figures.json\n\n"
    "Exit codes: 0 measured, 1 a file or its content is at fault, 2 the command line is.";

}  // namespace

void add_bench_command(CLI::App& program, int& exit_code) {
  const auto a = std::make_shared<BenchArguments>();
  CLI::App* c = program.add_subcommand("bench", "Measure rays, builds and free flights beside a mesh and a grid");
  c->option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  c->add_option("INPUT", a->input, "particle file: BGEO, PLY, VTK, XYZ or CSV")->required();
  c->add_option("--order", a->options.order, "neighbourhood order n")->capture_default_str();
  c->add_option("--radius", a->options.radius, "metres")->default_str("the file's, else half the spacing");
  c->add_option("--rays", a->options.rays, "of each kind")->capture_default_str();
  c->add_option("--oracle-rays", a->options.oracle_rays, "judged against the surface in double precision; 0: none")
      ->capture_default_str();
  c->add_option("--repetitions", a->options.repetitions, "of each measurement; medians count")->capture_default_str();
  c->add_flag("--json", a->json, "print a JSON object");
  c->add_flag("-q,--quiet", a->quiet, "no progress");
  c->footer(bench_footer);
  c->callback([a, &exit_code] { exit_code = run_bench(*a); });
}

}  // namespace embrun
