#include "io/atomic_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <string>
#include <vector>

#include "base/error.h"
#include "image/scratch_folder.h"

namespace embrun {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> as_bytes(const std::string& text) { return std::as_bytes(std::span(text)); }

TEST(AtomicFile, WritesReplacesAndLeavesNothingElse) {
  const ScratchFolder folder;
  write_file_atomically(folder / "a.bin", as_bytes("first"));
  EXPECT_EQ(content_of(folder / "a.bin"), "first");
  write_file_atomically(folder / "a.bin", as_bytes("second, longer"));
  EXPECT_EQ(content_of(folder / "a.bin"), "second, longer");
  write_file_atomically(folder / "empty", {});
  EXPECT_EQ(folder.files(), (std::vector<std::string>{"a.bin", "empty"}));
}

TEST(AtomicFile, AFailingWriteLeavesTheOldFileAndNoTemporary) {
  const ScratchFolder folder;
  write_file_atomically(folder / "a.bin", as_bytes("old"));
  // A limit on the size of files makes the write fail half-way, as a full disk does.
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit low = before;
  low.rlim_cur = 4096;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &low), 0);
  std::string message;
  try {
    write_file_atomically(folder / "a.bin", as_bytes(std::string(100000, 'x')));
  } catch (const Error& e) {
    message = e.what();
  }
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_NE(message.find("a.bin"), std::string::npos) << message;
  EXPECT_NE(message.find(std::strerror(EFBIG)), std::string::npos) << message;
  EXPECT_EQ(content_of(folder / "a.bin"), "old");
  EXPECT_EQ(folder.files(), std::vector<std::string>{"a.bin"});
}

TEST(AtomicFile, FollowsALinkInsteadOfReplacingIt) {
  const ScratchFolder folder;
  fs::create_directory(folder / "real");
  write_file_atomically(folder / "real" / "a.bin", as_bytes("old"));
  fs::create_symlink(folder / "real" / "a.bin", folder / "link.bin");
  write_file_atomically(folder / "link.bin", as_bytes("new"));
  EXPECT_TRUE(fs::is_symlink(folder / "link.bin"));
  EXPECT_EQ(content_of(folder / "real" / "a.bin"), "new");
}

TEST(AtomicFile, SaysWhyAPathCannotBeWritten) {
  const ScratchFolder folder;
  const auto message_for = [](const fs::path& path) {
    try {
      check_writable(path);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_NE(message_for(folder / "missing" / "a.png").find("does not exist"), std::string::npos);
  write_file_atomically(folder / "file", as_bytes("x"));
  EXPECT_NE(message_for(folder / "file" / "a.png").find("is not a folder"), std::string::npos);
  fs::create_directory(folder / "sub.png");
  EXPECT_NE(message_for(folder / "sub.png").find("it is a folder"), std::string::npos);
  EXPECT_NE(message_for("/dev/null").find("not a regular file"), std::string::npos);
  EXPECT_NE(message_for(fs::path()).find("no file name"), std::string::npos);
  EXPECT_EQ(message_for(folder / "new.png"), "no error");
  EXPECT_EQ(message_for("name-without-folder.png"), "no error");
  if (::geteuid() != 0) {  // permissions do not bind root
    fs::permissions(folder / "sub.png", fs::perms::owner_read | fs::perms::owner_exec);
    EXPECT_NE(message_for(folder / "sub.png" / "a.png").find("cannot be written to"), std::string::npos);
    fs::permissions(folder / "sub.png", fs::perms::owner_all);
  }
}

TEST(AtomicFile, NewFilesHaveTheUsersUsualPermissions) {
  const ScratchFolder folder;
  const mode_t mask = ::umask(022);
  write_file_atomically(folder / "a.bin", as_bytes("x"));
  ::umask(mask);
  EXPECT_EQ(fs::status(folder / "a.bin").permissions(), fs::perms(0644));
}

}  // namespace
}  // namespace embrun
