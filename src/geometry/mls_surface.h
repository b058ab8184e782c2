#pragma once

#include "geometry/mls_line.h"
#include "geometry/mls_support.h"
#include "geometry/splat_set.h"
#include "geometry/splat_tree.h"
#include "math/next_float.h"

// Rays against the moving least squares surface of a cloud. Its points are a SplatSet and a SplatTreeView as splats are, made by
// build_ball_tree(): a splat's radius is the point's support h.

namespace embrun {

/// What a ray may meet.
enum class MlsSides : std::uint8_t { both, fronts, backs };

/// Which points a stretch of a ray feels, as a Field of mls_line.h.
struct MlsGathered {
  const SplatTreeView& tree;
  const Ray& ray;
  const MlsPoints& points;
  float begin = 0;        ///< of the stretch, along the ray
  Vec3 origin;            ///< the ray there
  Vec3 usual;             ///< see MlsStretch
  bool streamed = false;  ///< the points do not all fit: the tree shows them each time

  struct Query {
    const Ray& own;
    float low, high;

    EMBRUN_FN const Ray& ray() const { return own; }
    EMBRUN_FN float near() const { return low; }
    EMBRUN_FN float limit() const { return high; }
  };

  template <class Sums, class... Ask>
  EMBRUN_FN void add(Sums& sums, float from, float to, const Ask&... ask) const {
    if (streamed)
      stream(sums, from, to, ask...);
    else
      sums.add(points, ask...);
  }
  template <class Sums, class... Ask>
  EMBRUN_FN void stream(Sums& sums, float from, float to, const Ask&... ask) const {
    MlsPoints part;
    Query query{ray, begin + from, begin + to};
    tree.walk(query, [&](std::uint32_t block, float) {
      if (part.count + static_cast<int>(splats_per_block) > MlsPoints::capacity) {
        part.fill_up();
        part.compare_normals(usual);
        sums.add(part, ask...);
        part.count = 0;
      }
      for (std::uint32_t lane = 0; lane < splats_per_block; ++lane) {
        const Splat point = tree.blocks[block].splat(lane);
        if (point.radius > 0.0f) part.add(point, origin, block * splats_per_block + lane);
      }
    });
    if (part.count == 0) return;
    part.fill_up();
    part.compare_normals(usual);
    sums.add(part, ask...);
  }
};

/// Collects the blocks along the next stretch of a ray, nearest first.
struct MlsBlocks {
  static constexpr int capacity = 48;

  const Ray& own;
  const SplatBlock* blocks;
  float low, high, ends;
  std::uint32_t block[capacity];
  float enter[capacity];
  int count = 0;

  EMBRUN_FN MlsBlocks(const Ray& ray, const SplatBlock* all, float from, float to)
      : own(ray), blocks(all), low(from), high(to), ends(to) {}
  EMBRUN_FN const Ray& ray() const { return own; }
  EMBRUN_FN float near() const { return low; }
  EMBRUN_FN float limit() const { return high; }

  EMBRUN_FN void take(std::uint32_t number, float entered) {
    if (entered > high) return;
    // A stretch is so long that it mostly holds the surface where there is one, and not much besides.
    high = min_of(high, entered + 2.0f * blocks[number].radius[0]);
    if (count == capacity) {
      // The farthest goes, and the stretch ends where it would have come in.
      high = min_of(high, max_of(enter[count - 1], entered));
      if (entered >= enter[count - 1]) return;
      --count;
    }
    int i = count++;
    for (; i > 0 && enter[i - 1] > entered; --i) {
      enter[i] = enter[i - 1];
      block[i] = block[i - 1];
    }
    enter[i] = entered;
    block[i] = number;
  }
};

/// What a stretch has to know of its points.
struct MlsSupportSums {
  float least = infinity, greatest = 0;
  Vec3 normal;

