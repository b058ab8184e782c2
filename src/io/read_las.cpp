#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "io/column.h"
#include "io/cursor.h"
#include "io/particle_readers.h"
#include "io/text.h"

namespace embrun {

namespace {

// Layout: LAS specification 1.4 R15 of the ASPRS, tables 3 and 7 to 17; little-endian throughout.
constexpr std::size_t least_header = 227, header_1_4 = 375;

/// Where a point record of a format has what; 0: nowhere.
struct RecordLayout {
  std::size_t bytes = 0;
  std::size_t classification = 15;
  std::size_t scan_angle = 16;
  std::size_t user_data = 17;
  std::size_t source_id = 18;
  std::size_t gps_time = 0;
  std::size_t colour = 0;
  std::size_t near_infrared = 0;
  bool extended = false;  ///< formats 6 and up: wider fields for returns, classes and angles
  bool waveform = false;
};

constexpr std::array<RecordLayout, 11> layouts{{
    {20},
    {28, 15, 16, 17, 18, 20},
    {26, 15, 16, 17, 18, 0, 20},
    {34, 15, 16, 17, 18, 20, 28},
    {57, 15, 16, 17, 18, 20, 0, 0, false, true},
    {63, 15, 16, 17, 18, 20, 28, 0, false, true},
    {30, 16, 18, 17, 20, 22, 0, 0, true},
    {36, 16, 18, 17, 20, 22, 30, 0, true},
    {38, 16, 18, 17, 20, 22, 30, 36, true},
    {59, 16, 18, 17, 20, 22, 0, 0, true, true},
    {67, 16, 18, 17, 20, 22, 30, 36, true, true},
}};

class LasReader {
 public:
  LasReader(std::span<const std::byte> file, std::string_view name) : file_(file), cursor_(file, name) {
    cursor_.set_binary();
  }

  ParticleSet read() {
    read_header();
    cursor_.take(first_);
    cursor_.require(count_, record_, "points");
    const std::byte* points = cursor_.take(count_ * record_).data();
    std::vector<Column> columns = read_columns(points);
    const std::size_t first = first_, record = record_;
    ParticleSet set =
        particles_from_columns(cursor_.file(), count_, std::move(columns),
                               [first, record](std::size_t i) { return fmt::format("offset {}", first + i * record); });
    set.format = fmt::format("LAS {}.{}, point format {}", major_, minor_, format_);
    set.notes.insert(set.notes.begin(), notes_.begin(), notes_.end());
    return set;
  }

 private:
  std::span<const std::byte> file_;
  Cursor cursor_;
  int major_ = 0, minor_ = 0;
  std::size_t format_ = 0, record_ = 0, first_ = 0, count_ = 0;
  RecordLayout layout_;
  std::array<double, 3> scale_{}, offset_{};
  std::vector<std::string> notes_;

  [[noreturn]] void fail(std::size_t offset, std::string_view what, std::string_view message) const {
    fail_in_file(cursor_.file(), fmt::format("offset {}", offset), what, message);
  }
  std::uint64_t integer(std::size_t offset, ScalarType type) const {
    return static_cast<std::uint64_t>(load_integer(file_.data() + offset, type, false));
  }

  void read_header() {
    cursor_.require(1, least_header, "header");
    major_ = static_cast<int>(integer(24, ScalarType::uint8));
    minor_ = static_cast<int>(integer(25, ScalarType::uint8));
    if (major_ != 1 || minor_ > 4) {
      fail(24, "version", fmt::format("LAS {}.{} is not supported, only 1.0 to 1.4", major_, minor_));
    }
    if (minor_ == 4) cursor_.require(1, header_1_4, "header");
    read_format();
    first_ = static_cast<std::size_t>(integer(96, ScalarType::uint32));
    const std::size_t header = minor_ == 4 ? header_1_4 : least_header;
    if (first_ < header || first_ > file_.size()) {
      fail(96, "offset to the points", fmt::format("{} is not in the file of {} bytes", first_, file_.size()));
    }
    // Version 1.4 has a wider count; the old one is 0 where it does not fit.
    std::uint64_t count = integer(107, ScalarType::uint32);
    if (const std::uint64_t wide = minor_ == 4 ? integer(247, ScalarType::uint64) : 0; wide > 0) count = wide;
    if (count == 0) fail(107, "number of points", no_particles);
    if (count > std::numeric_limits<std::uint32_t>::max()) {
      fail(247, "number of points", fmt::format("{}: more than 2^32 - 1 are not supported", count));
    }
    count_ = static_cast<std::size_t>(count);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      scale_[axis] = real(131 + 8 * axis, "scale factor");
      offset_[axis] = real(155 + 8 * axis, "offset");
      if (scale_[axis] == 0) fail(131 + 8 * axis, "scale factor", "it is 0");
    }
  }

  void read_format() {
    format_ = static_cast<std::size_t>(integer(104, ScalarType::uint8));
    constexpr std::size_t packed_by_laszip = 128;
    if (format_ >= packed_by_laszip) {
      fail(104, "point format", "the points are packed (LAZ), which is not read; unpack them first (laszip, pdal)");
    }
    if (format_ >= layouts.size()) fail(104, "point format", fmt::format("{} is not one of 0 to 10", format_));
    layout_ = layouts[format_];
    record_ = static_cast<std::size_t>(integer(105, ScalarType::uint16));
    if (record_ < layout_.bytes) {
      fail(105, "point record length",
           fmt::format("{} bytes, but points of format {} take {}", record_, format_, layout_.bytes));
    }
    if (record_ > layout_.bytes) {
      notes_.push_back(fmt::format("{} extra bytes of each point were left out", record_ - layout_.bytes));
    }
    if (layout_.waveform) notes_.push_back("wave packets were left out");
  }

