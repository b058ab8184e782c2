#include "io/file_bytes.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "base/error.h"

namespace embrun {

namespace {

/// Closes a file descriptor at the end of its scope.
struct Descriptor {
  int number;
  explicit Descriptor(int fd) : number(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
};

[[noreturn]] void fail(const std::string& path, const char* what) {
  throw Error(fmt::format("{}: {}: {}", path, what, std::strerror(errno)));
}

}  // namespace

std::vector<std::byte> read_file_bytes(const std::string& path) {
  // Non-blocking, so that opening a pipe without a writer does not wait for one.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number < 0) fail(path, "cannot open");
  struct stat status;
  if (::fstat(file.number, &status) != 0) fail(path, "cannot open");
  if (S_ISDIR(status.st_mode)) throw Error(fmt::format("{}: is a directory, not a file", path));
  if (!S_ISREG(status.st_mode)) throw Error(fmt::format("{}: is not a regular file", path));

  std::vector<std::byte> bytes(static_cast<std::size_t>(status.st_size));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t count = ::read(file.number, bytes.data() + done, bytes.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail(path, "cannot read");
    if (count == 0) throw Error(fmt::format("{}: offset {}: the file became shorter while it was read", path, done));
    done += static_cast<std::size_t>(count);
  }
  return bytes;
}

}  // namespace embrun
