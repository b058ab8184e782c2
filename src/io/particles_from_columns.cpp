#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "io/column.h"
#include "io/cursor.h"
#include "io/text.h"

namespace embrun {

namespace {

/// A name that the renderer looks for, and what files call it. Words are compared in lower case, except single
/// letters, where case tells N (normal) from n. The alias applies to attributes of that many components only, and to
/// integers only where a number of things is meant.
struct Alias {
  const char* name;
  std::size_t components;
  std::array<const char*, 6> words;
};

constexpr Alias aliases[] = {
    {"velocity", 3, {"v", "vel", "velocities", "Velocity"}},
    {"density", 1, {"rho", "densities", "Density"}},
    {"radius", 1, {"pscale", "radii", "Radius"}},
    {"id", 1, {"ID", "particle_id", "particleid", "ids"}},
    {"color", 3, {"Cd", "colour", "rgb", "colors", "Color"}},
    {"normal", 3, {"N", "normals", "Normal"}},
    {"type", 1, {"kind", "Type"}},
};

/// Scalar columns that are the components of one vector.
struct Split {
  const char* name;
  std::array<const char*, 3> parts;
};

constexpr Split splits[] = {
    {"velocity", {"vx", "vy", "vz"}},
    {"velocity", {"v_x", "v_y", "v_z"}},
    {"velocity", {"velx", "vely", "velz"}},
    {"velocity", {"velocity_x", "velocity_y", "velocity_z"}},
    {"velocity", {"velocity:0", "velocity:1", "velocity:2"}},
    {"normal", {"nx", "ny", "nz"}},
    {"normal", {"normal_x", "normal_y", "normal_z"}},
    {"color", {"red", "green", "blue"}},
    {"color", {"r", "g", "b"}},
    {"color", {"diffuse_red", "diffuse_green", "diffuse_blue"}},
};

constexpr std::array<const char*, 3> position_parts[] = {
    {"x", "y", "z"},
    {"px", "py", "pz"},
    {"pos_x", "pos_y", "pos_z"},
    {"position_x", "position_y", "position_z"},
    {"points:0", "points:1", "points:2"},
    {"position:0", "position:1", "position:2"},
};

/// A column's name as it is compared: lower case, without a unit in brackets ("X (m)" -> "x").
std::string comparable(std::string_view name) { return to_lower(trimmed(name.substr(0, name.find_first_of("[(")))); }

/// The column of numbers of that name: as it stands, else as it compares.
const Column* find_column(const std::vector<Column>& columns, std::string_view name, std::size_t components) {
  const Column* found = nullptr;
  for (const Column& column : columns) {
    if (column.components != components || !column.strings.empty()) continue;
    if (column.name == name) return &column;
    if (!found && comparable(column.name) == name) found = &column;
  }
  return found;
}

std::size_t index_of(const std::vector<Column>& columns, const Column* column) {
  return static_cast<std::size_t>(column - columns.data());
}

/// Removes the columns of those indices.
void erase_columns(std::vector<Column>& columns, std::vector<std::size_t> indices) {
  std::sort(indices.begin(), indices.end());
  for (std::size_t i = indices.size(); i-- > 0;)
    columns.erase(columns.begin() + static_cast<std::ptrdiff_t>(indices[i]));
}

/// The indices of the three columns that are called `parts`, or nothing.
std::vector<std::size_t> find_parts(const std::vector<Column>& columns, const std::array<const char*, 3>& parts) {
  std::vector<std::size_t> found;
  for (const char* part : parts) {
    const Column* column = find_column(columns, part, 1);
    if (!column) return {};
    found.push_back(index_of(columns, column));
  }
  return found;
}

std::vector<Vec3d> take_positions(std::string_view file, std::size_t rows, std::vector<Column>& columns,
                                  const RowPlace& place) {
  std::vector<Vec3d> positions(rows);
  if (const Column* column = find_column(columns, "position", 3)) {
    for (std::size_t i = 0; i < rows; ++i) {
      positions[i] = {column->value(3 * i), column->value(3 * i + 1), column->value(3 * i + 2)};
    }
    erase_columns(columns, {index_of(columns, column)});
    return positions;
  }
  for (const auto& parts : position_parts) {
    const std::vector<std::size_t> found = find_parts(columns, parts);
    if (found.empty()) continue;
    const Column *x = &columns[found[0]], *y = &columns[found[1]], *z = &columns[found[2]];
    for (std::size_t i = 0; i < rows; ++i) positions[i] = {x->value(i), y->value(i), z->value(i)};
    erase_columns(columns, found);
    return positions;
  }
  std::string names;
  for (const Column& column : columns) names += (names.empty() ? "" : ", ") + quoted(column.name);
  fail_in_file(file, place(0), "position",
               fmt::format("no columns x, y and z of numbers; there are {}", names.empty() ? "none" : names));
}

/// Where all parts have the same type, joins them to one column of three components.
void join_parts(std::vector<Column>& columns, const char* name, const std::array<const char*, 3>& parts) {
  if (find_column(columns, name, 3)) return;
  const std::vector<std::size_t> found = find_parts(columns, parts);
  if (found.empty()) return;
  const std::array<const Column*, 3> sources{&columns[found[0]], &columns[found[1]], &columns[found[2]]};
  const bool integers = std::all_of(sources.begin(), sources.end(), [](auto* s) { return !is_float(s->type); });
  Column joined;
  joined.name = name;
  joined.file_name = sources[0]->name + "," + sources[1]->name + "," + sources[2]->name;
  joined.components = 3;
  joined.type = integers ? sources[0]->type : ScalarType::float64;
  joined.full_scale = sources[0]->full_scale;
  const std::size_t rows = sources[0]->value_count();
  for (std::size_t i = 0; i < rows; ++i) {
    for (const Column* source : sources) {
      if (!integers) {
        joined.doubles.push_back(source->value(i));
      } else if (source->ints.empty()) {
        joined.longs.push_back(source->longs[i]);
      } else {
        joined.longs.push_back(source->ints[i]);
      }
    }
  }
  for (const Column* source : sources) joined.missing += source->missing;
  const std::size_t place = *std::min_element(found.begin(), found.end());
  erase_columns(columns, found);
  columns.insert(columns.begin() + static_cast<std::ptrdiff_t>(place), std::move(joined));
}

/// The stored value that means full intensity in an integer colour.
double colour_scale(const Column& column) {
  if (column.full_scale > 0) return column.full_scale;
  if (column.type == ScalarType::uint8) return 255;
  if (column.type == ScalarType::uint16) return 65535;
  double greatest = 0;
  for (std::size_t i = 0; i < column.value_count(); ++i) greatest = std::max(greatest, column.value(i));
  return greatest > 1 ? (greatest > 255 ? greatest : 255) : 1;
}

float rounded_to_float(double value, std::size_t& replaced) {
  if (std::abs(value) <= static_cast<double>(std::numeric_limits<float>::max())) return static_cast<float>(value);
  ++replaced;
  return 0;
}

/// Moves the column's values into an attribute; replaces and counts what is not finite.
Attribute to_attribute(Column&& column, ParticleSet& set) {
  Attribute result;
  result.name = column.name;
  result.components = static_cast<int>(column.components);
  result.strings = std::move(column.strings);
  result.replaced_non_finite = column.missing;
  if (is_float(column.type)) {
    result.floats = std::move(column.floats);
    for (float& value : result.floats) value = rounded_to_float(static_cast<double>(value), result.replaced_non_finite);
    result.floats.reserve(result.floats.size() + column.doubles.size());
    for (const double value : column.doubles)
      result.floats.push_back(rounded_to_float(value, result.replaced_non_finite));
    return result;
  }
  const auto fits = [](std::int64_t v) { return v == static_cast<std::int64_t>(static_cast<std::int32_t>(v)); };
  const auto negative = [](std::int64_t v) { return v < 0; };
  const bool wrapped =
      column.type == ScalarType::uint64 && std::any_of(column.longs.begin(), column.longs.end(), negative);
  if (wrapped || !std::all_of(column.longs.begin(), column.longs.end(), fits)) {
    result.type = AttributeType::int64;
    if (wrapped) {
      set.notes.push_back(fmt::format(
          "{}: unsigned values above 2^63 - 1 are kept as negative numbers of the same bits", quoted(column.name)));
    }
    result.longs.assign(column.ints.begin(), column.ints.end());
    result.longs.insert(result.longs.end(), column.longs.begin(), column.longs.end());
    return result;
  }
  result.type = AttributeType::int32;
  result.ints = std::move(column.ints);
  for (const std::int64_t value : column.longs) result.ints.push_back(static_cast<std::int32_t>(value));
  return result;
}

/// The renderer's name for a column, or null when it has none.
const char* canonical_name(const Column& column) {
  for (const Alias& alias : aliases) {
    if (column.components != alias.components) continue;
    for (const char* word : alias.words) {
      if (!word) continue;
      const std::string_view text(word);
      if (text.size() == 1 ? column.name == text : comparable(column.name) == to_lower(text)) return alias.name;
    }
  }
  return nullptr;
}

/// Whether the renderer takes the attribute as a real number, whatever a file (a table of round numbers, say) has.
bool is_quantity(std::string_view name) {
  constexpr std::string_view names[] = {"velocity", "density", "radius", "normal", "color"};
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

/// Turns an integer column into floats; a colour's from 0 to 1.
void make_real(Column& column) {
  if (is_float(column.type) || !column.strings.empty()) return;
  const double scale = column.name == "color" ? colour_scale(column) : 1;
  Column real;
  real.name = column.name;
  real.file_name = column.file_name;
  real.components = column.components;
  real.missing = column.missing;
  for (std::size_t i = 0; i < column.value_count(); ++i) {
    real.floats.push_back(static_cast<float>(column.value(i) / scale));
  }
  column = std::move(real);
}

/// Gives out attribute names so that none comes twice.
class Names {
 public:
  explicit Names(const std::vector<Column>& columns) {
    for (const Column& column : columns) in_file_.insert(column.name);
  }
  /// Whether an attribute has the name, or a column of the file does.
  bool taken(const std::string& name) const { return used_.contains(name) || in_file_.contains(name); }
  /// The name, or the name with a number behind it where it is used already.
  std::string claim(const std::string& name) {
    std::string result = name;
    if (used_.contains(name)) {
      int& copy = copies_.try_emplace(name, 1).first->second;
      do result = fmt::format("{}_{}", name, ++copy);
      while (taken(result));
    }
    used_.insert(result);
    return result;
  }

 private:
  std::unordered_set<std::string> in_file_, used_;
  std::unordered_map<std::string, int> copies_;
};

void add_attributes(ParticleSet& set, std::vector<Column>& columns) {
  Names names(columns);
  for (Column& column : columns) {
    if (const char* name = canonical_name(column); name && !names.taken(name)) {
      column.file_name = std::exchange(column.name, name);
    }
    if (is_quantity(column.name)) make_real(column);
    const std::string name = names.claim(column.name);
    if (name != column.name) {
      set.notes.push_back(
          fmt::format("attribute {} comes more than once; one is kept as {}", quoted(column.name), quoted(name)));
    }
    std::string file_name = std::move(column.file_name);
    set.attributes.push_back(to_attribute(std::move(column), set));
    Attribute& attribute = set.attributes.back();
    attribute.name = name;
    attribute.file_name = std::move(file_name);
    if (attribute.replaced_non_finite > 0) {
      set.notes.push_back(fmt::format("attribute {}: {} missing or non-finite values were set to 0",
                                      quoted(attribute.name), attribute.replaced_non_finite));
    }
  }
}

/// Checks the positions and drops the particles that are not finite.
void check_positions(std::string_view file, ParticleSet& set, const RowPlace& place) {
  const auto finite = [](double x) { return std::isfinite(x); };
  std::vector<std::uint8_t> keep(set.size(), 1);
  std::size_t first_dropped = set.size();
  for (std::size_t i = 0; i < set.size(); ++i) {
    const Vec3d p = set.positions[i];
    keep[i] = finite(p.x) && finite(p.y) && finite(p.z);
    if (!keep[i]) {
      ++set.dropped_non_finite;
      first_dropped = std::min(first_dropped, i);
      continue;
    }
    for (const double coordinate : {p.x, p.y, p.z}) {
      if (std::abs(coordinate) <= max_coordinate) continue;
      fail_in_file(file, place(i), "position",
                   fmt::format("coordinate {:g} of particle {} is beyond {:g} m: single precision cannot render that",
                               coordinate, i, max_coordinate));
    }
  }
  if (set.dropped_non_finite == 0) return;
  if (set.dropped_non_finite == set.size()) {
    fail_in_file(file, place(first_dropped), "position",
                 fmt::format("none of the {} particles has a finite position", set.size()));
  }
  set.notes.push_back(fmt::format("{} of {} particles were dropped: position not finite (first at {})",
                                  set.dropped_non_finite, set.size(), place(first_dropped)));
  keep_particles(set, keep);
}

}  // namespace

ParticleSet particles_from_columns(std::string_view file, std::size_t rows, std::vector<Column> columns,
                                   const RowPlace& place) {
  if (rows == 0) fail_in_file(file, place(0), "position", no_particles);
  if (rows > std::numeric_limits<std::uint32_t>::max()) {
    fail_in_file(file, place(0), "position", fmt::format("{} particles: more than 2^32 - 1 are not supported", rows));
  }
  ParticleSet set;
  set.positions = take_positions(file, rows, columns, place);
  for (const Split& split : splits) join_parts(columns, split.name, split.parts);
  add_attributes(set, columns);
  check_positions(file, set, place);
  return set;
}

}  // namespace embrun
