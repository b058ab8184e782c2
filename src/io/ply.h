#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/column.h"
#include "io/cursor.h"

namespace embrun {

struct PlyProperty {
  std::string name;
  ScalarType type = ScalarType::float32;
  bool is_list = false;
  ScalarType count_type = ScalarType::uint8;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

/// What the rows of an element hold.
struct PlyRows {
  std::vector<Column> columns;  ///< one per scalar property, in order
  RowPlace place;               ///< valid while the file is
};

/// Called with a row's values of one integer list property.
using PlyListSink = std::function<void(std::span<const std::int64_t> values)>;

/// A PLY file in memory: the header when constructed, then its elements in the order of the file.
/// Throws Error naming line or offset for whatever is wrong.
class PlyFile {
 public:
  PlyFile(std::span<const std::byte> file, std::string_view name);

  const std::vector<PlyElement>& elements() const { return elements_; }
  /// "PLY ascii", "PLY binary little-endian", ...
  std::string format() const;
  /// The index of an element, or elements().size().
  std::size_t find(std::string_view element) const;
  const Cursor& cursor() const { return cursor_; }

  /// Reads the next element. List properties are passed over, except the integer list `wanted_list` (a property index),
  /// whose rows go to `sink`.
  PlyRows read(std::size_t wanted_list = no_list, const PlyListSink& sink = {});
  /// Passes over the next element.
  void skip();

  static constexpr std::size_t no_list = ~std::size_t{0};

 private:
  enum class Encoding { ascii, little, big };
  Cursor cursor_;
  Encoding encoding_ = Encoding::ascii;
  std::vector<PlyElement> elements_;
  std::size_t next_ = 0;

  void read_header();
  void read_format(std::string_view line);
  void read_property(std::string_view line);
  void read_ascii(const PlyElement& element, PlyRows& rows, std::size_t wanted_list, const PlyListSink& sink);
  void read_fixed_binary(const PlyElement& element, PlyRows& rows);
  void read_list_binary(const PlyElement& element, PlyRows& rows, std::size_t wanted_list, const PlyListSink& sink);
};

}  // namespace embrun
