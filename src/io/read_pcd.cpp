#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "io/column.h"
#include "io/cursor.h"
#include "io/lzf.h"
#include "io/particle_readers.h"
#include "io/text.h"

namespace embrun {

namespace {

/// Four bytes 0xAARRGGBB of PCD's fields "rgb" and "rgba", which are integers or pass for floats.
void append_packed_colour(std::uint32_t bits, Column& colour, Column* alpha) {
  for (const int shift : {16, 8, 0}) colour.ints.push_back(static_cast<std::int32_t>(bits >> shift & 255));
  if (alpha) alpha->ints.push_back(static_cast<std::int32_t>(bits >> 24));
}

struct Field {
  std::string name;
  std::uint64_t size = 4;
  char type = 'F';
  std::uint64_t count = 1;

  std::size_t bytes() const { return static_cast<std::size_t>(size * count); }
  bool is_padding() const { return name == "_"; }
  bool is_colour() const { return (name == "rgb" || name == "rgba") && size == 4 && count == 1; }
};

std::optional<ScalarType> scalar_type(const Field& field) {
  if (field.type == 'F') {
    if (field.size == 4) return ScalarType::float32;
    if (field.size == 8) return ScalarType::float64;
    return std::nullopt;
  }
  const bool is_signed = field.type == 'I';
  switch (field.size) {
    case 1: return is_signed ? ScalarType::int8 : ScalarType::uint8;
    case 2: return is_signed ? ScalarType::int16 : ScalarType::uint16;
    case 4: return is_signed ? ScalarType::int32 : ScalarType::uint32;
    case 8: return is_signed ? ScalarType::int64 : ScalarType::uint64;
    default: return std::nullopt;
  }
}

/// Point Cloud Data as the Point Cloud Library describes it, versions 0.5 to 0.7.
class PcdReader {
 public:
  PcdReader(std::span<const std::byte> file, std::string_view name) : cursor_(file, name) {}

  ParticleSet read() {
    read_header();
    make_columns();
    RowPlace place;
    if (data_ == "ascii") {
      place = read_ascii();
    } else if (data_ == "binary") {
      place = read_binary();
    } else {
      place = read_compressed();
    }
    ParticleSet set = particles_from_columns(cursor_.file(), static_cast<std::size_t>(points_), take_columns(), place);
    set.format = "PCD " + data_;
    set.sensor = sensor_;
    return set;
  }

 private:
  Cursor cursor_;
  std::vector<Field> fields_;
  std::uint64_t points_ = 0;
  std::string data_;
  std::optional<Vec3d> sensor_;
  std::vector<Column> columns_;  // one per field, empty for padding
  std::vector<Column> alphas_;   // one per field, filled for "rgba" only

  std::uint64_t read_count(std::string_view line, std::string_view what) {
    const std::optional<std::uint64_t> count = parse_uint64(trimmed(line));
    if (!count) cursor_.fail(what, fmt::format("{} is not a number of points", quoted(trimmed(line))));
    return *count;
  }

  // Calls set(field, token) for each field in order.
  template <class Set>
  void read_per_field(std::string_view line, std::string_view what, const Set& set) {
    if (fields_.empty()) cursor_.fail(what, "FIELDS must stand before it");
    for (Field& field : fields_) {
      const std::string_view token = take_token(line);
      if (token.empty() || !set(field, token)) {
        cursor_.fail(what, fmt::format("{} is not one for field {}", quoted(token), quoted(field.name)));
      }
    }
    if (!trimmed(line).empty()) cursor_.fail(what, fmt::format("there are more than the {} fields", fields_.size()));
  }

  void read_header() {
    std::optional<std::uint64_t> width, height, points;
    while (data_.empty()) {
      if (cursor_.at_end()) cursor_.fail("header", "the file ends before DATA");
      std::string_view line = trimmed(cursor_.line());
      if (line.empty() || line.starts_with('#')) continue;
      const std::string_view keyword = take_token(line);
      if (keyword == "FIELDS" || keyword == "COLUMNS") {
        read_fields(line);
      } else if (keyword == "SIZE") {
        read_per_field(line, keyword, [](Field& field, std::string_view token) {
          field.size = parse_uint64(token).value_or(0);
          return field.size == 1 || field.size == 2 || field.size == 4 || field.size == 8;
        });
      } else if (keyword == "TYPE") {
        read_per_field(line, keyword, [](Field& field, std::string_view token) {
          field.type = token[0];
          return token == "I" || token == "U" || token == "F";
        });
      } else if (keyword == "COUNT") {
        read_per_field(line, keyword, [](Field& field, std::string_view token) {
          constexpr std::uint64_t most = 1 << 16;
          field.count = parse_uint64(token).value_or(0);
          return field.count >= 1 && field.count <= most;
        });
      } else if (keyword == "WIDTH") {
        width = read_count(line, keyword);
      } else if (keyword == "HEIGHT") {
        height = read_count(line, keyword);
      } else if (keyword == "POINTS") {
        points = read_count(line, keyword);
      } else if (keyword == "VIEWPOINT") {
        read_viewpoint(line);
      } else if (keyword == "DATA") {
        read_data(line);
      } else if (keyword != "VERSION") {
        cursor_.fail("header", fmt::format("{} is not a PCD keyword", quoted(keyword)));
      }
    }
    if (fields_.empty()) cursor_.fail("header", "there is no line FIELDS");
    check_points(width, height, points);
  }

