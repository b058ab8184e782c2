// The operator new of base/huge_pages.cpp, which this program links.
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <sstream>
#include <string>
#include <vector>

namespace embrun {
namespace {

constexpr std::size_t huge_page = std::size_t{2} << 20;

std::uintptr_t address_of(const void* memory) { return reinterpret_cast<std::uintptr_t>(memory); }

/// Whether the system was advised to put the page of `memory` on a huge one ("hg" in its flags, proc_pid_smaps(5)).
bool is_advised(const void* memory) {
  std::ifstream smaps("/proc/self/smaps");
  bool inside = false;
  for (std::string line; std::getline(smaps, line);) {
    std::uintptr_t begin = 0, end = 0;
    char dash = 0;
    std::istringstream words(line);
    if (words >> std::hex >> begin >> dash >> end && dash == '-')
      inside = begin <= address_of(memory) && address_of(memory) < end;
    if (inside && line.starts_with("VmFlags:")) return line.find(" hg") != std::string::npos;
  }
  return false;
}

TEST(HugePages, HoldLargeArrays) {
  if (!std::filesystem::exists("/sys/kernel/mm/transparent_hugepage")) GTEST_SKIP() << "no huge pages here";
  const std::vector<double> array(1 << 20);
  EXPECT_EQ(address_of(array.data()) % huge_page, 0u);
  EXPECT_TRUE(is_advised(array.data()));
  EXPECT_TRUE(is_advised(&array.back()));
}

TEST(HugePages, EndOfAnArrayIsOnOneToo) {
  if (!std::filesystem::exists("/sys/kernel/mm/transparent_hugepage")) GTEST_SKIP() << "no huge pages here";
  struct alignas(64) Line {
    char bytes[64];
  };
  // A little more than one page.
  const std::vector<Line> array(huge_page / sizeof(Line) + 5);
  EXPECT_EQ(address_of(array.data()) % huge_page, 0u);
  EXPECT_TRUE(is_advised(&array.back()));
}

TEST(HugePages, LeaveSmallArraysAlone) {
  const auto array = std::make_unique<char[]>(1000);
  EXPECT_FALSE(is_advised(array.get()));
  struct alignas(256) Aligned {
    char byte;
  };
  const std::vector<std::unique_ptr<Aligned>> many = [] {
    std::vector<std::unique_ptr<Aligned>> made(100);
    for (auto& one : made) one = std::make_unique<Aligned>();
    return made;
  }();
  for (const auto& one : many) EXPECT_EQ(address_of(one.get()) % 256, 0u);
  EXPECT_NE(std::unique_ptr<char[]>(new char[0]).get(), nullptr);
}

TEST(HugePages, SayWhenMemoryIsOut) {
  // Volatile, or the compiler warns of what is the point here.
  const volatile std::size_t too_much = std::numeric_limits<std::size_t>::max() / 4;
  const volatile std::size_t all = std::numeric_limits<std::size_t>::max() - 1;
  EXPECT_THROW(static_cast<void>(std::vector<char>(too_much)), std::bad_alloc);
  EXPECT_EQ(::operator new(too_much, std::nothrow), nullptr);
  EXPECT_THROW(static_cast<void>(::operator new(all)), std::bad_alloc);

  // A handler is asked until it gives up.
  static int calls;
  calls = 0;
  const std::new_handler before = std::set_new_handler([] {
    if (++calls == 3) std::set_new_handler(nullptr);
  });
  EXPECT_THROW(static_cast<void>(::operator new(too_much)), std::bad_alloc);
  std::set_new_handler(before);
  EXPECT_EQ(calls, 3);
}

}  // namespace
}  // namespace embrun
