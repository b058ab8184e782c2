#include "render/splat_building.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/splat_bricks.h"
#include "io/point_sorter.h"
#include "math/median.h"
#include "math/srgb.h"
#include "particles/cloud_cleaning.h"
#include "particles/cloud_closedness.h"
#include "particles/cloud_normals.h"
#include "particles/cloud_splats.h"
#include "particles/point_tree.h"
#include "particles/splat_attributes.h"
#include "render/stopwatch.h"

namespace embrun {
namespace {

/// What the first reading finds.
struct Survey {
  Vec3d low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
  Vec3d center;  ///< of most points: strays cost no precision
  std::uint64_t points = 0, dropped = 0;
  std::uint64_t without_normal = 0;
  bool has_colors = false, has_radii = false;
  double greatest_color = 0;
};

Survey survey_of(PointStream& stream, const BuildProgress& progress) {
  Survey survey;
  constexpr std::uint64_t sample_size = 20000;
  const std::uint64_t step = stream.count() / sample_size + 1;
  std::vector<double> x, y, z;
  for (;;) {
    const ParticleSet piece = stream.next();
    survey.dropped += piece.dropped_non_finite;
    if (piece.size() == 0) break;
    for (const Vec3d& p : piece.positions) {
      survey.low = min_of(survey.low, p);
      survey.high = max_of(survey.high, p);
      if (survey.points++ % step != 0) continue;
      x.push_back(p.x), y.push_back(p.y), z.push_back(p.z);
    }
    const std::vector<Vec3> normals = normals_of_points(piece);
    survey.without_normal +=
        normals.empty() ? piece.size() : static_cast<std::uint64_t>(std::count(normals.begin(), normals.end(), Vec3{}));
    if (const Attribute* color = number_attribute(piece, "color", 3)) {
      survey.has_colors = true;
      for (std::size_t i = 0; i < color->value_count(); ++i)
        survey.greatest_color = std::max(survey.greatest_color, color->value(i));
    }
    survey.has_radii = survey.has_radii || number_attribute(piece, "radius", 1) != nullptr;
    progress("reading", static_cast<double>(survey.points + survey.dropped) / static_cast<double>(stream.count()));
  }
  if (survey.points > 0) survey.center = {median_of(x), median_of(y), median_of(z)};
  return survey;
}

/// Fills the sorter with the stream's points.
class Sorting {
 public:
  Sorting(const Survey& survey, const SplatOptions& options, PointSorter& sorter)
      : survey_(survey), options_(options), grid_(survey.low, survey.high), sorter_(sorter) {}

  void add(const ParticleSet& piece) {
    const std::vector<Vec3> normals = normals_of_points(piece);
    const Attribute* color = number_attribute(piece, "color", 3);
    const Attribute* radius = number_attribute(piece, "radius", 1);
    const double scale = color_scale(survey_.greatest_color);
    for (std::size_t i = 0; i < piece.size(); ++i) {
      CurvePoint point;
      const Vec3d position = piece.positions[i];
      point.key = grid_.key(position);
      point.number = next_++;
      point.position = to_float(position - survey_.center);
      if (!normals.empty()) point.normal = normals[i];
      if (options_.sensor && dot(to_double(point.normal), *options_.sensor - position) < 0)
        point.normal = -point.normal;
      if (options_.radius) {
        point.radius = static_cast<float>(*options_.radius);
      } else if (radius != nullptr) {
        point.radius = static_cast<float>(radius->value(i) * options_.radius_scale);
        if (!(point.radius > 0) || !is_finite(point.radius)) point.radius = 0;
      }
      for (std::size_t c = 0; color != nullptr && c < 3; ++c)
        point.color[c] =
            static_cast<std::uint8_t>(std::lround(255 * std::clamp(scale * color->value(3 * i + c), 0.0, 1.0)));
      sorter_.add(point);
    }
  }