  void read_fields(std::string_view line) {
    for (std::string_view token = take_token(line); !token.empty(); token = take_token(line)) {
      if (fields_.size() == max_columns) cursor_.fail("FIELDS", fmt::format("more than {} fields", max_columns));
      fields_.push_back({std::string(token)});
    }
  }

  // Where the scanner was and how it was turned, as a quaternion; the usual "0 0 0 1 0 0 0" says nothing.
  void read_viewpoint(std::string_view line) {
    std::array<double, 3> place{};
    for (double& value : place) {
      const std::string_view token = take_token(line);
      const std::optional<double> number = parse_double(token);
      if (!number || !(std::abs(*number) <= max_coordinate)) {
        cursor_.fail("VIEWPOINT", fmt::format("{} is not a coordinate", quoted(token)));
      }
      value = *number;
    }
    if (place[0] != 0 || place[1] != 0 || place[2] != 0) sensor_ = {place[0], place[1], place[2]};
  }

  void read_data(std::string_view line) {
    data_ = std::string(trimmed(line));
    if (data_ != "ascii" && data_ != "binary" && data_ != "binary_compressed") {
      cursor_.fail("DATA", fmt::format("{} is not ascii, binary or binary_compressed", quoted(data_)));
    }
  }

  void check_points(std::optional<std::uint64_t> width, std::optional<std::uint64_t> height,
                    std::optional<std::uint64_t> points) {
    constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
    for (const auto& count : {width, height, points}) {
      if (count.value_or(0) > most) cursor_.fail("header", fmt::format("{} points are too many", *count));
    }
    if (!points && !width) cursor_.fail("header", "there is no line POINTS");
    const std::uint64_t area = width.value_or(0) * height.value_or(1);
    points_ = points.value_or(area);
    if (width && area != points_) {
      cursor_.fail("POINTS", fmt::format("{} points, but WIDTH x HEIGHT is {}", points_, area));
    }
    if (points_ == 0) cursor_.fail("POINTS", no_particles);
  }

  std::size_t record_bytes() const {
    std::size_t bytes = 0;
    for (const Field& field : fields_) bytes += field.bytes();
    return bytes;
  }

  void make_columns() {
    columns_.resize(fields_.size());
    alphas_.resize(fields_.size());
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      const Field& field = fields_[i];
      Column& column = columns_[i];
      const std::optional<ScalarType> type = scalar_type(field);
      if (!type) {
        cursor_.fail("TYPE", fmt::format("field {} is a {} of {} bytes", quoted(field.name), field.type, field.size));
      }
      column.name = field.name;
      column.type = *type;
      column.components = static_cast<std::size_t>(field.count);
      if (!field.is_colour()) continue;
      column.name = "color";
      column.file_name = field.name;
      column.type = ScalarType::uint8;
      column.components = 3;
      alphas_[i].name = "alpha";
      alphas_[i].type = ScalarType::uint8;
    }
    constexpr std::size_t largest_record = 1 << 20;
    if (record_bytes() > largest_record) cursor_.fail("header", "the fields of a point take more than 1 MiB");
  }

  // `count` points, a field's values `stride` bytes apart.
  void append(std::size_t i, const std::byte* first, std::size_t count, std::size_t stride) {
    const Field& field = fields_[i];
    if (field.is_padding()) return;
    columns_[i].reserve(count * columns_[i].components);
    if (!field.is_colour()) return columns_[i].append_rows(first, count, stride, false);
    for (std::size_t row = 0; row < count; ++row, first += stride) {
      append_packed_colour(static_cast<std::uint32_t>(load_integer(first, ScalarType::uint32, false)), columns_[i],
                           field.name == "rgba" ? &alphas_[i] : nullptr);
    }
  }

