#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "io/atomic_file.h"
#include "io/scratch_file.h"
#include "io/splat_file.h"

namespace embrun {

/// Writes a file whose parts come one after the other, parents after their children.
class SplatFileWriter {
 public:
  /// What can only come after all blocks waits in scratch files of a folder.
  SplatFileWriter(const ByteSink& sink, const std::filesystem::path& scratch, bool has_colors);

  std::uint32_t splat_blocks() const { return tail_.splat_blocks; }
  std::uint32_t node_count() const { return tail_.node_count; }

  /// Colours are by lane of the blocks; no entries where the file has none.
  void add_splats(std::span<const SplatBlock> blocks, std::span<const Rgb> colors);
  /// Nodes, and by node their stand-ins, in the order of the file.
  void add_nodes(std::span<const SplatNode> nodes, std::span<const SplatBlock> stand_ins, std::span<const Rgb> colors);
  /// What describes the whole; counts and flags of colour are the writer's.
  void finish(const SplatFileTail& whole);

 private:
  const ByteSink& sink_;
  SplatFileTail tail_;
  ScratchFile stand_ins_, colors_, stand_in_colors_, nodes_;
  std::uint64_t written_ = 0;

  void write(std::span<const std::byte> bytes);
  void copy(ScratchFile& file);
  void align();
};

}  // namespace embrun
