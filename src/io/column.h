#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "particles/particle_set.h"

namespace embrun {

/// Type of a number in a file.
enum class ScalarType { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

std::size_t size_of(ScalarType type);
inline bool is_float(ScalarType type) { return type == ScalarType::float32 || type == ScalarType::float64; }

/// One integer of type `type` at `bytes`. An uint64 above the greatest int64 wraps to a negative value of the same
/// bits; a floating-point type is a programmer's error.
std::int64_t load_integer(const std::byte* bytes, ScalarType type, bool big_endian);

/// A named array as a file has it, `components` values a row, before it becomes positions or an attribute.
/// The values lie in `floats` (float32), `doubles` (float64), `ints` (int8 ... int32, uint8, uint16) or `longs`.
struct Column {
  std::string name;
  std::string file_name;  ///< see Attribute::file_name
  ScalarType type = ScalarType::float32;
  std::size_t components = 1;
  std::vector<float> floats;
  std::vector<double> doubles;
  std::vector<std::int32_t> ints;
  std::vector<std::int64_t> longs;
  std::vector<std::string> strings;  ///< text that `ints` indexes into, for a text attribute
  std::size_t missing = 0;           ///< integers that the file leaves out, stored as 0
  double full_scale = 0;             ///< for a colour: the stored value that means 1; 0: from the type

  void reserve(std::size_t values);
  std::size_t value_count() const;
  /// Value i as a double; int64 may be rounded.
  double value(std::size_t i) const;
  /// Appends `count` rows; a row's values are adjacent, and rows start `stride` bytes apart.
  void append_rows(const std::byte* first, std::size_t count, std::size_t stride, bool big_endian);
  /// Appends a number in text; false when it is none or does not fit the type.
  bool append_text(std::string_view text);
};

/// Where row i of the table is in the file: "line 18", "offset 3600".
using RowPlace = std::function<std::string(std::size_t row)>;

/// Makes particles of a table whose columns all have `rows` rows.
///
/// - Positions: the column "position" with 3 components, else the columns x, y, z (or a usual variant of those).
/// - Scalar columns that are components of one vector are joined: vx,vy,vz; nx,ny,nz; red,green,blue; "name_x" ...
/// - Known aliases get the name that the renderer looks for (v, vel -> velocity; Cd -> color; pscale -> radius; N ->
///   normal; ...), the file's name staying in Attribute::file_name. velocity, density, radius, normal and color are
///   always float; integer colours are scaled to 0...1.
/// - double attributes are rounded to float; integers are kept exactly (int32, or int64 where needed), except that
///   an uint64 above 2^63 - 1 wraps to the negative int64 of the same bits, with a note.
/// - Particles with a non-finite coordinate are dropped and counted; other non-finite values become 0 and are counted.
///
/// Throws Error naming `file` and the place when there is no position column, no particle, none with a finite
/// position, or a coordinate beyond 1e15 m (whose differences single precision could not square).
ParticleSet particles_from_columns(std::string_view file, std::size_t rows, std::vector<Column> columns,
                                   const RowPlace& place);

/// The greatest magnitude of a coordinate that readers accept, metres.
inline constexpr double max_coordinate = 1e15;

/// The most attributes a file may have: a limit far above real files that keeps damaged ones from costing memory.
inline constexpr std::size_t max_columns = 4096;

}  // namespace embrun
