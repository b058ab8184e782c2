#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "io/byte_stream.h"
#include "io/column.h"
#include "io/cursor.h"
#include "io/particle_readers.h"
#include "io/text.h"

namespace embrun {

namespace {

// Layout: Houdini's classic (pre-12) geometry format, as Partio reads and writes it.
constexpr std::int64_t supported_version = 5;
constexpr std::size_t value_bytes = 4;  // every component of a position (x, y, z, w) and of an attribute
enum BgeoType : std::int64_t { bgeo_float = 0, bgeo_int = 1, bgeo_string_index = 4, bgeo_vector = 5 };

struct BgeoHeader {
  std::int64_t points = 0;
  std::int64_t point_attributes = 0;
};

std::int64_t read_integer(ByteStream& stream, ScalarType type, std::string_view what) {
  std::array<std::byte, 8> bytes;
  stream.read(std::span(bytes).first(size_of(type)), what);
  return load_integer(bytes.data(), type, true);
}

std::string read_string(ByteStream& stream, std::string_view what) {
  std::string text(static_cast<std::size_t>(read_integer(stream, ScalarType::uint16, what)), '\0');
  stream.read(std::as_writable_bytes(std::span(text)), what);
  return text;
}

BgeoHeader read_header(ByteStream& stream) {
  std::array<char, 5> magic{};
  stream.read(std::as_writable_bytes(std::span(magic)), "header");
  if (std::memcmp(magic.data(), "BgeoV", 5) != 0) {
    stream.fail("header",
                fmt::format("{} is not the start of a classic BGEO file (\"BgeoV\"){}", quoted({magic.data(), 5}),
                            stream.compressed() ? "; only BGEO is read gzipped, unpack other files" : ""));
  }
  const std::int64_t version = read_integer(stream, ScalarType::int32, "version");
  if (version != supported_version) {
    stream.fail("version", fmt::format("{} is not supported, only {}", version, supported_version));
  }
  constexpr std::array names{"number of points",
                             "number of primitives",
                             "number of point groups",
                             "number of primitive groups",
                             "number of point attributes",
                             "number of vertex attributes",
                             "number of primitive attributes",
                             "number of detail attributes"};
  std::array<std::int64_t, names.size()> counts{};
  for (std::size_t i = 0; i < names.size(); ++i) {
    counts[i] = read_integer(stream, ScalarType::int32, names[i]);
    if (counts[i] < 0) stream.fail(names[i], fmt::format("{} is negative", counts[i]));
  }
  if (counts[0] == 0) stream.fail(names[0], no_particles);
  return {counts[0], counts[4]};
}

std::vector<std::string> read_string_table(ByteStream& stream, const BgeoHeader& header, std::string_view what) {
  const std::int64_t count = read_integer(stream, ScalarType::int32, what);
  // Longer tables than this have entries that no point uses; an empty string costs more memory than file.
  constexpr std::int64_t always_allowed = 65536;
  if (count < 0 || count > header.points + always_allowed) {
    stream.fail(what, fmt::format("a table of {} strings for {} points", count, header.points));
  }
  stream.require(static_cast<std::uint64_t>(count), 2, what);
  std::vector<std::string> strings;
  for (std::int64_t i = 0; i < count; ++i) strings.push_back(read_string(stream, what));
  // A string attribute whose table is empty is still told from a number by having a table.
  if (strings.empty()) strings.emplace_back();
  return strings;
}

Column read_attribute_header(ByteStream& stream, const BgeoHeader& header) {
  Column column;
  column.name = read_string(stream, "attribute name");
  const std::string what = "attribute " + quoted(column.name);
  column.components = static_cast<std::size_t>(read_integer(stream, ScalarType::uint16, what));
  if (column.components == 0) stream.fail(what, "it has no components");
  switch (const std::int64_t type = read_integer(stream, ScalarType::int32, what)) {
    case bgeo_float:
    case bgeo_vector: column.type = ScalarType::float32; break;
    case bgeo_int: column.type = ScalarType::int32; break;
    case bgeo_string_index:
      column.type = ScalarType::int32;
      column.strings = read_string_table(stream, header, what);
      return column;
    default: stream.fail(what, fmt::format("type {} is not known (0 float, 1 int, 4 string, 5 vector)", type));
  }
  stream.skip(column.components * value_bytes, what);  // the default values
  return column;
}

std::size_t record_bytes(const std::vector<Column>& columns) {
  std::size_t bytes = 0;
  for (const Column& column : columns) bytes += column.components * value_bytes;
  return bytes;
}

// Reads the points a block at a time, so that memory grows only with data that are there.
void read_points(ByteStream& stream, const BgeoHeader& header, std::vector<Column>& columns) {
  const std::size_t record = record_bytes(columns);
  constexpr std::size_t largest_record = 1 << 20;
  if (record > largest_record) stream.fail("points", fmt::format("{} bytes a point are too many", record));
  const std::size_t points = static_cast<std::size_t>(header.points);
  stream.require(points, record, "points");
  if (!stream.compressed()) {
    for (Column& column : columns) column.reserve(points * column.components);
  }
  constexpr std::size_t block_bytes = 1 << 16;
  const std::size_t block_points = std::max<std::size_t>(1, block_bytes / record);
  std::vector<std::byte> block(block_points * record);
  for (std::size_t done = 0; done < points;) {
    const std::size_t count = std::min(block_points, points - done);
    stream.read(std::span(block).first(count * record),
                fmt::format("points {} to {} of {}", done, done + count - 1, points));
    const std::byte* first = block.data();
    for (Column& column : columns) {
      column.append_rows(first, count, record, true);
      first += column.components * value_bytes;
    }
    done += count;
  }
}

// Unpacks what follows the points, for gzip's checksum is at the very end; gives up on long tails (primitives).
void check_rest(ByteStream& stream) {
  if (!stream.compressed()) return;
  constexpr int most_blocks = 4096;
  std::vector<std::byte> block(1 << 14);
  for (int i = 0; i < most_blocks && stream.read_some(block) > 0; ++i) {
  }
}

}  // namespace

ParticleSet read_bgeo(std::span<const std::byte> file, std::string_view name) {
  ByteStream stream(file, name);
  const BgeoHeader header = read_header(stream);

  if (header.point_attributes > static_cast<std::int64_t>(max_columns)) {
    stream.fail("number of point attributes", fmt::format("{} is more than {}", header.point_attributes, max_columns));
  }
  std::vector<Column> columns(2);
  columns[0].name = std::string("position");
  columns[0].components = 3;
  columns[1].name = std::string("w");
  for (std::int64_t i = 0; i < header.point_attributes; ++i) columns.push_back(read_attribute_header(stream, header));

  const std::uint64_t first_point = stream.offset();
  const std::size_t record = record_bytes(columns);
  read_points(stream, header, columns);
  check_rest(stream);

  // The fourth coordinate is 1 but in rare files.
  const auto is_one = [](float w) { return w == 1.0f; };
  if (std::all_of(columns[1].floats.begin(), columns[1].floats.end(), is_one)) columns.erase(columns.begin() + 1);
  ParticleSet set =
      particles_from_columns(name, static_cast<std::size_t>(header.points), std::move(columns),
                             [&](std::size_t i) { return fmt::format("offset {}", first_point + i * record); });
  set.format = stream.compressed() ? "BGEO V5, gzip" : "BGEO V5";
  return set;
}

}  // namespace embrun