 private:
  const Survey& survey_;
  const SplatOptions& options_;
  CurveGrid grid_;
  PointSorter& sorter_;
  std::uint64_t next_ = 0;
};

/// A stretch of the sorted points.
struct Stretch {
  std::uint64_t begin = 0;
  std::size_t size = 0;
  Box3 bounds;
};

std::vector<CurvePoint> points_of(PointSorter& sorted, const Stretch& stretch) {
  std::vector<CurvePoint> points(stretch.size);
  sorted.read(stretch.begin, points);
  return points;
}

std::vector<Stretch> cut_into_bricks(PointSorter& sorted, std::size_t most) {
  std::vector<Stretch> stretches;
  std::vector<CurvePoint> ahead;
  std::vector<std::uint64_t> keys;
  for (std::uint64_t begin = 0; begin < sorted.size();) {
    ahead.resize(static_cast<std::size_t>(std::min<std::uint64_t>(most + 1, sorted.size() - begin)));
    sorted.read(begin, ahead);
    keys.clear();
    for (const CurvePoint& point : ahead) keys.push_back(point.key);
    Stretch stretch{begin, brick_length(keys, most), {}};
    for (std::size_t i = 0; i < stretch.size; ++i) stretch.bounds.include(ahead[i].position);
    stretches.push_back(stretch);
    begin += stretch.size;
  }
  return stretches;
}

/// Radii that leave no hole, of the first `count` points; the others are there for their sake.
void estimate_radii(std::vector<CurvePoint>& points, std::size_t count, float scale) {
  std::vector<Vec3d> positions;
  std::vector<Vec3> normals;
  for (const CurvePoint& point : points) {
    positions.push_back(to_double(point.position));
    normals.push_back(point.normal);
  }
  const PointTree tree(positions);
  const SplatSizes sizes = estimate_splats(tree, positions, normals, false);
  for (std::size_t i = 0; i < count; ++i) points[i].radius = scale * sizes.radii[i];
}

/// Makes bricks of sorted points, some at a time.
class BrickMaking {
 public:
  BrickMaking(PointSorter& sorted, std::vector<Stretch> stretches, const Survey& survey,
              const SplatBuildOptions& options, bool estimates)
      : sorted_(sorted), stretches_(std::move(stretches)), survey_(survey), options_(options), estimates_(estimates) {}

  std::size_t count() const { return stretches_.size(); }

  /// The next bricks, in order.
  std::vector<SplatBrick> next(std::size_t most) {
    const std::size_t first = done_, count = std::min(most, stretches_.size() - done_);
    // Reading is one file's; the work on what was read is not.
    std::vector<std::vector<CurvePoint>> points(count);
    for (std::size_t i = 0; i < count; ++i) points[i] = gather(first + i);
    std::vector<SplatBrick> bricks(count);
    std::vector<std::uint64_t> doubled(count);
    parallel_for(count, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        bricks[i] = make(std::move(points[i]), stretches_[first + i].size, doubled[i]);
    });
    for (const std::uint64_t one : doubled) duplicates_ += one;
    done_ += count;
    return bricks;
  }
  std::uint64_t duplicates() const { return duplicates_; }

 private:
  PointSorter& sorted_;
  std::vector<Stretch> stretches_;
  const Survey& survey_;
  const SplatBuildOptions& options_;
  bool estimates_;
  std::size_t done_ = 0;
  std::uint64_t duplicates_ = 0;

