#include "io/obj_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "io/text.h"

namespace embrun {

namespace {

bool is_keyword(std::string_view word) {
  constexpr std::string_view keywords[] = {"v",   "vn",         "vt",        "f",        "vp",      "g",      "o",
                                           "s",   "l",          "p",         "mg",       "usemtl",  "mtllib", "bevel",
                                           "lod", "shadow_obj", "trace_obj", "c_interp", "d_interp"};
  return std::find(std::begin(keywords), std::end(keywords), word) != std::end(keywords);
}

}  // namespace

bool ObjLines::next(std::string_view& keyword, std::string_view& rest) {
  if (cursor_.at_end()) return false;
  rest = trimmed(cursor_.line());
  if (rest.ends_with('\\')) {
    joined_.clear();
    while (rest.ends_with('\\')) {
      joined_.append(rest.substr(0, rest.size() - 1)).append(" ");
      rest = trimmed(cursor_.line());
    }
    joined_.append(rest);
    rest = joined_;
  }
  keyword = take_token(rest);
  if (keyword.starts_with('#')) keyword = rest = {};
  if (!keyword.empty() && !is_keyword(keyword)) {
    cursor_.fail("", fmt::format("{} is not an OBJ keyword", quoted(keyword)));
  }
  return true;
}

Vec3d ObjLines::take_vector(std::string_view& line, std::string_view what) const {
  std::array<double, 3> values{};
  for (double& value : values) {
    const std::string_view token = take_token(line);
    const std::optional<double> number = parse_double(token);
    if (!number) cursor_.fail(what, fmt::format("{} is not a number; three are needed", quoted(token)));
    value = *number;
  }
  return {values[0], values[1], values[2]};
}

bool looks_like_obj(std::string_view file) {
  Cursor cursor(std::as_bytes(std::span(file.data(), file.size())), "");
  while (!cursor.at_end()) {
    std::string_view line = trimmed(cursor.line());
    const std::string_view keyword = take_token(line);
    if (keyword.empty() || keyword.starts_with('#')) continue;
    if (!is_keyword(keyword)) return false;
    if (keyword == "v") return parse_double(take_token(line)).has_value();
  }
  return false;
}

}  // namespace embrun
