#include "meshing/felt_tiles.h"

#include <fmt/core.h>

#include <algorithm>

#include "base/error.h"
#include "base/parallel.h"

namespace embrun {

namespace {

/// First and last number along each axis.
struct TileRange {
  int first[3], last[3];

  double count() const {
    double product = 1;
    for (int axis = 0; axis < 3; ++axis) product *= last[axis] - first[axis] + 1;
    return product;
  }
};

TileRange range_of(const ReachBox& box, Vec3 origin, float width, float below, float above) {
  TileRange range;
  for (int axis = 0; axis < 3; ++axis) {
    range.first[axis] = std::max(0, static_cast<int>((box.low[axis] - box.reach - above - origin[axis]) / width));
    range.last[axis] = static_cast<int>((box.high[axis] + box.reach + below - origin[axis]) / width);
  }
  return range;
}

void sort_unique(std::vector<std::uint64_t>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

void check_fineness(const Box3& box, Vec3 origin, float width, float cell) {
  const Vec3 extent = box.high - origin, largest = max_of(max_of(box.high, -box.high), max_of(box.low, -box.low));
  for (int axis = 0; axis < 3; ++axis) {
    if (cell > 4e-7f * largest[axis] && extent[axis] < 0.99f * static_cast<float>(tile_axis_mask) * width) continue;
    throw Error(fmt::format("cells of {} m are too fine for particles spread so wide ({} m)", cell,
                            box.high[axis] - box.low[axis]));
  }
}

}  // namespace

Box3 felt_box(std::span<const ReachBox> boxes) {
  Box3 all;
  for (const ReachBox& box : boxes) {
    const Vec3 reach{box.reach, box.reach, box.reach};
    all.include(box.low - reach);
    all.include(box.high + reach);
  }
  return all;
}

std::vector<std::uint64_t> felt_tiles(std::span<const ReachBox> boxes, Vec3 origin, float width, float below,
                                      float above, float cell) {
  check_fineness(felt_box(boxes), origin, width, cell);
  double most = 0;
  for (const ReachBox& box : boxes) most += range_of(box, origin, width, below, above).count();
  if (most > 4e9)
    throw Error(fmt::format(
        "cells of {} m are too fine for so much fluid: there is no memory for a grid of them; take larger ones", cell));

  // Boxes that follow each other are neighbours: most of their tiles are the same.
  constexpr std::size_t piece = 256;
  std::vector<std::vector<std::uint64_t>> parts((boxes.size() + piece - 1) / piece);
  parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      std::vector<std::uint64_t>& keys = parts[part];
      std::size_t unique = 0;
      for (std::size_t b = part * piece; b < std::min((part + 1) * piece, boxes.size()); ++b) {
        const TileRange range = range_of(boxes[b], origin, width, below, above);
        for (int z = range.first[2]; z <= range.last[2]; ++z)
          for (int y = range.first[1]; y <= range.last[1]; ++y)
            for (int x = range.first[0]; x <= range.last[0]; ++x) keys.push_back(tile_key(x, y, z));
        if (keys.size() < 2 * unique + 4096) continue;
        sort_unique(keys);
        unique = keys.size();
      }
      sort_unique(keys);
    }
  });
  std::vector<std::uint64_t> keys;
  for (std::vector<std::uint64_t>& part : parts) {
    keys.insert(keys.end(), part.begin(), part.end());
    part = {};
  }
  parallel_sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  keys.shrink_to_fit();
  return keys;
}

}  // namespace embrun