  /// A brick's own points, then what is near them of others'.
  std::vector<CurvePoint> gather(std::size_t brick) {
    const Stretch& own = stretches_[brick];
    std::vector<CurvePoint> points = points_of(sorted_, own);
    if (!estimates_) return points;
    // As far as cells of the Voronoi diagram are looked for, were the points spread evenly over the largest side.
    const Vec3 size = own.bounds.high - own.bounds.low;
    const float area = std::max({size.x * size.y, size.y * size.z, size.z * size.x});
    constexpr float spacings = 8;
    const float reach = spacings * std::sqrt(area / static_cast<float>(own.size));
    const Box3 wide{own.bounds.low - Vec3{reach, reach, reach}, own.bounds.high + Vec3{reach, reach, reach}};
    for (std::size_t other = 0; other < stretches_.size(); ++other) {
      const Box3& box = stretches_[other].bounds;
      const Box3 both{max_of(wide.low, box.low), min_of(wide.high, box.high)};
      if (other == brick || both.empty()) continue;
      for (const CurvePoint& point : points_of(sorted_, stretches_[other]))
        if (wide.contains(point.position)) points.push_back(point);
    }
    return points;
  }

  SplatBrick make(std::vector<CurvePoint> points, std::size_t count, std::uint64_t& doubled) const {
    if (!options_.splats.keep_duplicates) count = leave_out_duplicates(points, count, doubled);
    if (estimates_) estimate_radii(points, count, static_cast<float>(options_.splats.radius_scale));
    std::vector<Splat> splats(count);
    std::vector<Rgb> colors(survey_.has_colors ? count : 0);
    for (std::size_t i = 0; i < count; ++i) {
      splats[i] = {points[i].position, points[i].radius, points[i].normal, {}};
      if (!survey_.has_colors) continue;
      for (int c = 0; c < 3; ++c) colors[i][c] = srgb_decode(static_cast<float>(points[i].color[c]) / 255.0f);
    }
    return build_splat_brick(splats, colors);
  }

  /// Of the first `count` points, which are in order; returns how many stay.
  static std::size_t leave_out_duplicates(std::vector<CurvePoint>& points, std::size_t count, std::uint64_t& doubled) {
    const auto end = points.begin() + static_cast<std::ptrdiff_t>(count);
    const auto kept = std::unique(points.begin(), end, [](const CurvePoint& a, const CurvePoint& b) {
      return a.key == b.key && a.position == b.position;
    });
    doubled = static_cast<std::uint64_t>(end - kept);
    points.erase(kept, end);
    return count - static_cast<std::size_t>(doubled);
  }
};

/// Follows what is written: bounds, roots, radii of a sample, and what tells whether it is closed.
class Whole {
 public:
  explicit Whole(std::uint64_t points) : thinning_(points) {}

  void add(const SplatBrick& brick, std::uint32_t root) {
    roots_.push_back({brick.whole, brick.bounds, root});
    bounds_.include(brick.bounds);
    count_ += brick.splat_count;
    for (const SplatBlock& block : brick.blocks)
      for (std::uint32_t i = 0; i < splats_per_block; ++i) {
        const float radius = block.radius[i];
        if (!(radius > 0)) continue;
        least_ = std::min(least_, radius);
        greatest_ = std::max(greatest_, radius);
        constexpr std::uint64_t one_of = 64;
        if (seen_ % one_of == 0) sample_.push_back(radius);
        if (seen_ % thinning_.step == 0) {
          const Splat splat = block.splat(i);
          centers_.push_back(to_double(splat.center));
          normals_.push_back(splat.normal);
          grown_radii_.push_back(thinning_.growth * radius);
        }
        ++seen_;
      }
  }
  const std::vector<BrickRoot>& roots() const { return roots_; }
  std::uint64_t count() const { return count_; }
  void report(SplatBuildReport& report) {
    report.splats = count_;
    report.least_radius = static_cast<double>(least_);
    report.greatest_radius = static_cast<double>(greatest_);
    report.median_radius = static_cast<double>(median_of(sample_));
  }
  bool is_closed() const {
    std::vector<std::uint32_t> order(centers_.size());
    std::iota(order.begin(), order.end(), 0u);
    return look_for_holes(centers_, normals_, grown_radii_, order).closed;
  }
  SplatFileTail tail(const Survey& survey, bool closed, double median_radius) const {
    SplatFileTail tail;
    tail.splat_count = count_;
    tail.closed = closed;
    const double center[3] = {survey.center.x, survey.center.y, survey.center.z};
    for (int axis = 0; axis < 3; ++axis) {
      tail.center[axis] = center[axis];
      tail.low[axis] = bounds_.low[axis];
      tail.high[axis] = bounds_.high[axis];
    }
    tail.median_radius = static_cast<float>(median_radius);
    return tail;
  }

