#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "embrun/compare.h"

namespace embrun {
namespace {

struct Metric {
  const char* name;
  std::optional<double> value;
};

/// All figures under their names, in the order in which they are told.
std::vector<Metric> all_metrics(const Comparison& c) {
  const auto part = [](const std::optional<IntervalEstimate>& estimate, double IntervalEstimate::*member) {
    return estimate ? std::optional((*estimate).*member) : std::nullopt;
  };
  return {{"mse", c.mse},
          {"rmse", c.rmse},
          {"psnr", c.psnr},
          {"ssim", c.ssim},
          {"flip", c.flip},
          {"flip_p95", c.flip_p95},
          {"mse_bias", part(c.mse_bias, &IntervalEstimate::value)},
          {"mse_bias_low", part(c.mse_bias, &IntervalEstimate::low)},
          {"mse_bias_high", part(c.mse_bias, &IntervalEstimate::high)},
          {"mse_noise", part(c.mse_noise, &IntervalEstimate::value)},
          {"mse_noise_low", part(c.mse_noise, &IntervalEstimate::low)},
          {"mse_noise_high", part(c.mse_noise, &IntervalEstimate::high)},
          {"relative_mse", c.relative_mse},
          {"mean_ratio", c.mean_ratio},
          {"mean_ratio_error", c.mean_ratio_error},
          {"block_share", c.block_share},
          {"block_share_noise", c.block_share_noise},
          {"block_rms", c.block_rms},
          {"block_noise_rms", c.block_noise_rms},
          {"block_p95", c.block_p95}};
}

std::string estimate_line(const char* name, const IntervalEstimate& e) {
  return fmt::format("    {:<14} {:.4e}, 95 % within {:.4e} and {:.4e}\n", name, e.value, e.low, e.high);
}

std::string noise_text(const Comparison& c) {
  if (!c.mse_bias || !c.mse_noise) return {};
  const auto source = [](const std::string& name) {
    return name == "half" ? "its half" : name == "variance" ? "its variance layer" : "taken as free of noise";
  };
  return fmt::format("  MSE in parts     (noise of A: {}; of B: {})\n", source(c.noise_from_a),
                     source(c.noise_from_b)) +
         estimate_line("bias", *c.mse_bias) + estimate_line("noise", *c.mse_noise);
}

std::string radiance_text(const Comparison& c) {
  if (!c.relative_mse) return {};
  std::string text = fmt::format("  radiance\n    relative MSE   {:.4e}, of (a-b)^2 / (b^2 + 0.01)\n", *c.relative_mse);
  if (c.mean_ratio)
    text += fmt::format("    mean ratio     {:.5f} +- {:.5f}, A / B\n", *c.mean_ratio, *c.mean_ratio_error);
  if (c.block_share) {
    text += fmt::format("    8x8 blocks     {:.2f} % within 2.5 %", 100 * *c.block_share);
    if (c.block_share_noise)
      text += fmt::format("; {:.2f} % within that and a standard error of their noise", 100 * *c.block_share_noise);
    text += fmt::format("\n                   rms {:.4f}", *c.block_rms);
    if (c.block_noise_rms) text += fmt::format(" (noise {:.4f})", *c.block_noise_rms);
    text += fmt::format(", 95 % below {:.4f}\n", *c.block_p95);
  }
  return text;
}

}  // namespace

std::vector<std::string> metric_names() {
  std::vector<std::string> names;
  for (const Metric& m : all_metrics({})) names.emplace_back(m.name);
  return names;
}

std::optional<double> metric(const Comparison& comparison, const std::string& name) {
  std::string names;
  for (const Metric& m : all_metrics(comparison)) {
    if (name == m.name) return m.value;
    names += (names.empty() ? "" : ", ") + std::string(m.name);
  }
  throw Error("unknown metric \"" + name + "\"; there are: " + names);
}

std::string to_text(const Comparison& c) {
  std::string text = fmt::format("{} against {}, {}x{}\n", c.a, c.b, c.width, c.height);
  text += c.display_a == c.display_b ? fmt::format("  display values   ({})\n", c.display_a)
                                     : fmt::format("  display values   (A: {}; B: {})\n", c.display_a, c.display_b);
  text += fmt::format("    MSE            {:.4e}\n    RMSE           {:.4e}\n", c.mse, c.rmse);
  text += std::isinf(c.psnr) ? "    PSNR           infinite: the pictures are equal\n"
                             : fmt::format("    PSNR           {:.2f} dB\n", c.psnr);
  if (c.ssim) text += fmt::format("    SSIM           {:.5f}\n", *c.ssim);
  text += fmt::format("    FLIP           {:.5f}, 95 % of the pixels below {:.5f}\n", c.flip, c.flip_p95);
  text += noise_text(c) + radiance_text(c);
  if (c.diff_scale) text += fmt::format("  differences      black 0, pale yellow {:g} and above\n", *c.diff_scale);
  for (const std::string& note : c.notes) text += "  note: " + note + "\n";
  return text;
}

std::string to_json(const Comparison& c) {
  nlohmann::ordered_json json;
  json["a"] = c.a;
  json["b"] = c.b;
  json["width"] = c.width;
  json["height"] = c.height;
  json["display"] = {{"a", c.display_a}, {"b", c.display_b}};
  for (const Metric& m : all_metrics(c)) {
    if (m.value && std::isfinite(*m.value))
      json[m.name] = *m.value;
    else
      json[m.name] = nullptr;
  }
  const auto source = [](const std::string& name) {
    return name.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(name);
  };
  json["noise_from"] = {{"a", source(c.noise_from_a)}, {"b", source(c.noise_from_b)}};
  json["diff_scale"] = c.diff_scale ? nlohmann::ordered_json(*c.diff_scale) : nlohmann::ordered_json();
  json["notes"] = c.notes;
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace embrun
