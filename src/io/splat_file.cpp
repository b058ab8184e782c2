#include "io/splat_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <system_error>

#include "base/error.h"
#include "io/cursor.h"

namespace embrun {
namespace {

static_assert(std::endian::native == std::endian::little, "files of splats are mapped as they are");

constexpr std::string_view magic = splat_file_magic;
constexpr std::size_t alignment = splat_file_alignment;

// No padding, whose bytes would be anything.
static_assert(sizeof(SplatBlock) == 320 && sizeof(SplatNode) == 256 && sizeof(Rgb) == 12);
static_assert(sizeof(SplatFileHead) == alignment && sizeof(SplatFileTail) == 88);

std::uint64_t aligned(std::uint64_t offset) { return (offset + alignment - 1) / alignment * alignment; }

/// Where the parts of a file lie.
struct Layout {
  std::uint64_t blocks, colors, nodes, tail, end;

  explicit Layout(const SplatFileTail& t) {
    const std::uint64_t lanes = (std::uint64_t{t.splat_blocks} + t.node_count) * splats_per_block;
    blocks = sizeof(SplatFileHead);
    colors = blocks + lanes / splats_per_block * sizeof(SplatBlock);
    nodes = aligned(colors + (t.has_colors != 0 ? lanes * sizeof(Rgb) : 0));
    tail = nodes + t.node_count * sizeof(SplatNode);
    end = tail + sizeof(SplatFileTail);
  }
};

[[noreturn]] void fail(std::string_view name, std::uint64_t offset, std::string_view what, const std::string& message) {
  fail_in_file(name, fmt::format("offset {}", offset), what, message);
}

SplatFileTail read_tail(std::span<const std::byte> file, std::string_view name) {
  SplatFileHead head;
  if (file.size() < sizeof head + sizeof(SplatFileTail))
    fail(name, file.size(), "", "the file ends here, before a file of splats could");
  std::memcpy(&head, file.data(), sizeof head);
  if (std::string_view(head.magic, sizeof head.magic) != magic) fail(name, 0, "", "this is no file of splats");
  if (head.byte_order != SplatFileHead{}.byte_order)
    fail(name, 12, "byte order", "the file is damaged, or of another kind of machine");
  if (const std::uint32_t version = SplatFileHead{}.version; head.version != version)
    fail(name, 8, "version", fmt::format("{}, but this program reads {}; make the file anew", head.version, version));
  SplatFileTail tail;
  const std::size_t at = file.size() - sizeof tail;
  std::memcpy(&tail, file.data() + at, sizeof tail);
  if (std::string_view(tail.magic, sizeof tail.magic) != magic)
    fail(name, at, "", "the file does not end as a file of splats does: it is cut off or damaged");
  return tail;
}

void check_tail(const SplatFileTail& tail, std::size_t size, std::string_view name) {
  const std::uint64_t at = size - sizeof tail;
  if (tail.splat_blocks == 0 || tail.node_count == 0 || tail.splat_count == 0)
    fail(name, at, "counts", "there are none");
  // Numbers of splats and stand-ins have 32 bits, links to blocks 31.
  if (tail.splat_blocks >= splat_leaf / splats_per_block || tail.node_count >= splat_leaf / splats_per_block)
    fail(name, at, "counts", fmt::format("{} blocks and {} nodes are too many", tail.splat_blocks, tail.node_count));
  if (tail.splat_count > std::uint64_t{tail.splat_blocks} * splats_per_block)
    fail(name, at, "counts", fmt::format("{} splats do not fit into {} blocks", tail.splat_count, tail.splat_blocks));
  if (tail.has_colors > 1 || tail.closed > 1) fail(name, at, "flags", "they are neither 0 nor 1");
  const Layout layout(tail);
  if (layout.end != size)
    fail(name, at, "counts", fmt::format("a file of those takes {} bytes, but this has {}", layout.end, size));
  for (int axis = 0; axis < 3; ++axis)
    if (!std::isfinite(tail.center[axis]) || !is_finite(tail.low[axis]) || !is_finite(tail.high[axis]) ||
        tail.low[axis] > tail.high[axis])
      fail(name, at, "bounds", "they are not finite, or the wrong way round");
  if (!(tail.median_radius > 0) || !is_finite(tail.median_radius)) fail(name, at, "radius", "it is not positive");
}

/// True where a child that there is not has the box that no ray meets. Others might be met all the same, as searches look at
/// all three axes and in any order.
bool is_empty_box(const SplatNode& node, std::uint32_t i) {
  const Box3 empty;
  for (int axis = 0; axis < 3; ++axis)
    if (node.face[axis][0][i] != empty.low[axis] || node.face[axis][1][i] != empty.high[axis]) return false;
  return true;
}

/// Follows every link once: each must lead to an earlier node or to a block, none to where another led, and no way be longer
/// than the search has room for.
void check_links(const SplatHierarchy& splats, std::uint64_t offset, std::string_view name) {
  constexpr int most_levels = 36;
  std::vector<std::uint8_t> levels(splats.node_count);
  std::vector<bool> led_to_node(splats.node_count), led_to_block(splats.splat_blocks);
  for (std::uint32_t n = 0; n < splats.node_count; ++n) {
    const SplatNode& node = splats.nodes[n];
    int below = 0;
    for (std::uint32_t i = 0; i < splat_tree_width; ++i) {
      if (!has_child(node, i)) {
        if (!is_empty_box(node, i))
          fail(name, offset + n * sizeof(SplatNode), fmt::format("node {}", n),
               fmt::format("the box of child {} is neither one nor empty", i));
        continue;
      }
      const bool leaf = (node.child[i] & splat_leaf) != 0;
      const std::uint32_t child = node.child[i] & ~splat_leaf;
      const auto refuse = [&](const char* why) {
        fail(name, offset + n * sizeof(SplatNode), fmt::format("node {}", n),
             fmt::format("child {} is {} {}, {}", i, leaf ? "block" : "node", child, why));
      };
      if (child >= (leaf ? splats.splat_blocks : n)) refuse(leaf ? "which there is not" : "which does not come before");
      std::vector<bool>& led_to = leaf ? led_to_block : led_to_node;
      if (led_to[child]) refuse("which has another parent");
      led_to[child] = true;
      if (!leaf) below = std::max<int>(below, levels[child]);
    }
    if (below == most_levels) fail(name, offset + n * sizeof(SplatNode), fmt::format("node {}", n), "it lies too deep");
    levels[n] = static_cast<std::uint8_t>(below + 1);
  }
}

/// A file in memory that goes when nobody looks at it any more.
class Mapping {
 public:
  explicit Mapping(const std::string& path) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    struct stat status {};
    const bool good = descriptor >= 0 && ::fstat(descriptor, &status) == 0;
    if (good && S_ISREG(status.st_mode) && status.st_size > 0) {
      size_ = static_cast<std::size_t>(status.st_size);
      data_ = ::mmap(nullptr, size_, PROT_READ, MAP_SHARED, descriptor, 0);
    }
    const int error = errno;
    if (descriptor >= 0) ::close(descriptor);
    if (!good || data_ == MAP_FAILED)
      throw Error(fmt::format("{}: cannot open: {}", path, std::generic_category().message(error)));
    if (data_ == nullptr) throw Error(fmt::format("{}: is empty, or not a regular file", path));
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping() {
    if (data_ != nullptr && data_ != MAP_FAILED) ::munmap(data_, size_);
  }
  std::span<const std::byte> bytes() const { return {static_cast<const std::byte*>(data_), size_}; }
  /// Nothing of it need stay in memory: what was looked at is not what rays will come by.
  void let_go() const { ::madvise(data_, size_, MADV_DONTNEED); }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

struct MappedHierarchy {
  Mapping mapping;
  SplatHierarchy splats;

