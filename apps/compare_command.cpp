#include <embrun/embrun.h>
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "commands.h"
#include "parse_values.h"

namespace embrun {
namespace {

struct CompareArguments {
  CompareOptions options;
  std::string a, b;
  bool json = false;
  std::vector<std::string> fail_above, fail_below;
};

/// A bound on one figure.
struct Limit {
  std::string name;
  double value;
  bool is_upper;
};

/// "METRIC=VALUE" each. Throws UsageError.
void parse_limits(const std::string& option, const std::vector<std::string>& texts, bool is_upper,
                  std::vector<Limit>& limits) {
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos)
      throw UsageError(fmt::format("{}: \"{}\" is not METRIC=VALUE, such as flip=0.05", option, text));
    const Limit limit{text.substr(0, equals), parse_numbers<1>(option, text.substr(equals + 1), "")[0], is_upper};
    try {
      metric({}, limit.name);
    } catch (const std::runtime_error& error) {
      throw UsageError(fmt::format("{}: {}", option, error.what()));
    }
    limits.push_back(limit);
  }
}

/// Says which limits are passed; their number. Throws when a figure is not known.
int count_failures(const Comparison& comparison, const std::vector<Limit>& limits) {
  int failures = 0;
  for (const Limit& limit : limits) {
    const std::optional<double> value = metric(comparison, limit.name);
    if (!value) {
      std::string why;
      for (const std::string& note : comparison.notes) why += "; " + note;
      throw std::runtime_error(limit.name + " is not known of these pictures" + why);
    }
    // Written so that a figure that is no number fails.
    if (limit.is_upper ? *value <= limit.value : *value >= limit.value) continue;
    fmt::print(stderr, "embrun: {} is {:.6g}, {} {:.6g}\n", limit.name, *value, limit.is_upper ? "above" : "below",
               limit.value);
    ++failures;
  }
  return failures;
}

int run_compare(CompareArguments& a) {
  std::vector<Limit> limits;
  parse_limits("--fail-above", a.fail_above, true, limits);
  parse_limits("--fail-below", a.fail_below, false, limits);
  try {
    check_options(a.options);
  } catch (const std::runtime_error& error) {
    throw UsageError(error.what());
  }
  const Comparison comparison = compare_files(a.a, a.b, a.options);
  std::fputs((a.json ? to_json(comparison) : to_text(comparison)).c_str(), stdout);
  return count_failures(comparison, limits) > 0 ? exit_over_limit : exit_done;
}

void add_options(CLI::App& c, CompareArguments& a) {
  CompareOptions& o = a.options;
  c.add_option("A", a.a, "picture file: EXR, PFM, HDR, PNG or JPEG, told by its content")->required();
  c.add_option("B", a.b, "the reference, of the same size")->required();
  c.add_flag("--json", a.json, "print a JSON object");
  c.add_option("--tone", o.tone, "tone curve that makes radiance display values: filmic, srgb (clips at 1)")
      ->capture_default_str();
  c.add_option("--exposure", o.exposure, "stops before the tone curve")->capture_default_str();
  c.add_option("--ppd", o.pixels_per_degree, "of FLIP: pixels per degree of the visual field")
      ->default_str("67: a 4K screen 0.7 m wide, seen from 0.7 m");
  c.add_option("--half-a", o.half_a, "the scene of A rendered again with another --seed: tells its noise")
      ->group("Noise");
  c.add_option("--half-b", o.half_b, "the same for B; both halves may share a seed, as A and B may")->group("Noise");
  c.add_option("--diff", o.diff_file,
               "picture of the differences to write: .png in false colours; .exr, .pfm, .hdr: the values")
      ->group("Differences");
  c.add_option("--diff-of", o.diff_of,
               "display (display values), flip, relative (radiance over the reference's); root mean square over the "
               "channels")
      ->capture_default_str()
      ->group("Differences");
  c.add_option("--diff-scale", o.diff_scale, "difference that the brightest colour stands for")
      ->default_str("round, above 99.5 % of them")
      ->group("Differences");
  const auto add_limits = [&](const char* name, std::vector<std::string>& limits, const char* meaning) {
    c.add_option(name, limits, meaning)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->allow_extra_args(false)
        ->group("For scripts");
  };
  add_limits("--fail-above", a.fail_above, "METRIC=VALUE: exit code 3 when it is above; may be repeated");
  add_limits("--fail-below", a.fail_below, "METRIC=VALUE: exit code 3 when it is below; may be repeated");
}

constexpr const char* teaching =
    "Display values are those of a PNG file, from 0 to 1: radiance goes through the tone curve first. MSE is their "
    "mean\n"
    "squared difference over all pixels and channels; flip, from 0 to 1, what one sees when flipping between them.\n\n"
    "Two renders differ by their noise, too. With EXR files, or halves, the MSE is told in parts: bias (what more\n"
    "samples would leave) and noise, each with its 95 % confidence interval. Variance layers of EXR files tell only "
    "the\n"
    "most that the noise can be; halves tell it without bias:\n"
    "  embrun render dam.bgeo -o a1.exr --seed 1               and with --seed 2: a2.exr\n"
    "  embrun render dam.bgeo -o b1.exr --seed 1 --order 2     and with --seed 2: b2.exr\n"
    "  embrun compare a1.exr b1.exr --half-a a2.exr --half-b b2.exr\n\n"
    "Examples:\n"
    "  embrun compare direct.exr reference.pfm --tone srgb --diff difference.png\n"
    "  embrun compare a.png b.png --fail-above flip=0.05 --fail-below ssim=0.95\n\n";

constexpr const char* exit_codes =
    "\n\nExit codes: 0 compared, however different, 1 a file is at fault, 2 the command line is, 3 a limit is passed.";

std::string footer() {
  constexpr std::size_t most_columns = 110;
  std::string names, line = "Metrics:";
  for (const std::string& name : metric_names()) {
    if (line.size() + name.size() > most_columns) {
      names += line + "\n";
      line = " ";
    }
    line += " " + name;
  }
  return teaching + names + line + exit_codes;
}

}  // namespace

void add_compare_command(CLI::App& program, int& exit_code) {
  const auto arguments = std::make_shared<CompareArguments>();
  CLI::App* compare = program.add_subcommand("compare", "Say how far two pictures are from each other");
  add_options(*compare, *arguments);
  compare->footer(footer());
  compare->callback([arguments, &exit_code] { exit_code = run_compare(*arguments); });
}

}  // namespace embrun
