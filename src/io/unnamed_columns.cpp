#include "io/unnamed_columns.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace embrun {

namespace {

bool is_unnamed(const Column& column, std::size_t index) {
  return column.strings.empty() && column.components == 1 && column.name == fmt::format("column_{}", index + 1);
}

/// Whether three columns from `first` hold whole numbers of a byte.
bool is_colour(const std::vector<Column>& columns, std::size_t first) {
  double greatest = 0;
  for (std::size_t c = first; c < first + 3; ++c) {
    if (is_float(columns[c].type)) return false;
    for (std::size_t i = 0; i < columns[c].value_count(); ++i) {
      const double value = columns[c].value(i);
      if (value < 0 || value > 255) return false;
      greatest = std::max(greatest, value);
    }
  }
  return greatest >= 2;
}

/// Whether three columns from `first` hold unit vectors.
bool is_normal(const std::vector<Column>& columns, std::size_t first) {
  const Column &x = columns[first], &y = columns[first + 1], &z = columns[first + 2];
  bool any = false;
  for (std::size_t i = 0; i < x.value_count(); ++i) {
    const double size = std::hypot(x.value(i), y.value(i), z.value(i));
    if (size == 0) continue;
    constexpr double tolerance = 0.01;
    if (!(std::abs(size - 1) < tolerance)) return false;
    any = true;
  }
  return any;
}

}  // namespace

void name_by_values(std::vector<Column>& columns, std::vector<std::string>& notes) {
  bool colour = false, normal = false;
  for (std::size_t i = 0; i + 3 <= columns.size(); ++i) {
    if (!is_unnamed(columns[i], i) || !is_unnamed(columns[i + 1], i + 1) || !is_unnamed(columns[i + 2], i + 2))
      continue;
    std::array<const char*, 3> names{"red", "green", "blue"};
    if (!colour && is_colour(columns, i)) {
      colour = true;
      if (i == 4 && is_unnamed(columns[3], 3)) columns[3].name = "intensity";
      for (std::size_t c = 0; c < 3; ++c) columns[i + c].full_scale = 255;
    } else if (!normal && is_normal(columns, i)) {
      normal = true;
      names = {"nx", "ny", "nz"};
    } else {
      continue;
    }
    for (std::size_t c = 0; c < 3; ++c) columns[i + c].name = names[c];
    notes.push_back(fmt::format("columns {} to {} were taken as the {}", i + 1, i + 3,
                                names[0] == std::string_view("nx") ? "normal" : "colour"));
    i += 2;
  }
}

}  // namespace embrun