  explicit MappedHierarchy(const std::string& path) : mapping(path), splats(view_splat_file(mapping.bytes(), path)) {
    mapping.let_go();
  }
};

}  // namespace

bool is_splat_file(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  std::array<char, 8> start{};
  const ssize_t count = ::read(descriptor, start.data(), start.size());
  ::close(descriptor);
  return count == static_cast<ssize_t>(start.size()) && std::string_view(start.data(), start.size()) == magic;
}

SplatHierarchy view_splat_file(std::span<const std::byte> file, std::string_view name) {
  const SplatFileTail tail = read_tail(file, name);
  check_tail(tail, file.size(), name);
  EMBRUN_CHECK(reinterpret_cast<std::uintptr_t>(file.data()) % alignment == 0);
  const Layout layout(tail);
  SplatHierarchy splats;
  splats.blocks = reinterpret_cast<const SplatBlock*>(file.data() + layout.blocks);
  if (tail.has_colors != 0) splats.colors = reinterpret_cast<const Rgb*>(file.data() + layout.colors);
  splats.nodes = reinterpret_cast<const SplatNode*>(file.data() + layout.nodes);
  splats.splat_blocks = tail.splat_blocks;
  splats.node_count = tail.node_count;
  splats.splat_count = tail.splat_count;
  splats.center = {tail.center[0], tail.center[1], tail.center[2]};
  splats.bounds = {{tail.low[0], tail.low[1], tail.low[2]}, {tail.high[0], tail.high[1], tail.high[2]}};
  splats.median_radius = tail.median_radius;
  splats.closed = tail.closed != 0;
  check_links(splats, layout.nodes, name);
  return splats;
}

std::shared_ptr<const SplatHierarchy> open_splat_file(const std::string& path) {
  const auto mapped = std::make_shared<MappedHierarchy>(path);
  return {mapped, &mapped->splats};
}

}  // namespace embrun
