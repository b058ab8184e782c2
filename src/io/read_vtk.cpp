#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "io/column.h"
#include "io/cursor.h"
#include "io/particle_readers.h"
#include "io/text.h"

namespace embrun {

namespace {

std::optional<ScalarType> vtk_type(std::string_view word) {
  struct Name {
    std::string_view word;
    ScalarType type;
  };
  // "long" is 8 bytes as every 64-bit Unix writes it; the legacy format stores vtkIdType as int.
  constexpr Name names[] = {
      {"char", ScalarType::int8},
      {"signed_char", ScalarType::int8},
      {"unsigned_char", ScalarType::uint8},
      {"short", ScalarType::int16},
      {"unsigned_short", ScalarType::uint16},
      {"int", ScalarType::int32},
      {"unsigned_int", ScalarType::uint32},
      {"long", ScalarType::int64},
      {"unsigned_long", ScalarType::uint64},
      {"vtktypeint64", ScalarType::int64},
      {"vtktypeuint64", ScalarType::uint64},
      {"vtkidtype", ScalarType::int32},
      {"float", ScalarType::float32},
      {"double", ScalarType::float64},
  };
  for (const Name& name : names) {
    if (to_lower(word) == name.word) return name.type;
  }
  return std::nullopt;
}

/// Names may not hold blanks: VTK writes them as %20 and so on.
std::string decoded_name(std::string_view text) {
  const auto digit = [](char c) {
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                  : -1;
  };
  std::string name;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%' && i + 2 < text.size() && digit(text[i + 1]) >= 0 && digit(text[i + 2]) >= 0) {
      name += static_cast<char>(16 * digit(text[i + 1]) + digit(text[i + 2]));
      i += 2;
    } else {
      name += text[i];
    }
  }
  return name;
}

class VtkReader {
 public:
  VtkReader(std::span<const std::byte> file, std::string_view name) : cursor_(file, name) {}

  ParticleSet read() {
    read_header();
    while (true) {
      const std::string_view word = keyword();
      if (word.empty()) break;
      read_section(to_lower(word), word);
    }
    if (!has_points_) cursor_.fail("POINTS", "the file has none");
    ParticleSet set = particles_from_columns(cursor_.file(), points_, std::move(columns_),
                                             [this](std::size_t i) { return point_place(i); });
    set.format = fmt::format("legacy VTK {}, {}", binary_ ? "binary" : "ASCII", dataset_);
    for (std::string& note : notes_) set.notes.push_back(std::move(note));
    return set;
  }

 private:
  Cursor cursor_;
  bool binary_ = false;
  std::string dataset_;
  bool has_points_ = false;
  std::size_t points_ = 0;
  std::uint64_t points_begin_ = 0;
  std::size_t point_bytes_ = 0;
  std::string points_place_;
  std::vector<Column> columns_;
  std::vector<std::string> notes_;
  // What the attributes that follow belong to.
  enum class Owner { dataset, points, cells } owner_ = Owner::dataset;
  std::uint64_t tuples_ = 0;

  void read_header() {
    if (!cursor_.line().starts_with("# vtk DataFile Version")) cursor_.fail("header", "not a legacy VTK file");
    cursor_.line();  // the title
    const std::string encoding = to_lower(trimmed(cursor_.line()));
    if (encoding != "ascii" && encoding != "binary") {
      cursor_.fail("header", fmt::format("{} is neither ASCII nor BINARY", quoted(encoding)));
    }
    binary_ = encoding == "binary";
    if (binary_) cursor_.set_binary();
  }

  std::string_view keyword() { return cursor_.token(); }

  std::string_view word(std::string_view what) {
    const std::string_view token = cursor_.token();
    if (token.empty()) cursor_.fail(what, "the file ends here");
    return token;
  }

  std::uint64_t number(std::string_view what) {
    const std::string_view token = word(what);
    const std::optional<std::uint64_t> value = parse_uint64(token);
    if (!value) cursor_.fail(what, fmt::format("{} is not a count", quoted(token)));
    return *value;
  }

