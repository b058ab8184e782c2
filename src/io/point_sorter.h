#pragma once

#include <compare>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "io/scratch_file.h"
#include "math/vec.h"

namespace embrun {

/// A point of a cloud on its way to be a splat.
struct CurvePoint {
  std::uint64_t key = 0;     ///< along a space-filling curve
  std::uint64_t number = 0;  ///< in the file
  Vec3 position;
  Vec3 normal;                 ///< unit, or 0: it has none
  float radius = 0;            ///< metres, or 0: it has none
  std::uint8_t color[4] = {};  ///< sRGB, and one not used
};

/// By key, then by place, then by number.
bool operator<(const CurvePoint& a, const CurvePoint& b);

/// Sorts more points than fit into memory: fills it, sorts and puts away what is there, and merges in the end. The order
/// does not depend on how much memory there is.
class PointSorter {
 public:
  /// At most so many bytes of points at a time, the rest in scratch files of a folder.
  PointSorter(std::uint64_t memory, std::filesystem::path folder);

  void add(const CurvePoint& point);
  /// No more are added. From then on points are read in order.
  void finish();

  std::uint64_t size() const { return size_; }
  std::size_t runs() const { return run_count_; }  ///< that were put away; 0: all were in memory
  void read(std::uint64_t begin, std::span<CurvePoint> out);

 private:
  std::filesystem::path folder_;
  std::size_t most_;
  std::uint64_t size_ = 0;
  std::size_t run_count_ = 0;
  std::vector<CurvePoint> held_;
  std::vector<ScratchFile> runs_;
  std::optional<ScratchFile> merged_;

  void put_away();
  void merge();
};

}  // namespace embrun