  EMBRUN_FN void add(const MlsPoints& points) {
    for (int i = 0; i < points.count; ++i) {
      least = min_of(least, points.support[i]);
      greatest = max_of(greatest, points.support[i]);
      normal += Vec3{points.normal_x[i], points.normal_y[i], points.normal_z[i]};
    }
  }
};

/// Puts those points of the blocks whose supports the ray is in somewhere in [0, end] of the stretch into `points`; `begin` and
/// `last` are where the first is entered and the last is left. When they are too many `end` is cut, to 0 where even that
/// does not help.
EMBRUN_LOCAL_FN void choose_mls_points(const MlsBlocks& found, Vec3 origin, MlsPoints& points, float& begin,
                                       float& last, float& end) {
  begin = infinity;
  last = 0.0f;
  for (int i = 0; i < found.count && found.enter[i] - found.low <= end; ++i) {
    if (points.count + static_cast<int>(splats_per_block) > MlsPoints::capacity) {
      end = max_of(found.enter[i] - found.low, 0.0f);
      break;
    }
    const SplatBlock& block = found.blocks[found.block[i]];
    float in[splats_per_block], out[splats_per_block];
    const Vec3 d = found.own.direction;
    for (std::uint32_t lane = 0; lane < splats_per_block; ++lane) {
      const float x = block.x[lane] - origin.x, y = block.y[lane] - origin.y, z = block.z[lane] - origin.z;
      const float middle = x * d.x + y * d.y + z * d.z;
      const float ax = x - middle * d.x, ay = y - middle * d.y, az = z - middle * d.z;
      const float squared = 1.0001f * square(block.radius[lane]) - (ax * ax + ay * ay + az * az);
      const float half = sqrtf(max_of(squared, 0.0f));
      in[lane] = squared > 0.0f ? middle - half : infinity;
      out[lane] = middle + half;
    }
    for (std::uint32_t lane = 0; lane < splats_per_block; ++lane) {
      if (!(in[lane] <= end && out[lane] >= 0.0f)) continue;
      begin = min_of(begin, in[lane]);
      last = max_of(last, out[lane]);
      points.add(block.splat(lane), origin, found.block[i] * splats_per_block + lane);
    }
  }
  begin = max_of(begin, 0.0f);
}

/// The surface's colour: that of the points by their weights.
struct MlsColorSums {
  Rgb color;
  float weight = 0;