  void read_section(const std::string& section, std::string_view as_written) {
    if (section == "dataset") return read_dataset();
    if (section == "points") return read_points();
    if (section == "vertices" || section == "lines" || section == "polygons" || section == "triangle_strips" ||
        section == "cells") {
      return skip_cells(section);
    }
    if (section == "cell_types") return skip_announced(number(section), ScalarType::int32, section);
    if (section == "point_data" || section == "cell_data") return begin_data(section);
    if (section == "field") return read_field();
    if (section == "metadata") return skip_metadata();
    if (section == "dimensions") return skip_words(3);
    if (read_attribute(section)) return;
    cursor_.fail("", fmt::format("{} is not a VTK keyword", quoted(as_written)));
  }

  // Whether the next token is that keyword; leaves it there.
  bool next_is(std::string_view expected) const {
    Cursor ahead = cursor_;
    return ahead.token() == expected;
  }

  void skip_words(int count) {
    for (int i = 0; i < count; ++i) word("header");
  }

  void read_dataset() {
    dataset_ = word("DATASET");
    const std::string name = to_lower(dataset_);
    if (name != "polydata" && name != "unstructured_grid" && name != "structured_grid") {
      const std::string wrong = quoted(dataset_);
      cursor_.fail("DATASET", fmt::format("{} has no particles; POLYDATA and UNSTRUCTURED_GRID are read", wrong));
    }
  }

  std::string point_place(std::size_t i) const {
    return binary_ ? fmt::format("offset {}", points_begin_ + i * point_bytes_)
                   : fmt::format("point {} of the list at {}", i, points_place_);
  }

  void read_points() {
    if (has_points_) cursor_.fail("POINTS", "they come a second time");
    has_points_ = true;
    points_ = static_cast<std::size_t>(number("POINTS"));
    points_place_ = cursor_.place();
    if (points_ == 0) cursor_.fail("POINTS", no_particles);
    const ScalarType type = type_named(word("POINTS"), "POINTS");
    point_bytes_ = 3 * size_of(type);
    end_header_line();
    columns_.insert(columns_.begin(), read_column("position", 3, points_, type));
  }

  ScalarType type_named(std::string_view token, std::string_view what) {
    const std::optional<ScalarType> type = vtk_type(token);
    if (!type) cursor_.fail(what, fmt::format("{} is not a type that is read", quoted(token)));
    return *type;
  }

  // Binary data begin right after the end of the line that announces them.
  void end_header_line() {
    if (binary_) cursor_.line();
  }

  // The array of `tuples` x `components` numbers that starts here.
  Column read_column(std::string name, std::uint64_t components, std::uint64_t tuples, ScalarType type) {
    const std::string what = quoted(name);
    constexpr std::uint64_t most_components = 65535;
    if (components == 0 || components > most_components) {
      cursor_.fail(what, fmt::format("{} components a value", components));
    }
    Column column;
    column.name = std::move(name);
    column.type = type;
    column.components = static_cast<std::size_t>(components);
    if (binary_) {
      const std::uint64_t stride = components * size_of(type);
      cursor_.require(tuples, stride, what);
      if (column.name == "position") points_begin_ = cursor_.offset();
      const std::size_t count = static_cast<std::size_t>(tuples);
      column.reserve(count * column.components);
      column.append_rows(cursor_.take(count * stride).data(), count, stride, true);
      return column;
    }
    if (tuples > cursor_.remaining()) cursor_.require_numbers(tuples, what);
    const std::uint64_t values = tuples * components;
    cursor_.require_numbers(values, what);
    column.reserve(static_cast<std::size_t>(values));
    for (std::uint64_t i = 0; i < values; ++i) {
      const std::string_view token = cursor_.token();
      if (token.empty()) cursor_.fail(what, fmt::format("the file ends after {} of {} numbers", i, values));
      if (!column.append_text(token)) cursor_.fail(what, fmt::format("{} is no number of its type", quoted(token)));
    }
    return column;
  }

  void skip_values(std::uint64_t values, ScalarType type, std::string_view what) {
    if (binary_) {
      cursor_.require(values, size_of(type), what);
      cursor_.take(static_cast<std::size_t>(values) * size_of(type));
      return;
    }
    for (std::uint64_t i = 0; i < values; ++i) word(what);
  }

