#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace embrun {

/// A file without a name, gone when this object is, however the program ends. Appended to, then read anywhere.
class ScratchFile {
 public:
  /// In a folder. Throws Error, naming it, where no file can be made there; so do the others when the disk is full.
  explicit ScratchFile(const std::filesystem::path& folder);
  ScratchFile(ScratchFile&& other) noexcept;
  ScratchFile& operator=(ScratchFile&&) = delete;
  ~ScratchFile();

  void append(std::span<const std::byte> bytes);
  template <class T>
  void append_all(std::span<const T> values) {
    append(std::as_bytes(values));
  }
  std::uint64_t size() const { return written_ + buffer_.size(); }

  /// Fills `out` from a place within what was appended.
  void read(std::uint64_t offset, std::span<std::byte> out);

 private:
  std::string folder_;
  int descriptor_ = -1;
  std::uint64_t written_ = 0;
  std::vector<std::byte> buffer_;

  void flush();
};

}  // namespace embrun