  double real(std::size_t offset, std::string_view what) {
    Column value;
    value.type = ScalarType::float64;
    value.append_rows(file_.data() + offset, 1, 8, false);
    if (!std::isfinite(value.doubles[0])) fail(offset, what, "it is not finite");
    return value.doubles[0];
  }

  std::vector<Column> read_columns(const std::byte* points) {
    std::vector<Column> columns;
    columns.push_back(read_positions(points));
    columns.push_back(stored(points, "intensity", 12, ScalarType::uint16));
    add_flags(points, columns);
    columns.push_back(read_angles(points));
    columns.push_back(stored(points, "user_data", layout_.user_data, ScalarType::uint8));
    columns.push_back(stored(points, "point_source_id", layout_.source_id, ScalarType::uint16));
    if (layout_.gps_time) columns.push_back(read_times(points));
    if (layout_.colour) columns.push_back(read_colours(points));
    if (layout_.near_infrared) {
      columns.push_back(stored(points, "near_infrared", layout_.near_infrared, ScalarType::uint16));
    }
    return columns;
  }

  Column stored(const std::byte* points, std::string name, std::size_t at, ScalarType type, std::size_t parts = 1) {
    Column column;
    column.name = std::move(name);
    column.type = type;
    column.components = parts;
    column.reserve(count_ * parts);
    column.append_rows(points + at, count_, record_, false);
    return column;
  }

  Column read_positions(const std::byte* points) {
    const Column steps = stored(points, "", 0, ScalarType::int32, 3);
    Column column;
    column.name = "position";
    column.type = ScalarType::float64;
    column.components = 3;
    column.reserve(3 * count_);
    for (std::size_t i = 0; i < 3 * count_; ++i) {
      column.doubles.push_back(static_cast<double>(steps.ints[i]) * scale_[i % 3] + offset_[i % 3]);
    }
    return column;
  }

  // Bits `shift` and up of the byte at `at`, under `mask`.
  Column bits(const std::byte* points, std::string name, std::size_t at, int shift, std::int32_t mask) {
    Column column = stored(points, std::move(name), at, ScalarType::uint8);
    for (std::int32_t& value : column.ints) value = value >> shift & mask;
    return column;
  }

  void add_flags(const std::byte* points, std::vector<Column>& columns) {
    const bool wide = layout_.extended;
    const int returns = wide ? 4 : 3;
    const std::int32_t return_mask = wide ? 15 : 7;
    columns.push_back(bits(points, "return_number", 14, 0, return_mask));
    columns.push_back(bits(points, "number_of_returns", 14, returns, return_mask));
    columns.push_back(bits(points, "classification", layout_.classification, 0, wide ? 255 : 31));
    // Synthetic, key point, withheld (which means deleted) and, in the newer formats, overlap.
    Column flags = wide ? bits(points, "classification_flags", 15, 0, 15)
                        : bits(points, "classification_flags", layout_.classification, 5, 7);
    const auto withheld = [](std::int32_t f) { return (f & 4) != 0; };
    const auto count = std::count_if(flags.ints.begin(), flags.ints.end(), withheld);
    if (count > 0) notes_.push_back(fmt::format("{} points are marked as withheld; they were kept", count));
    columns.push_back(std::move(flags));
    if (wide) columns.push_back(bits(points, "scanner_channel", 15, 4, 3));
  }

  // Degrees: whole ones, or steps of 0.006.
  Column read_angles(const std::byte* points) {
    const Column steps =
        stored(points, "", layout_.scan_angle, layout_.extended ? ScalarType::int16 : ScalarType::int8);
    Column column;
    column.name = "scan_angle";
    column.reserve(count_);
    for (const std::int32_t step : steps.ints) {
      column.floats.push_back(static_cast<float>(layout_.extended ? 0.006 * step : step));
    }
    return column;
  }

  // Whole nanoseconds: finer than the doubles of the file, which floats would round to half a minute.
  Column read_times(const std::byte* points) {
    const Column seconds = stored(points, "", layout_.gps_time, ScalarType::float64);
    Column column;
    column.name = "gps_time_ns";
    column.file_name = "gps_time";
    column.type = ScalarType::int64;
    column.reserve(count_);
    for (const double time : seconds.doubles) {
      constexpr double greatest = 9e9;  // seconds that int64 can count in nanoseconds
      if (std::abs(time) <= greatest) {
        column.longs.push_back(std::llround(time * 1e9));
      } else {
        column.longs.push_back(0);
        ++column.missing;
      }
    }
    return column;
  }

  // 16 bits; but many programs leave their 8 bits in the lower byte.
  Column read_colours(const std::byte* points) {
    Column column = stored(points, "color", layout_.colour, ScalarType::uint16, 3);
    column.file_name = "red,green,blue";
    const std::int32_t greatest = *std::max_element(column.ints.begin(), column.ints.end());
    if (greatest > 0 && greatest <= 255) {
      column.full_scale = 255;
      notes_.push_back("no colour is above 255: they were taken as 8 bits");
    }
    return column;
  }
};

}  // namespace

ParticleSet read_las(std::span<const std::byte> file, std::string_view name) { return LasReader(file, name).read(); }

}  // namespace embrun
