#include "io/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <string>
#include <system_error>

#include "base/error.h"

namespace embrun {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& path, const std::string& why) {
  throw Error("cannot write " + path.string() + ": " + why);
}

std::string reason(int error) { return std::generic_category().message(error); }

/// The file that a chain of symbolic links ends at, so that the rename replaces it and not the link.
fs::path behind_links(const fs::path& path) {
  std::error_code error;
  if (!fs::is_symlink(path, error)) {
    return path;
  }
  const fs::path target = fs::weakly_canonical(path, error);
  return error ? path : target;
}

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// A temporary file that removes itself unless it was renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const fs::path& target) : target_(target) {
    static std::atomic<unsigned> counter{0};
    do {
      name_ = folder_of(target) / (".embrun-" + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".tmp");
      descriptor_ = ::open(name_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    } while (descriptor_ < 0 && errno == EEXIST);
    if (descriptor_ < 0) {
      fail(target_, reason(errno));
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ >= 0) {
      ::close(descriptor_);
    }
    if (!renamed_) {
      ::unlink(name_.c_str());
    }
  }

  void write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t count = ::write(descriptor_, bytes.data(), bytes.size());
      if (count > 0) {
        bytes = bytes.subspan(static_cast<std::size_t>(count));
      } else if (count == 0 || errno != EINTR) {
        fail(target_, count == 0 ? "the system takes no more data" : reason(errno));
      }
    }
  }

  void rename_to_target() {
    // Some file systems cannot flush (EINVAL); everything else is a write that failed late.
    if (::fsync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP) {
      fail(target_, reason(errno));
    }
    const int descriptor = descriptor_;
    descriptor_ = -1;
    if (::close(descriptor) != 0 && errno != EINTR) {
      fail(target_, reason(errno));
    }
    if (::rename(name_.c_str(), target_.c_str()) != 0) {
      fail(target_, reason(errno));
    }
    renamed_ = true;
  }

 private:
  fs::path target_;
  fs::path name_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

/// Makes the rename itself durable where the system can; the content is safe either way.
void flush_folder(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    (void)::fsync(descriptor);
    ::close(descriptor);
  }
}

}  // namespace

void check_writable(const fs::path& path) {
  if (!path.has_filename()) {
    fail(path, "no file name");
  }
  const fs::path target = behind_links(path);
  const fs::path folder = folder_of(target);
  std::error_code error;
  const fs::file_status folder_status = fs::status(folder, error);
  if (!fs::exists(folder_status)) {
    fail(path, "the folder " + folder.string() + " does not exist");
  }
  if (!fs::is_directory(folder_status)) {
    fail(path, folder.string() + " is not a folder");
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) {
    fail(path, "the folder " + folder.string() + " cannot be written to: " + reason(errno));
  }
  const fs::file_status status = fs::status(target, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    fail(path, fs::is_directory(status) ? "it is a folder" : "it exists and is not a regular file");
  }
}

void write_file_atomically(const fs::path& path, std::span<const std::byte> bytes) {
  stream_file_atomically(path, [bytes](const ByteSink& sink) { sink(bytes); });
}

void stream_file_atomically(const fs::path& path, const std::function<void(const ByteSink& sink)>& fill) {
  check_writable(path);
  const fs::path target = behind_links(path);
  TemporaryFile file(target);
  fill([&file](std::span<const std::byte> bytes) { file.write(bytes); });
  file.rename_to_target();
  flush_folder(folder_of(target));
}

}  // namespace embrun
