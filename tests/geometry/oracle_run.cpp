// Judges the surface tracers by the oracle, from the command line:
//   oracle_run [--scene NAME|FILE] [--order N] [--class camera|outside|inside] [--count N] [--seed S]
//              [--isa baseline|avx2|avx512] [--method fast|thesis] [--kernel metaball|zhu-bridson|blinn]
//              [--recover smooth|thesis|off] [--worst N] [--ray INDEX]
// Prints the number of wrong hits of each kind and the first wrong rays, as text and as hexadecimal floats that
// reproduce them; ends with 1 when there is any. Without --scene or --class it takes all of them.

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>

#include "base/error.h"
#include "geometry/tracers.h"
#include "measure/oracle_scene.h"

namespace {

using namespace embrun;
using namespace embrun::test;
using namespace embrun::measure;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

const char* name_of_side(Side side) {
  return side == Side::unknown ? "unknown" : side == Side::outside ? "outside" : "inside";
}

void print_wrong(const OracleReport::Wrong& wrong) {
  const Ray& r = wrong.ray.ray;
  fmt::print("  #{} {}: starts {}, hit {} t {:.7g} {}, expected t {:.7g}, difference {:.3g}\n", wrong.index,
             oracle::name_of(wrong.judgement.verdict), name_of_side(wrong.ray.side), wrong.answer.hit, wrong.answer.t,
             wrong.answer.entering ? "entering" : "leaving", wrong.judgement.expected,
             wrong.answer.t - wrong.judgement.expected);
  fmt::print("     origin {{{:a}f, {:a}f, {:a}f}} ({:.6g} {:.6g} {:.6g})\n", r.origin.x, r.origin.y, r.origin.z,
             r.origin.x, r.origin.y, r.origin.z);
  if (r.clearance.distance > 0) {
    fmt::print("     clearance {:.6g} of sheet {}\n", r.clearance.distance, r.clearance.sheet);
  }
  fmt::print("     direction {{{:a}f, {:a}f, {:a}f}} ({:.6g} {:.6g} {:.6g})\n", r.direction.x, r.direction.y,
             r.direction.z, r.direction.x, r.direction.y, r.direction.z);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> scenes, classes;
  int order = 3;
  std::size_t count = 2000, worst = 5;
  std::uint32_t seed = 1;
  std::string isa, method = "fast", kernel = "metaball", recover = "smooth";
  long only = -1;
  CLI::App app{"Judges the surface tracers by a double-precision oracle"};
  app.add_option("--scene", scenes);
  app.add_option("--order", order);
  app.add_option("--class", classes);
  app.add_option("--count", count);
  app.add_option("--seed", seed);
  app.add_option("--isa", isa);
  app.add_option("--method", method);
  app.add_option("--kernel", kernel);
  app.add_option("--recover", recover);
  app.add_option("--worst", worst);
  app.add_option("--ray", only, "judge only this ray of the class");
  CLI11_PARSE(app, argc, argv);
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  if (scenes.empty()) scenes = synthetic_scene_names();
  if (classes.empty()) classes = {"camera", "outside", "inside"};

  std::size_t wrong_count = 0;
  for (const std::string& name : scenes) {
    OracleScene scene = make_scene(name, order, seed);
    scene.settings.kernel = kernel == "blinn"         ? Kernel::blinn
                            : kernel == "zhu-bridson" ? Kernel::zhu_bridson
                                                      : Kernel::metaball;
    scene.settings.recover = recover == "off"      ? RecoverMode::off
                             : recover == "thesis" ? RecoverMode::thesis
                                                   : RecoverMode::smooth;
    const SurfaceModel model = resolve_surface_model(scene.positions, scene.radii, scene.settings);
    const oracle::Surface surface = oracle_surface(scene, model);
    const Tracer tracer = make_tracer(method, isa, scene.positions, scene.radii, scene.settings);
    fmt::print("{}: {} particles, n = {}, T = {:.6g}, {} recovered\n", name, scene.positions.size(), order,
               model.threshold, model.recovered.size());
    for (const std::string& class_name : classes) {
      const RayClass ray_class = class_name == "camera"    ? RayClass::camera
                                 : class_name == "outside" ? RayClass::outside
                                                           : RayClass::inside;
      double start = seconds();
      std::vector<TestRay> rays = make_rays(scene, surface, tracer.intersect, ray_class, count, seed);
      const double making = seconds() - start;
      if (only >= 0) rays = {rays.at(static_cast<std::size_t>(only))};
      start = seconds();
      const OracleReport report = judge_rays(scene, surface, tracer.intersect, rays);
      fmt::print(" {} ({:.1f} s to make, {:.1f} s to judge): {}\n", class_name, making, seconds() - start,
                 report.summary());
      for (std::size_t i = 0; i < std::min(worst, report.wrong.size()); ++i) print_wrong(report.wrong[i]);
      wrong_count += report.wrong_count();
    }
  }
  return wrong_count == 0 ? 0 : 1;
}
