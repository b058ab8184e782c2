#include "parse_values.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <limits>

namespace embrun {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& wanted) {
  throw UsageError(option + ": \"" + text + "\" is not " + wanted);
}

}  // namespace

void parse_numbers(const std::string& option, const std::string& text, const char* form, double* values, int count) {
  const std::string wanted = std::to_string(count) + " finite numbers " + form;
  const char* at = text.c_str();
  for (int i = 0; i < count; ++i) {
    char* end = nullptr;
    values[i] = std::strtod(at, &end);
    const char expected = i + 1 < count ? ',' : '\0';
    if (end == at || *end != expected || !std::isfinite(values[i])) refuse(option, text, wanted);
    at = end + 1;
  }
}

int as_integer(const std::string& option, double value) {
  if (value != std::floor(value) || std::abs(value) > 1e9)
    throw UsageError(option + ": " + std::to_string(value) + " is not a whole number");
  return static_cast<int>(value);
}

Color parse_color(const std::string& option, const std::string& text) {
  if (text.find(',') == std::string::npos) {
    const auto grey = static_cast<float>(parse_numbers<1>(option, text, "")[0]);
    return {grey, grey, grey};
  }
  const auto rgb = parse_numbers<3>(option, text, "r,g,b");
  return {static_cast<float>(rgb[0]), static_cast<float>(rgb[1]), static_cast<float>(rgb[2])};
}

Color parse_extinction(const std::string& option, const std::string& text) {
  constexpr float infinite = std::numeric_limits<float>::infinity();
  return text == "inf" ? Color{infinite, infinite, infinite} : parse_color(option, text);
}

FluidOptions parse_fluid(const std::string& option, const std::string& text) {
  FluidOptions fluid;
  // A colon of the file's own name is one that no key follows.
  std::string rest = text;
  for (;;) {
    const std::size_t colon = rest.rfind(':');
    const std::size_t equals = colon == std::string::npos ? colon : rest.find('=', colon);
    if (equals == std::string::npos) break;
    const std::string key = rest.substr(colon + 1, equals - colon - 1), value = rest.substr(equals + 1);
    const std::string name = fmt::format("{}: {}", option, key);
    if (key == "ior")
      fluid.ior = parse_numbers<1>(name, value, "")[0];
    else if (key == "absorption")
      fluid.absorption = parse_color(name, value);
    else if (key == "extinction")
      fluid.extinction = parse_extinction(name, value);
    else if (key == "albedo")
      fluid.albedo = parse_color(name, value);
    else if (key == "g")
      fluid.phase_g = parse_numbers<1>(name, value, "")[0];
    else
      refuse(option, key, "one of ior, absorption, extinction, albedo, g");
    rest.resize(colon);
  }
  if (rest.empty()) refuse(option, text, "FILE[:key=value...]");
  fluid.file = rest;
  return fluid;
}

std::array<int, 2> parse_size(const std::string& option, const std::string& text) {
  const std::size_t cross = text.find('x');
  const auto side = [&](const std::string& digits) {
    char* end = nullptr;
    const long value = std::strtol(digits.c_str(), &end, 10);
    if (digits.empty() || *end != '\0' || value < 1 || value > 65536)
      refuse(option, text, "a size WxH of 1 to 65536 pixels each, such as 1280x720");
    return static_cast<int>(value);
  };
  if (cross == std::string::npos) refuse(option, text, "a size WxH, such as 1280x720");
  return {side(text.substr(0, cross)), side(text.substr(cross + 1))};
}

std::vector<std::pair<std::string, std::string>> parse_definitions(const std::vector<std::string>& texts) {
  std::vector<std::pair<std::string, std::string>> definitions;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos) refuse("--define", text, "name=value");
    definitions.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  return definitions;
}

bool is_scene_file(const std::string& path) {
  if (path.size() < 4) return false;
  std::string end = path.substr(path.size() - 4);
  for (char& c : end) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return end == ".xml";
}

int parse_refractions(const std::string& option, const std::string& text) {
  if (text == "all") return -1;
  char* end = nullptr;
  const long value = std::strtol(text.c_str(), &end, 10);
  if (text.empty() || *end != '\0' || value < 1 || value > 65535) refuse(option, text, "1, 2, ... or all");
  return static_cast<int>(value);
}

}  // namespace embrun
