#include "io/ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "base/error.h"
#include "io/text.h"

namespace embrun {

namespace {

std::optional<ScalarType> ply_type(std::string_view word) {
  struct Name {
    std::string_view word;
    ScalarType type;
  };
  constexpr Name names[] = {
      {"char", ScalarType::int8},       {"int8", ScalarType::int8},      {"uchar", ScalarType::uint8},
      {"uint8", ScalarType::uint8},     {"short", ScalarType::int16},    {"int16", ScalarType::int16},
      {"ushort", ScalarType::uint16},   {"uint16", ScalarType::uint16},  {"int", ScalarType::int32},
      {"int32", ScalarType::int32},     {"uint", ScalarType::uint32},    {"uint32", ScalarType::uint32},
      {"int64", ScalarType::int64},     {"uint64", ScalarType::uint64},  {"float", ScalarType::float32},
      {"float32", ScalarType::float32}, {"double", ScalarType::float64}, {"float64", ScalarType::float64},
  };
  for (const Name& name : names) {
    if (name.word == word) return name.type;
  }
  return std::nullopt;
}

std::string property_name(const PlyElement& element, const PlyProperty& property) {
  return fmt::format("property {} of element {}", quoted(property.name), quoted(element.name));
}

std::string element_name(const PlyElement& element) { return "element " + quoted(element.name); }

bool has_lists(const PlyElement& element) {
  return std::any_of(element.properties.begin(), element.properties.end(), [](const auto& p) { return p.is_list; });
}

}  // namespace

PlyFile::PlyFile(std::span<const std::byte> file, std::string_view name) : cursor_(file, name) { read_header(); }

std::string PlyFile::format() const {
  if (encoding_ == Encoding::ascii) return "PLY ascii";
  return encoding_ == Encoding::little ? "PLY binary little-endian" : "PLY binary big-endian";
}

std::size_t PlyFile::find(std::string_view element) const {
  const auto same = [&](const PlyElement& e) { return e.name == element; };
  return static_cast<std::size_t>(std::find_if(elements_.begin(), elements_.end(), same) - elements_.begin());
}

void PlyFile::read_format(std::string_view line) {
  const std::string_view word = take_token(line);
  if (word == "ascii") {
    encoding_ = Encoding::ascii;
  } else if (word == "binary_little_endian") {
    encoding_ = Encoding::little;
  } else if (word == "binary_big_endian") {
    encoding_ = Encoding::big;
  } else {
    cursor_.fail("format", fmt::format("{} is none of ascii, binary_little_endian, binary_big_endian", quoted(word)));
  }
}

void PlyFile::read_property(std::string_view line) {
  if (elements_.empty()) cursor_.fail("property", "it comes before any element");
  std::vector<PlyProperty>& properties = elements_.back().properties;
  if (properties.size() == max_columns) cursor_.fail("property", fmt::format("more than {}", max_columns));
  PlyProperty property;
  std::string_view word = take_token(line);
  if (word == "list") {
    property.is_list = true;
    word = take_token(line);
    const std::optional<ScalarType> type = ply_type(word);
    if (!type || is_float(*type))
      cursor_.fail("property", fmt::format("{} is no type for a list's length", quoted(word)));
    property.count_type = *type;
    word = take_token(line);
  }
  const std::optional<ScalarType> type = ply_type(word);
  if (!type) cursor_.fail("property", fmt::format("{} is not a PLY type", quoted(word)));
  property.type = *type;
  property.name = take_token(line);
  if (property.name.empty()) cursor_.fail("property", "it has no name");
  properties.push_back(std::move(property));
}

void PlyFile::read_header() {
  if (trimmed(cursor_.line()) != "ply") cursor_.fail("header", "the file does not start with the line \"ply\"");
  bool has_format = false;
  while (true) {
    if (cursor_.at_end()) cursor_.fail("header", "the file ends before \"end_header\"");
    std::string_view line = trimmed(cursor_.line());
    const std::string_view keyword = take_token(line);
    if (keyword == "end_header") break;
    if (keyword.empty() || keyword == "comment" || keyword == "obj_info") continue;
    if (keyword == "format") {
      read_format(line);
      has_format = true;
    } else if (keyword == "element") {
      PlyElement element;
      element.name = take_token(line);
      const std::string_view count = take_token(line);
      const std::optional<std::uint64_t> number = parse_uint64(count);
      if (!number) cursor_.fail(element_name(element), fmt::format("{} is not a count", quoted(count)));
      element.count = *number;
      elements_.push_back(std::move(element));
    } else if (keyword == "property") {
      read_property(line);
    } else {
      cursor_.fail("header", fmt::format("{} is not a PLY keyword", quoted(keyword)));
    }
  }
  if (!has_format) cursor_.fail("header", "there is no format line");
  if (encoding_ != Encoding::ascii) cursor_.set_binary();
}

PlyRows PlyFile::read(std::size_t wanted_list, const PlyListSink& sink) {
  EMBRUN_CHECK(next_ < elements_.size());
  const PlyElement& element = elements_[next_++];
  PlyRows rows;
  for (const PlyProperty& property : element.properties) {
    if (property.is_list) continue;
    rows.columns.emplace_back();
    rows.columns.back().name = property.name;
    rows.columns.back().type = property.type;
  }
  if (element.properties.empty()) return rows;
  if (encoding_ == Encoding::ascii) {
    read_ascii(element, rows, wanted_list, sink);
  } else if (has_lists(element)) {
    read_list_binary(element, rows, wanted_list, sink);
  } else {
    read_fixed_binary(element, rows);
  }
  return rows;
}

void PlyFile::skip() {
  const PlyElement& element = elements_[next_];
  if (element.properties.empty()) {
    ++next_;
  } else if (encoding_ == Encoding::ascii) {
    ++next_;
    for (std::uint64_t i = 0; i < element.count; ++i) {
      if (cursor_.filled_line().empty()) {
        cursor_.fail(element_name(element), fmt::format("the file ends after {} of {} rows", i, element.count));
      }
    }
  } else if (has_lists(element)) {
    ++next_;
    PlyRows nothing;
    read_list_binary(element, nothing, no_list, {});
  } else {
    ++next_;
    std::uint64_t row = 0;
    for (const PlyProperty& property : element.properties) row += size_of(property.type);
    cursor_.require(element.count, row, element_name(element));
    cursor_.take(static_cast<std::size_t>(element.count * row));
  }
}

void PlyFile::read_ascii(const PlyElement& element, PlyRows& rows, std::size_t wanted_list, const PlyListSink& sink) {
  const std::size_t properties = element.properties.size();
  if (element.count > 0)
    cursor_.require(element.count, std::max<std::size_t>(1, 2 * properties - 1), element_name(element));
  for (Column& column : rows.columns) column.reserve(static_cast<std::size_t>(element.count));
  const Cursor start = cursor_;
  rows.place = [start](std::size_t row) {
    Cursor cursor = start;
    for (std::size_t i = 0; i <= row; ++i) cursor.filled_line();
    return cursor.place();
  };
  std::vector<std::int64_t> list;
  for (std::uint64_t row = 0; row < element.count; ++row) {
    std::string_view line = cursor_.filled_line();
    if (line.empty()) {
      cursor_.fail(element_name(element), fmt::format("the file ends after {} of {} rows", row, element.count));
    }
    std::size_t scalar = 0;
    for (std::size_t i = 0; i < properties; ++i) {
      const PlyProperty& property = element.properties[i];
      const std::string_view token = take_token(line);
      if (token.empty()) cursor_.fail(property_name(element, property), "the line ends before it");
      if (!property.is_list) {
        if (rows.columns.empty() || rows.columns[scalar++].append_text(token)) continue;
        cursor_.fail(property_name(element, property), fmt::format("{} is no number of its type", quoted(token)));
      }
      const std::optional<std::uint64_t> length = parse_uint64(token);
      if (!length) cursor_.fail(property_name(element, property), fmt::format("{} is not a length", quoted(token)));
      list.clear();
      for (std::uint64_t k = 0; k < *length; ++k) {
        const std::string_view item = take_token(line);
        if (item.empty()) cursor_.fail(property_name(element, property), fmt::format("{} of {} values", k, *length));
        if (i != wanted_list) continue;
        const std::optional<std::int64_t> value = parse_int64(item);
        if (!value) cursor_.fail(property_name(element, property), fmt::format("{} is not an integer", quoted(item)));
        list.push_back(*value);
      }
      if (i == wanted_list) sink(list);
    }
    if (!trimmed(line).empty())
      cursor_.fail(element_name(element), "there are more values on the line than properties");
  }
}

void PlyFile::read_fixed_binary(const PlyElement& element, PlyRows& rows) {
  std::size_t stride = 0;
  for (const PlyProperty& property : element.properties) stride += size_of(property.type);
  cursor_.require(element.count, stride, element_name(element));
  const std::size_t begin = cursor_.offset();
  rows.place = [begin, stride](std::size_t row) { return fmt::format("offset {}", begin + row * stride); };
  const std::size_t count = static_cast<std::size_t>(element.count);
  const std::byte* first = cursor_.take(count * stride).data();
  for (Column& column : rows.columns) {
    column.reserve(count);
    column.append_rows(first, count, stride, encoding_ == Encoding::big);
    first += size_of(column.type);
  }
}

// Rows of different lengths: one value after the other. `rows` without columns: nothing is kept.
void PlyFile::read_list_binary(const PlyElement& element, PlyRows& rows, std::size_t wanted_list,
                               const PlyListSink& sink) {
  const bool big = encoding_ == Encoding::big;
  const std::size_t begin = cursor_.offset();
  rows.place = [begin](std::size_t row) { return fmt::format("offset {} or later (row {})", begin, row); };
  std::vector<std::int64_t> list;
  for (std::uint64_t row = 0; row < element.count; ++row) {
    std::size_t scalar = 0;
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& property = element.properties[i];
      const std::size_t size = size_of(property.type);
      if (!property.is_list) {
        cursor_.require(1, size, property_name(element, property));
        const std::byte* value = cursor_.take(size).data();
        if (!rows.columns.empty()) rows.columns[scalar++].append_rows(value, 1, size, big);
        continue;
      }
      cursor_.require(1, size_of(property.count_type), property_name(element, property));
      const std::int64_t length =
          load_integer(cursor_.take(size_of(property.count_type)).data(), property.count_type, big);
      if (length < 0) cursor_.fail(property_name(element, property), fmt::format("a list of {} values", length));
      cursor_.require(static_cast<std::uint64_t>(length), size, property_name(element, property));
      const std::byte* values = cursor_.take(static_cast<std::size_t>(length) * size).data();
      if (i != wanted_list) continue;
      list.clear();
      for (std::int64_t k = 0; k < length; ++k, values += size)
        list.push_back(load_integer(values, property.type, big));
      sink(list);
    }
  }
}

}  // namespace embrun
