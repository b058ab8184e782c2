#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace embrun {

/// Sequential reading of a binary file in memory, unpacked on the way when it is a gzip stream. Unpacked bytes are
/// never held beyond what the caller asks for, and errors name the offset in the unpacked data.
class ByteStream {
 public:
  ByteStream(std::span<const std::byte> file, std::string_view name);
  ~ByteStream();
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  bool compressed() const { return inflater_ != nullptr; }
  std::uint64_t offset() const { return offset_; }

  /// The next bytes up to the size of `out`; fewer only at the end. Throws Error when a gzip stream is damaged.
  std::size_t read_some(std::span<std::byte> out);
  /// Fills `out`, or throws Error: the file ends before `what` is complete.
  void read(std::span<std::byte> out, std::string_view what);
  void skip(std::uint64_t count, std::string_view what);

  /// Throws unless `count` things of `bytes_each` bytes (not 0) can still come: exactly so for a plain file, and for a
  /// gzip stream by the most that deflate can pack (1032 : 1).
  void require(std::uint64_t count, std::uint64_t bytes_each, std::string_view what) const;

  /// Throws Error "FILE: offset N: WHAT: MESSAGE".
  [[noreturn]] void fail(std::string_view what, std::string_view message) const;

 private:
  struct Inflater;
  std::span<const std::byte> left_;  // what was not read or unpacked yet
  std::string file_;
  std::uint64_t offset_ = 0;
  std::unique_ptr<Inflater> inflater_;

  std::uint64_t most_remaining() const;
};

/// Whether the file starts as a gzip stream does.
bool is_gzip(std::span<const std::byte> file);

}  // namespace embrun