 private:
  std::vector<BrickRoot> roots_;
  Box3 bounds_;
  std::uint64_t count_ = 0, seen_ = 0;
  float least_ = infinity, greatest_ = 0;
  std::vector<float> sample_;
  SplatThinning thinning_;
  std::vector<Vec3d> centers_;
  std::vector<Vec3> normals_;
  std::vector<float> grown_radii_;
};

void check_survey(const Survey& survey, const std::string& name) {
  if (survey.points == 0) throw Error(fmt::format("{}: points: there are none", name));
  if (survey.without_normal > 0)
    throw Error(fmt::format(
        "{}: normals: {} of {} points have none, and of a file that is read in pieces they are not estimated; write it "
        "with normals, or thin it so far that it is read whole",
        name, survey.without_normal, survey.points));
}

void add_nodes(SplatFileWriter& writer, const SplatNodes& nodes) {
  writer.add_nodes(nodes.nodes, nodes.stand_ins, nodes.colors);
}

}  // namespace

SplatBuildReport write_splats_of(PointStream& stream, const SplatBuildOptions& options, const std::string& name,
                                 const ByteSink& sink, const BuildProgress& progress) {
  const Stopwatch watch;
  SplatBuildReport report;
  const Survey survey = survey_of(stream, progress);
  check_survey(survey, name);
  report.points = survey.points;
  report.dropped = survey.dropped;
  report.has_colors = survey.has_colors;
  report.estimated_radii = !options.splats.radius && !survey.has_radii;

  PointSorter sorter(options.memory, options.scratch);
  Sorting sorting(survey, options.splats, sorter);
  stream.rewind();
  for (ParticleSet piece = stream.next(); piece.size() > 0; piece = stream.next()) {
    sorting.add(piece);
    progress("sorting", 0.9 * static_cast<double>(sorter.size()) / static_cast<double>(survey.points));
  }
  sorter.finish();
  report.runs = sorter.runs();
  report.sort_seconds = watch.seconds();
  progress("sorting", 1);

  SplatFileWriter writer(sink, options.scratch, survey.has_colors);
  BrickMaking making(sorter, cut_into_bricks(sorter, options.brick), survey, options, report.estimated_radii);
  Whole whole(survey.points);
  constexpr std::size_t at_a_time = 16;
  for (std::size_t done = 0; done < making.count();) {
    std::vector<SplatBrick> bricks = making.next(at_a_time);
    done += bricks.size();
    for (SplatBrick& brick : bricks) {
      if (brick.splat_count == 0) continue;
      place_brick(brick, writer.node_count(), writer.splat_blocks());
      writer.add_splats(brick.blocks, brick.colors);
      add_nodes(writer, brick.nodes);
      whole.add(brick, writer.node_count() - 1);
    }
    progress("building", static_cast<double>(done) / static_cast<double>(making.count()));
  }
  if (whole.count() == 0) throw Error(fmt::format("{}: no point has both a normal and a radius", name));
  if (whole.roots().size() > 1)
    add_nodes(writer, join_splat_bricks(whole.roots(), writer.node_count(), survey.has_colors));
  whole.report(report);
  report.closed = options.splats.closed ? *options.splats.closed : whole.is_closed();
  writer.finish(whole.tail(survey, report.closed, report.median_radius));
  report.duplicates = making.duplicates();
  report.bricks = whole.roots().size();
  report.blocks = writer.splat_blocks();
  report.nodes = writer.node_count();
  report.build_seconds = watch.seconds() - report.sort_seconds;
  return report;
}

}  // namespace embrun
