#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace embrun {

/// The number that all of `text` spells, in any locale's absence; a leading '+' is allowed, "inf" and "nan" are
/// numbers, what overflows is infinite and what underflows is 0. Nothing when it is not a number.
std::optional<double> parse_double(std::string_view text);

/// The integer that all of `text` spells (a leading '+' is allowed); nothing when it is not one or leaves int64.
std::optional<std::int64_t> parse_int64(std::string_view text);

/// As parse_int64, for [0, 2^64).
std::optional<std::uint64_t> parse_uint64(std::string_view text);

/// `text` between quotes for an error message: at most 40 characters, what is not printable as '?'.
std::string quoted(std::string_view text);

/// `text` with '?' for control characters, which would upset a terminal.
std::string printable(std::string_view text);

std::string to_lower(std::string_view text);

/// Blank, tab and the line terminators.
inline bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

std::string_view trimmed(std::string_view text);

/// Takes the first token (up to a blank) off `text`; empty when there is none.
std::string_view take_token(std::string_view& text);

}  // namespace embrun
