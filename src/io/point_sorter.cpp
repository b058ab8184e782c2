#include "io/point_sorter.h"

#include <algorithm>
#include <queue>
#include <tuple>
#include <utility>

#include "base/error.h"
#include "base/parallel.h"

namespace embrun {

bool operator<(const CurvePoint& a, const CurvePoint& b) {
  if (a.key != b.key) return a.key < b.key;
  return std::tie(a.position.x, a.position.y, a.position.z, a.number) <
         std::tie(b.position.x, b.position.y, b.position.z, b.number);
}

PointSorter::PointSorter(std::uint64_t memory, std::filesystem::path folder)
    : folder_(std::move(folder)),
      most_(static_cast<std::size_t>(std::max<std::uint64_t>(memory / sizeof(CurvePoint), 1024))) {}

void PointSorter::add(const CurvePoint& point) {
  if (held_.size() == most_) put_away();
  // Doubling would hold twice as much as was asked for, for a moment.
  if (held_.size() == held_.capacity()) held_.reserve(std::min(most_, std::max<std::size_t>(1024, 2 * held_.size())));
  held_.push_back(point);
  ++size_;
}

void PointSorter::put_away() {
  parallel_sort(held_);
  runs_.emplace_back(folder_).append_all(std::span<const CurvePoint>(held_));
  held_.clear();
  ++run_count_;
}

void PointSorter::finish() {
  if (runs_.empty()) {
    parallel_sort(held_);
    return;
  }
  if (!held_.empty()) put_away();
  held_ = {};
  merge();
}

void PointSorter::merge() {
  struct Run {
    ScratchFile* file;
    std::uint64_t next = 0, size = 0;
    std::vector<CurvePoint> ahead;
    std::size_t at = 0;

    /// False at the end.
    bool fill(std::size_t most) {
      if (at < ahead.size()) return true;
      ahead.resize(static_cast<std::size_t>(std::min<std::uint64_t>(most, size - next)));
      at = 0;
      if (ahead.empty()) return false;
      file->read(next * sizeof(CurvePoint), std::as_writable_bytes(std::span(ahead)));
      next += ahead.size();
      return true;
    }
    const CurvePoint& front() const { return ahead[at]; }
  };
  std::vector<Run> sources;
  for (ScratchFile& file : runs_) sources.push_back({&file, 0, file.size() / sizeof(CurvePoint), {}, 0});
  const std::size_t ahead = std::clamp<std::size_t>(most_ / (sources.size() + 1), 256, std::size_t{1} << 16);

  const auto later = [&](std::size_t a, std::size_t b) { return sources[b].front() < sources[a].front(); };
  std::priority_queue<std::size_t, std::vector<std::size_t>, decltype(later)> nearest(later);
  for (std::size_t i = 0; i < sources.size(); ++i)
    if (sources[i].fill(ahead)) nearest.push(i);
  merged_.emplace(folder_);
  while (!nearest.empty()) {
    const std::size_t i = nearest.top();
    nearest.pop();
    merged_->append_all(std::span(&sources[i].front(), 1));
    ++sources[i].at;
    if (sources[i].fill(ahead)) nearest.push(i);
  }
  runs_.clear();
}

void PointSorter::read(std::uint64_t begin, std::span<CurvePoint> out) {
  EMBRUN_CHECK(begin + out.size() <= size_);
  if (merged_)
    merged_->read(begin * sizeof(CurvePoint), std::as_writable_bytes(out));
  else
    std::copy_n(held_.begin() + static_cast<std::ptrdiff_t>(begin), out.size(), out.begin());
}

}  // namespace embrun
