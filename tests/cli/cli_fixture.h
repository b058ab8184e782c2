#pragma once

// The program as a shell meets it, in a folder of its own.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace embrun {

namespace fs = std::filesystem;

inline std::string content_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

class Cli : public ::testing::Test {
 protected:
  fs::path folder;

  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    // Tests of another build may run at the same time.
    folder = fs::path(::testing::TempDir()) / ("embrun_cli_" + std::string(test->test_suite_name()) + "_" +
                                               test->name() + "_" + std::to_string(getpid()));
    fs::remove_all(folder);
    fs::create_directories(folder);
    // A cube of water and a drop above it.
    std::ofstream particles(folder / "water.xyz");
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        for (int k = 0; k < 6; ++k) particles << 0.1 * i << ' ' << 0.1 * j << ' ' << 0.1 * k << '\n';
    particles << "0.3 0.9 0.3\n";
  }
  void TearDown() override { fs::remove_all(folder); }

  std::string path(const std::string& name) const { return (folder / name).string(); }

  Outcome run(const std::string& arguments, const std::string& environment = "") const {
    const std::string command = "cd '" + folder.string() + "' && " + environment + " '" EMBRUN_CLI "' " + arguments +
                                " >out.txt 2>err.txt </dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), content_of(folder / "out.txt"),
            content_of(folder / "err.txt")};
  }
  /// Runs a render that must be refused, and says nothing was written.
  void expect_refused(const std::string& arguments, int exit_code, const std::string& message) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments << "\n" << outcome.err;
    EXPECT_FALSE(fs::exists(folder / "x.png")) << arguments;
  }

  const std::string small = " --size 32x24 --spp 2 --order 2 ";
};

}  // namespace embrun
