#pragma once

#include "math/vec.h"

namespace embrun {

/// A box of equal cells.
struct CellGrid {
  Vec3 low;
  Vec3 cell{1, 1, 1};  ///< size of one, metres
  Vec3 cells_per_metre{1, 1, 1};
  int nx = 0, ny = 0, nz = 0;

  EMBRUN_FN Vec3 high() const {
    return low +
           Vec3{cell.x * static_cast<float>(nx), cell.y * static_cast<float>(ny), cell.z * static_cast<float>(nz)};
  }
  EMBRUN_FN int index(int x, int y, int z) const { return (z * ny + y) * nx + x; }
};

/// A grid of cubes of `side` metres.
EMBRUN_FN CellGrid grid_of_cubes(const Vec3& low, float side, int nx, int ny, int nz) {
  const float per_metre = 1.0f / side;
  return {low, {side, side, side}, {per_metre, per_metre, per_metre}, nx, ny, nz};
}

/// The cells along a stretch of a line, in order [AmanatidesWoo1987]. Where a face is met is computed from the face, not
/// summed up, so that long walks don't drift; a direction component of 0 is harmless, and the indices only go one way, so
/// every walk ends.
struct GridWalk {
  int x = 0, y = 0, z = 0;
  float begin = 0;  ///< where the line enters the current cell
  bool done = true;

  GridWalk() = default;
  EMBRUN_FN GridWalk(const CellGrid& cells, Vec3 line_origin, Vec3 line_direction, float t_begin, float t_end)
      : begin(t_begin), grid_(&cells), origin_(line_origin), direction_(line_direction), end_(t_end) {
    const Vec3 high = grid_->high();
    for (int axis = 0; axis < 3; ++axis) {
      const float d = direction_[axis], to_low = grid_->low[axis] - origin_[axis], to_high = high[axis] - origin_[axis];
      if (d == 0.0f) {
        inverse_[axis] = 0.0f;
        if (to_low > 0.0f || to_high < 0.0f) return;
        continue;
      }
      inverse_[axis] = 1.0f / d;
      begin = max_of(begin, (d > 0.0f ? to_low : to_high) * inverse_[axis]);
      end_ = min_of(end_, (d > 0.0f ? to_high : to_low) * inverse_[axis]);
    }
    if (!(begin < end_) || grid_->nx == 0) return;
    const Vec3 start = (origin_ + begin * direction_ - grid_->low) * grid_->cells_per_metre;
    x = clamp_index(start.x, grid_->nx);
    y = clamp_index(start.y, grid_->ny);
    z = clamp_index(start.z, grid_->nz);
    next_ = {face(0, x), face(1, y), face(2, z)};
    done = false;
  }

  EMBRUN_FN int index() const { return grid_->index(x, y, z); }
  /// Where the line leaves the current cell; never before `begin`.
  EMBRUN_FN float end() const { return max_of(begin, min_of(end_, min_of(next_.x, min_of(next_.y, next_.z)))); }

  /// On to the next cell.
  EMBRUN_FN void advance() {
    begin = end();
    if (next_.x <= next_.y && next_.x <= next_.z) {
      x += direction_.x > 0.0f ? 1 : -1;
      done = x < 0 || x >= grid_->nx;
      next_.x = face(0, x);
    } else if (next_.y <= next_.z) {
      y += direction_.y > 0.0f ? 1 : -1;
      done = y < 0 || y >= grid_->ny;
      next_.y = face(1, y);
    } else {
      z += direction_.z > 0.0f ? 1 : -1;
      done = z < 0 || z >= grid_->nz;
      next_.z = face(2, z);
    }
    done = done || !(begin < end_);
  }

 private:
  const CellGrid* grid_ = nullptr;
  Vec3 origin_, direction_, inverse_, next_;
  float end_ = 0;

  EMBRUN_FN static int clamp_index(float v, int n) {
    const int i = static_cast<int>(clamp(v, 0.0f, static_cast<float>(n)));
    return i < n ? i : n - 1;
  }
  /// Where the line meets the face by which it leaves the cells of that number along an axis.
  EMBRUN_FN float face(int axis, int i) const {
    const float d = direction_[axis];
    if (d == 0.0f) return infinity;
    const float plane = grid_->low[axis] + static_cast<float>(d > 0.0f ? i + 1 : i) * grid_->cell[axis];
    return (plane - origin_[axis]) * inverse_[axis];
  }
};

}  // namespace embrun