  void skip_announced(std::uint64_t values, ScalarType type, std::string_view what) {
    end_header_line();
    skip_values(values, type, what);
  }

  // "CELLS n size" and n * (count, indices); or since 5.1 "CELLS offsets indices" and the two arrays.
  void skip_cells(std::string_view section) {
    const std::uint64_t first = number(section);
    const std::uint64_t second = number(section);
    end_header_line();
    if (!next_is("OFFSETS")) return skip_values(second, ScalarType::int32, section);
    word(section);
    skip_announced(first, type_named(word(section), section), section);
    if (to_lower(word(section)) != "connectivity") cursor_.fail(section, "there is no CONNECTIVITY after OFFSETS");
    skip_announced(second, type_named(word(section), section), section);
  }

  void begin_data(std::string_view section) {
    tuples_ = number(section);
    owner_ = section == "point_data" ? Owner::points : Owner::cells;
    if (owner_ == Owner::points && !has_points_) cursor_.fail("POINT_DATA", "it comes before POINTS");
    if (owner_ == Owner::points && tuples_ != points_) {
      cursor_.fail("POINT_DATA", fmt::format("{} values for {} points", tuples_, points_));
    }
  }

  // Ends at an empty line.
  void skip_metadata() {
    cursor_.line();
    while (!cursor_.at_end() && !trimmed(cursor_.line()).empty()) {
    }
  }

  void keep(Column column) {
    if (owner_ != Owner::points) return;
    if (columns_.size() == max_columns) cursor_.fail(quoted(column.name), "too many attributes");
    columns_.push_back(std::move(column));
  }

  bool read_attribute(std::string_view section) {
    if (section == "lookup_table") return skip_lookup_table();
    if (section == "scalars") return read_scalars();
    if (section == "color_scalars") return read_colors();
    struct Vector {
      std::string_view section;
      std::uint64_t components;
    };
    constexpr Vector vectors[] = {
        {"vectors", 3},    {"normals", 3},      {"tensors", 9},    {"tensors6", 6},
        {"global_ids", 1}, {"pedigree_ids", 1}, {"edge_flags", 1}, {"texture_coordinates", 0}};
    for (const Vector& vector : vectors) {
      if (vector.section != section) continue;
      const std::string name = decoded_name(word(section));
      const std::uint64_t components = vector.components ? vector.components : number(section);
      const ScalarType type = type_named(word(section), section);
      end_header_line();
      Column column = read_column(name, components, attribute_tuples(section), type);
      // What these are called in the file is up to the writer ("normals", "Normals_", ...); what they are is known.
      if (section == "normals") column.file_name = std::exchange(column.name, "normal");
      keep(std::move(column));
      return true;
    }
    return false;
  }

  std::uint64_t attribute_tuples(std::string_view what) {
    if (owner_ == Owner::dataset) cursor_.fail(what, "it comes before POINT_DATA or CELL_DATA");
    return tuples_;
  }

  // "SCALARS name type [components]", then "LOOKUP_TABLE name", which some writers leave out.
  bool read_scalars() {
    const std::string name = decoded_name(word("SCALARS"));
    const std::string_view type_word = word("SCALARS");
    const std::string_view rest = trimmed(cursor_.line());
    std::uint64_t components = 1;
    if (!rest.empty()) {
      const std::optional<std::uint64_t> value = parse_uint64(rest);
      if (!value) cursor_.fail(quoted(name), fmt::format("{} is not a number of components", quoted(rest)));
      components = *value;
    }
    const ScalarType type = type_named(type_word, quoted(name));
    if (next_is("LOOKUP_TABLE")) cursor_.line();
    keep(read_column(name, components, attribute_tuples("SCALARS"), type));
    return true;
  }

  bool read_colors() {
    const std::string name = decoded_name(word("COLOR_SCALARS"));
    const std::uint64_t components = number("COLOR_SCALARS");
    end_header_line();
    Column column = read_column(name, components, attribute_tuples("COLOR_SCALARS"),
                                binary_ ? ScalarType::uint8 : ScalarType::float32);
    if (components == 3) column.file_name = std::exchange(column.name, "color");
    keep(std::move(column));
    return true;
  }

