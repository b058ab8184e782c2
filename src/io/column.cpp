#include "io/column.h"

#include <cmath>
#include <cstring>
#include <limits>

#include "base/error.h"
#include "io/text.h"

namespace embrun {

namespace {

template <std::size_t size>
struct UnsignedOf;
template <>
struct UnsignedOf<1> {
  using Type = std::uint8_t;
};
template <>
struct UnsignedOf<2> {
  using Type = std::uint16_t;
};
template <>
struct UnsignedOf<4> {
  using Type = std::uint32_t;
};
template <>
struct UnsignedOf<8> {
  using Type = std::uint64_t;
};

template <class Value>
Value load(const std::byte* bytes, bool big_endian) {
  using Bits = typename UnsignedOf<sizeof(Value)>::Type;
  Bits bits;
  std::memcpy(&bits, bytes, sizeof bits);
  if (big_endian) {
    if constexpr (sizeof(Bits) == 2) bits = static_cast<Bits>(__builtin_bswap16(bits));
    if constexpr (sizeof(Bits) == 4) bits = __builtin_bswap32(bits);
    if constexpr (sizeof(Bits) == 8) bits = __builtin_bswap64(bits);
  }
  Value value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

// Calls f with a value of the C++ type that `type` stands for.
template <class F>
auto visit(ScalarType type, const F& f) {
  switch (type) {
    case ScalarType::int8: return f(std::int8_t{});
    case ScalarType::uint8: return f(std::uint8_t{});
    case ScalarType::int16: return f(std::int16_t{});
    case ScalarType::uint16: return f(std::uint16_t{});
    case ScalarType::int32: return f(std::int32_t{});
    case ScalarType::uint32: return f(std::uint32_t{});
    case ScalarType::int64: return f(std::int64_t{});
    case ScalarType::uint64: return f(std::uint64_t{});
    case ScalarType::float32: return f(float{});
    case ScalarType::float64: break;
  }
  return f(double{});
}

// The array of the column that holds values of type Value.
template <class Value>
auto& storage(Column& column) {
  if constexpr (std::is_same_v<Value, float>) {
    return column.floats;
  } else if constexpr (std::is_same_v<Value, double>) {
    return column.doubles;
  } else if constexpr (sizeof(Value) < 4 || std::is_same_v<Value, std::int32_t>) {
    return column.ints;
  } else {
    return column.longs;
  }
}

// The integer that `text` spells ("7", "7.0") when it is in Value's range.
template <class Value>
std::optional<std::int64_t> integer_in_range(std::string_view text) {
  if constexpr (std::is_same_v<Value, std::uint64_t>) {
    if (const auto value = parse_uint64(text)) return static_cast<std::int64_t>(*value);
    return std::nullopt;
  } else {
    std::optional<std::int64_t> value = parse_int64(text);
    if (!value) {
      const std::optional<double> number = parse_double(text);
      if (!number || !(std::abs(*number) < 0x1p53) || *number != std::floor(*number)) return std::nullopt;
      value = static_cast<std::int64_t>(*number);
    }
    if (*value < static_cast<std::int64_t>(std::numeric_limits<Value>::min())) return std::nullopt;
    if (*value > static_cast<std::int64_t>(std::numeric_limits<Value>::max())) return std::nullopt;
    return value;
  }
}

}  // namespace

std::size_t size_of(ScalarType type) {
  return visit(type, [](auto zero) { return sizeof zero; });
}

std::int64_t load_integer(const std::byte* bytes, ScalarType type, bool big_endian) {
  EMBRUN_CHECK(!is_float(type));
  return visit(type, [&](auto zero) { return static_cast<std::int64_t>(load<decltype(zero)>(bytes, big_endian)); });
}

void Column::reserve(std::size_t values) {
  visit(type, [&](auto zero) { storage<decltype(zero)>(*this).reserve(values); });
}

std::size_t Column::value_count() const { return floats.size() + doubles.size() + ints.size() + longs.size(); }

double Column::value(std::size_t i) const {
  if (!floats.empty()) return static_cast<double>(floats[i]);
  if (!doubles.empty()) return doubles[i];
  return ints.empty() ? static_cast<double>(longs[i]) : ints[i];
}

void Column::append_rows(const std::byte* first, std::size_t count, std::size_t stride, bool big_endian) {
  visit(type, [&](auto zero) {
    using Value = decltype(zero);
    auto& values = storage<Value>(*this);
    using Stored = typename std::remove_reference_t<decltype(values)>::value_type;
    for (std::size_t row = 0; row < count; ++row, first += stride) {
      for (std::size_t c = 0; c < components; ++c) {
        values.push_back(static_cast<Stored>(load<Value>(first + c * sizeof(Value), big_endian)));
      }
    }
  });
}

bool Column::append_text(std::string_view text) {
  return visit(type, [&](auto zero) {
    using Value = decltype(zero);
    auto& values = storage<Value>(*this);
    using Stored = typename std::remove_reference_t<decltype(values)>::value_type;
    if constexpr (std::is_floating_point_v<Value>) {
      const std::optional<double> number = parse_double(text);
      if (!number) return false;
      // What float cannot hold becomes infinite on purpose: the end of reading counts it as non-finite.
      const bool overflow = std::abs(*number) > static_cast<double>(std::numeric_limits<Value>::max());
      values.push_back(overflow ? std::numeric_limits<Value>::infinity() : static_cast<Value>(*number));
    } else {
      const std::optional<std::int64_t> number = integer_in_range<Value>(text);
      if (!number) return false;
      values.push_back(static_cast<Stored>(*number));
    }
    return true;
  });
}

}  // namespace embrun
