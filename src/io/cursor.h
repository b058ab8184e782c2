#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace embrun {

/// Walks through a file in memory that is text, binary, or text headers with binary blocks, and knows where it is:
/// errors name the line while only text was read, else the byte offset.
class Cursor {
 public:
  Cursor(std::span<const std::byte> bytes, std::string_view file);

  bool at_end() const { return offset_ >= text_.size(); }
  std::size_t offset() const { return offset_; }
  std::size_t remaining() const { return text_.size() - offset_; }
  const std::string& file() const { return file_; }

  /// The rest of the line, without its terminator (LF, CR LF or CR), which is consumed; empty at the end.
  std::string_view line();
  /// The next line that holds more than blanks, trimmed; empty at the end.
  std::string_view filled_line();
  /// The next token between blanks and line ends; empty at the end.
  std::string_view token();
  /// The next `count` bytes. Call require() first.
  std::span<const std::byte> take(std::size_t count);

  /// Throws unless `count` things of at least `bytes_each` bytes (not 0) fit into what is left.
  void require(std::uint64_t count, std::uint64_t bytes_each, std::string_view what) const;
  /// As require(), for `count` numbers in text: a digit each and a blank between them.
  void require_numbers(std::uint64_t count, std::string_view what) const;

  /// From here on the file is binary: places are given as offsets.
  void set_binary() { binary_ = true; }
  /// "line 3" of what was read last, or "offset 17" of what comes next.
  std::string place() const;
  /// Throws Error "FILE: PLACE: WHAT: MESSAGE"; `what` (an attribute, a keyword) may be empty.
  [[noreturn]] void fail(std::string_view what, std::string_view message) const;

 private:
  std::string_view text_;
  std::string file_;
  std::size_t offset_ = 0;
  std::size_t next_line_ = 1;  // number of the line that offset_ is in
  std::size_t last_line_ = 1;  // number of the line that the last line or token came from
  bool binary_ = false;

  void consume_line_end();
};

/// The message of a file that is as it should be, but for its particles.
inline constexpr std::string_view no_particles = "the file holds no particles";

/// Throws Error "FILE: PLACE: WHAT: MESSAGE"; `place` and `what` may be empty. With the message no_particles it is a
/// NoParticles.
[[noreturn]] void fail_in_file(std::string_view file, std::string_view place, std::string_view what,
                               std::string_view message);

}  // namespace embrun