  RowPlace read_binary() {
    cursor_.set_binary();
    const std::size_t record = record_bytes(), count = static_cast<std::size_t>(points_), begin = cursor_.offset();
    cursor_.require(count, record, "points");
    const std::byte* first = cursor_.take(count * record).data();
    for (std::size_t i = 0; i < fields_.size(); first += fields_[i++].bytes()) append(i, first, count, record);
    return [begin, record](std::size_t row) { return fmt::format("offset {}", begin + row * record); };
  }

  // Sizes packed and unpacked, then all values of the first field, all of the second ...
  RowPlace read_compressed() {
    cursor_.set_binary();
    cursor_.require(1, 8, "sizes of the compressed points");
    const std::byte* sizes = cursor_.take(8).data();
    const auto packed = static_cast<std::size_t>(load_integer(sizes, ScalarType::uint32, false));
    const auto unpacked = static_cast<std::uint64_t>(load_integer(sizes + 4, ScalarType::uint32, false));
    const std::size_t count = static_cast<std::size_t>(points_);
    if (unpacked != count * record_bytes()) {
      cursor_.fail("points", fmt::format("{} bytes unpacked, but {} points of {} bytes are announced", unpacked, count,
                                         record_bytes()));
    }
    cursor_.require(1, std::max<std::size_t>(packed, 1), "compressed points");
    if (unpacked > packed * most_lzf_expansion) {
      cursor_.fail("points", fmt::format("{} bytes cannot hold the {} that are announced", packed, unpacked));
    }
    const std::size_t begin = cursor_.offset();
    std::vector<std::byte> values(static_cast<std::size_t>(unpacked));
    if (!unpack_lzf(cursor_.take(packed), values)) {
      fail_in_file(cursor_.file(), fmt::format("offset {}", begin), "points", "the compressed data are damaged");
    }
    const std::byte* first = values.data();
    for (std::size_t i = 0; i < fields_.size(); first += count * fields_[i++].bytes()) {
      append(i, first, count, fields_[i].bytes());
    }
    return [begin](std::size_t row) { return fmt::format("offset {} (compressed, point {})", begin, row); };
  }

  RowPlace read_ascii() {
    std::uint64_t values = 0;
    for (const Field& field : fields_) values += field.count;
    cursor_.require_numbers(points_ * values, "points");
    const Cursor start = cursor_;
    for (std::uint64_t row = 0; row < points_; ++row) {
      std::string_view line = cursor_.filled_line();
      if (line.empty()) cursor_.fail("points", fmt::format("the file ends after {} of {}", row, points_));
      for (std::size_t i = 0; i < fields_.size(); ++i) {
        for (std::uint64_t k = 0; k < fields_[i].count; ++k) append_text(i, take_token(line));
      }
      if (!trimmed(line).empty()) cursor_.fail("points", "there are more values on the line than fields");
    }
    return [start](std::size_t row) {
      Cursor cursor = start;
      for (std::size_t i = 0; i <= row; ++i) cursor.filled_line();
      return cursor.place();
    };
  }

  void append_text(std::size_t i, std::string_view token) {
    const Field& field = fields_[i];
    if (token.empty()) cursor_.fail("field " + quoted(field.name), "the line ends before it");
    if (field.is_padding()) return;
    if (!field.is_colour()) {
      if (columns_[i].append_text(token)) return;
      cursor_.fail("field " + quoted(field.name), fmt::format("{} is no number of its type", quoted(token)));
    }
    std::uint32_t bits = 0;
    if (const auto integer = parse_int64(token); integer && field.type != 'F') {
      bits = static_cast<std::uint32_t>(*integer);
    } else if (const auto number = parse_double(token); number && field.type == 'F') {
      // Out of float's range no colour was packed.
      constexpr double greatest = std::numeric_limits<float>::max();
      if (std::abs(*number) <= greatest) bits = std::bit_cast<std::uint32_t>(static_cast<float>(*number));
    } else {
      cursor_.fail("field " + quoted(field.name), fmt::format("{} is no packed colour", quoted(token)));
    }
    append_packed_colour(bits, columns_[i], field.name == "rgba" ? &alphas_[i] : nullptr);
  }

  std::vector<Column> take_columns() {
    std::vector<Column> columns;
    for (std::size_t i = 0; i < fields_.size(); ++i) {
      if (fields_[i].is_padding()) continue;
      columns.push_back(std::move(columns_[i]));
      if (!alphas_[i].ints.empty()) columns.push_back(std::move(alphas_[i]));
    }
    return columns;
  }
};

}  // namespace

ParticleSet read_pcd(std::span<const std::byte> file, std::string_view name) { return PcdReader(file, name).read(); }

}  // namespace embrun