  // "LOOKUP_TABLE name size" with size RGBA entries: bytes in binary, numbers in ASCII.
  bool skip_lookup_table() {
    word("LOOKUP_TABLE");
    const std::uint64_t entries = number("LOOKUP_TABLE");
    cursor_.require(entries, 4, "LOOKUP_TABLE");
    skip_announced(4 * entries, ScalarType::uint8, "LOOKUP_TABLE");
    return true;
  }

  // Text: a line each in ASCII; in binary a length whose first two bits tell how many bytes it takes, then the text.
  void skip_strings(std::uint64_t components, std::uint64_t tuples, std::string_view what) {
    if (components == 0 || tuples == 0) return;
    if (!binary_) cursor_.line();  // the rest of the one that announced them
    cursor_.require(tuples, components, what);
    for (std::uint64_t i = 0; i < tuples * components; ++i) {
      if (!binary_) {
        if (cursor_.at_end()) cursor_.fail(what, fmt::format("the file ends after {} texts", i));
        cursor_.line();
        continue;
      }
      cursor_.require(1, 1, what);
      std::uint64_t length = std::to_integer<std::uint64_t>(cursor_.take(1)[0]);
      const int more_bytes = 1 << (3 - static_cast<int>(length >> 6));
      length &= 0x3f;
      for (int k = 1; k < more_bytes; ++k) {
        cursor_.require(1, 1, what);
        length = length << 8 | std::to_integer<std::uint64_t>(cursor_.take(1)[0]);
      }
      cursor_.require(length, 1, what);
      cursor_.take(static_cast<std::size_t>(length));
    }
  }

  // Bits: eight to a byte in binary, the first one highest; a 0 or 1 each in ASCII.
  Column read_bits(const std::string& name, std::uint64_t components, std::uint64_t tuples) {
    if (!binary_) return read_column(name, components, tuples, ScalarType::uint8);
    if (components != 1) cursor_.fail(quoted(name), "arrays of more than one bit are not read");
    cursor_.require(tuples / 8 + (tuples % 8 != 0), 1, quoted(name));
    const std::span<const std::byte> bytes = cursor_.take(static_cast<std::size_t>(tuples / 8 + (tuples % 8 != 0)));
    Column column;
    column.name = name;
    column.type = ScalarType::uint8;
    for (std::uint64_t i = 0; i < tuples; ++i) {
      column.ints.push_back(std::to_integer<int>(bytes[static_cast<std::size_t>(i / 8)] >> (7 - i % 8)) & 1);
    }
    return column;
  }

  // "FIELD name arrays", then for each array "name components tuples type" and its values.
  void read_field() {
    word("FIELD");
    const std::uint64_t arrays = number("FIELD");
    for (std::uint64_t i = 0; i < arrays; ++i) {
      std::string_view token = word("FIELD");
      if (to_lower(token) == "metadata") {
        skip_metadata();
        token = word("FIELD");
      }
      const std::string name = decoded_name(token);
      const std::uint64_t components = number(quoted(name));
      const std::uint64_t tuples = number(quoted(name));
      const std::string_view type = word(quoted(name));
      if (owner_ == Owner::points && tuples != points_) {
        cursor_.fail(quoted(name), fmt::format("{} values for {} points", tuples, points_));
      }
      end_header_line();
      if (to_lower(type) == "string") {
        skip_strings(components, tuples, quoted(name));
        if (owner_ == Owner::points) notes_.push_back(fmt::format("text array {} was left out", quoted(name)));
      } else if (to_lower(type) == "bit") {
        keep(read_bits(name, components, tuples));
      } else if (tuples == 0 || components == 0) {
        continue;  // an array of nothing, as some writers leave behind
      } else {
        keep(read_column(name, components, tuples, type_named(type, quoted(name))));
      }
    }
  }
};

}  // namespace

ParticleSet read_vtk(std::span<const std::byte> file, std::string_view name) { return VtkReader(file, name).read(); }

}  // namespace embrun
