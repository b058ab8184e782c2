#pragma once

#include <embrun/embrun.h>

#include <array>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace embrun {

/// A mistake on the command line: exit code 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Values of options as text. Each throws UsageError naming the option, what was given and what is wanted.

/// Numbers separated by commas, into `values`; `form` shows how it is written ("x,y,z").
void parse_numbers(const std::string& option, const std::string& text, const char* form, double* values, int count);

template <std::size_t N>
std::array<double, N> parse_numbers(const std::string& option, const std::string& text, const char* form) {
  std::array<double, N> values{};
  parse_numbers(option, text, form, values.data(), static_cast<int>(N));
  return values;
}

/// An integer of an option written with commas; `value` came from parse_numbers.
int as_integer(const std::string& option, double value);

/// "r,g,b", or one number for all three.
Color parse_color(const std::string& option, const std::string& text);

/// The same, or "inf".
Color parse_extinction(const std::string& option, const std::string& text);

/// "FILE[:key=value...]"; keys ior, absorption, extinction, albedo, g.
FluidOptions parse_fluid(const std::string& option, const std::string& text);

/// "WxH"
std::array<int, 2> parse_size(const std::string& option, const std::string& text);

/// "name=value" each.
std::vector<std::pair<std::string, std::string>> parse_definitions(const std::vector<std::string>& texts);

/// Told by the name: *.xml
bool is_scene_file(const std::string& path);

/// "all" (-1) or a number of at least 1.
int parse_refractions(const std::string& option, const std::string& text);

}  // namespace embrun
