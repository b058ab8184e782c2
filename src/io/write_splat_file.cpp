#include "io/write_splat_file.h"

#include <algorithm>
#include <array>
#include <vector>

#include "base/error.h"

namespace embrun {

SplatFileWriter::SplatFileWriter(const ByteSink& sink, const std::filesystem::path& scratch, bool has_colors)
    : sink_(sink), stand_ins_(scratch), colors_(scratch), stand_in_colors_(scratch), nodes_(scratch) {
  tail_.has_colors = has_colors;
  SplatFileHead head;
  std::copy(splat_file_magic.begin(), splat_file_magic.end(), head.magic);
  write(std::as_bytes(std::span(&head, 1)));
}

void SplatFileWriter::write(std::span<const std::byte> bytes) {
  sink_(bytes);
  written_ += bytes.size();
}

void SplatFileWriter::align() {
  const std::array<std::byte, splat_file_alignment> zeros{};
  const std::uint64_t over = written_ % splat_file_alignment;
  if (over > 0) write(std::span(zeros).first(static_cast<std::size_t>(splat_file_alignment - over)));
}

void SplatFileWriter::copy(ScratchFile& file) {
  std::vector<std::byte> piece;
  constexpr std::uint64_t most = std::uint64_t{4} << 20;
  for (std::uint64_t offset = 0; offset < file.size(); offset += piece.size()) {
    piece.resize(static_cast<std::size_t>(std::min(most, file.size() - offset)));
    file.read(offset, piece);
    write(piece);
  }
}

void SplatFileWriter::add_splats(std::span<const SplatBlock> blocks, std::span<const Rgb> colors) {
  EMBRUN_CHECK(colors.size() == (tail_.has_colors != 0 ? blocks.size() * splats_per_block : 0));
  constexpr std::size_t most = splat_leaf / splats_per_block;
  if (blocks.size() + tail_.splat_blocks >= most) throw Error("a file of splats holds fewer than 2 thousand million");
  write(std::as_bytes(blocks));
  colors_.append_all(colors);
  tail_.splat_blocks += static_cast<std::uint32_t>(blocks.size());
}

void SplatFileWriter::add_nodes(std::span<const SplatNode> nodes, std::span<const SplatBlock> stand_ins,
                                std::span<const Rgb> colors) {
  EMBRUN_CHECK(stand_ins.size() == nodes.size());
  EMBRUN_CHECK(colors.size() == (tail_.has_colors != 0 ? nodes.size() * splats_per_block : 0));
  nodes_.append_all(nodes);
  stand_ins_.append_all(stand_ins);
  stand_in_colors_.append_all(colors);
  tail_.node_count += static_cast<std::uint32_t>(nodes.size());
}

void SplatFileWriter::finish(const SplatFileTail& whole) {
  copy(stand_ins_);
  copy(colors_);
  copy(stand_in_colors_);
  align();
  copy(nodes_);
  SplatFileTail tail = whole;
  tail.splat_blocks = tail_.splat_blocks;
  tail.node_count = tail_.node_count;
  tail.has_colors = tail_.has_colors;
  std::copy(splat_file_magic.begin(), splat_file_magic.end(), tail.magic);
  write(std::as_bytes(std::span(&tail, 1)));
}

}  // namespace embrun