  EMBRUN_FN void add(const MlsPoints& points, Vec3 x, const Rgb* colors) {
    for (int i = 0; i < points.count; ++i) {
      const Vec3 q = x - Vec3{points.x[i], points.y[i], points.z[i]};
      const float r = length(q) * points.inverse[i], rest = max_of(1.0f - r, 0.0f);
      const float w = square(square(rest)) * (4.0f * r + 1.0f);
      if (!(w > 0.0f)) continue;
      color += w * colors[points.number[i]];
      weight += w;
    }
  }
};

EMBRUN_LOCAL_FN void fill_mls_hit(const SplatSet& set, const MlsGathered& gathered, const MlsCrossing& crossing,
                                  SurfaceHit& hit) {
  const Vec3 from_origin = gathered.ray.direction * crossing.t;
  hit.position = gathered.origin + from_origin;
  hit.geometric_normal = normalize(crossing.gradient);
  hit.shading_normal = normalize(crossing.value.normal);
  hit.entering = crossing.entering;
  hit.splat_radius = crossing.value.support / (crossing.value.weight * static_cast<float>(mls_default_support));
  if (set.colors == nullptr) return;
  MlsColorSums sums;
  gathered.add(sums, crossing.t, crossing.t, from_origin, set.colors);
  if (sums.weight > 0.0f) hit.color = sums.color * (1.0f / sums.weight);
}

/// Prepares the search along the next stretch of a ray. False: there are no points ahead. `next` receives how far the
/// stretch reaches, from its begin; nothing is in it but [march.t, stretch.end].
EMBRUN_LOCAL_FN bool begin_mls_stretch(MlsBlocks& found, MlsPoints& points, MlsGathered& gathered, MlsStretch& stretch,
                                       MlsMarch& march, float& next) {
  gathered.tree.walk(found, [&](std::uint32_t block, float enter) { found.take(block, enter); });
  if (found.count == 0) return false;
  next = found.high - found.low;
  choose_mls_points(found, gathered.origin, points, march.t, stretch.end, next);
  stretch.end = min_of(stretch.end, next);
  // Far too many in one place are looked at a few at a time, again and again.
  const float some_support = found.blocks[found.block[0]].radius[0];
  gathered.streamed = next < 1e-2f * some_support && next < found.ends - found.low;
  MlsSupportSums supports;
  if (gathered.streamed) {
    march.t = 0.0f;
    next = min_of(0.25f * some_support, found.ends - found.low);
    stretch.end = next;
  }
  points.fill_up();
  gathered.add(supports, march.t, stretch.end);
  stretch.least_support = supports.least;
  stretch.greatest_support = supports.greatest;
  stretch.direction = found.own.direction;
  stretch.usual = length_squared(supports.normal) > 0.0f ? normalize(supports.normal) : stretch.direction;
  gathered.usual = stretch.usual;
  points.compare_normals(stretch.usual);
  march.length = stretch.end - march.t;
  return true;
}

/// First crossing of the surface with t in (t_min, t_max) that is on one of the `sides`; false leaves `hit` alone. A
/// ray that leaves the surface (`start`) does not meet it at once from the side that it is not on.
EMBRUN_LOCAL_FN bool first_mls_crossing(const SplatSet& set, const SplatTreeView& tree, const Ray& ray, MlsSides sides,
                                        const SplatStart& start, SurfaceHit& hit) {
  // Rays from afar start anew at the cloud, for precision.
  const BoxSpan span = clip_line(set.bounds, ray);
  if (span.empty() || !(span.exit > ray.t_min) || !(span.enter < ray.t_max)) return false;
  const float skipped = max_of(span.enter, 0.0f);
  Ray near = ray;
  near.origin = ray.at(skipped);
  near.t_min = max_of(ray.t_min - skipped, 0.0f);
  near.t_max = min_of(ray.t_max, span.exit) - skipped;

  float t = near.t_min;
  while (t < near.t_max) {
    MlsBlocks found(near, tree.blocks, t, near.t_max);
    MlsPoints points;
    MlsGathered gathered{tree, near, points, t, near.at(t), {}, false};
    MlsStretch stretch;
    stretch.reach = set.closed ? mls_closed_reach : mls_open_reach;
    MlsMarch march;
    float next = 0.0f;
    if (!begin_mls_stretch(found, points, gathered, stretch, march, next)) return false;
    // What goes straight on through a crossing is not to meet it again.
    if (near.t_min > 0.0f && t == near.t_min)
      march.t = max_of(march.t, max_of(mls_least_step * stretch.least_support, 4e-7f * ray.t_min));
    MlsCrossing crossing;
    for (int i = 0; i < 4000 && march.t < stretch.end; ++i) {
      if (!march_mls(gathered, stretch, march, crossing)) continue;
      if (sides != MlsSides::both && crossing.entering != (sides == MlsSides::fronts)) continue;
      const float gone = t + crossing.t;
      if (start.radius > 0.0f && gone < 0.02f * start.radius && crossing.entering == start.behind) continue;
      if (!(gone + skipped < ray.t_max)) return false;
      hit.t = gone + skipped;
      fill_mls_hit(set, gathered, crossing, hit);
      return true;
    }
    if (t + next >= near.t_max) return false;
    // Stretches that have points overlap by a little, for a zero that is between them by rounding.
    const float overlap = is_finite(stretch.least_support) ? mls_least_step * stretch.least_support : 0.0f;
    t = max_of(t + next - overlap, next_float(t));
  }
  return false;
}

/// The same as intersect_splats(). Of a closed cloud a ray meets what its side lets it meet: fronts from outside.
EMBRUN_LOCAL_FN bool intersect_mls(const SplatSet& set, const SplatTreeView& tree, const Ray& ray, bool inside,
                                   const SplatStart& start, SurfaceHit& hit) {
  const MlsSides sides = !set.closed ? MlsSides::both : inside ? MlsSides::backs : MlsSides::fronts;
  return first_mls_crossing(set, tree, ray, sides, start, hit);
}

/// True for points in a closed body.
EMBRUN_LOCAL_FN bool mls_contains(const SplatSet& set, const SplatTreeView& tree, Vec3 point) {
  return most_meet_backs(point, [&](const Ray& ray, SurfaceHit& hit) {
    return first_mls_crossing(set, tree, ray, MlsSides::both, {}, hit);
  });
}

}  // namespace embrun
