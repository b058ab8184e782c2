#include "particles/spacing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "math/box3d.h"
#include "math/median.h"
#include "particles/neighbour_grid.h"
#include "sampling/hash.h"

namespace embrun {

namespace {

/// A fixed sequence of random numbers.
class Sequence {
 public:
  explicit Sequence(std::uint64_t seed) : state_(mix_bits(seed + 1)) {}
  std::uint64_t bits() { return mix_bits(state_ += 0x9e3779b97f4a7c15u); }
  double unit() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  /// An index below `count`, which must be far below 2^64.
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(bits() % count); }

 private:
  std::uint64_t state_;
};

/// How many points share the cell of a typical point.
double median_occupancy(std::span<const Vec3d> points, const GridCells& cells) {
  Sequence random(1);
  std::vector<std::size_t> samples(512);
  for (std::size_t& sample : samples) sample = random.index(points.size());
  std::vector<std::size_t> counts = points_sharing_cells(cells, points, samples);
  return static_cast<double>(median_of(counts));
}

/// The spacing to a factor of about 1.3, from cells that hold 8 to 40 points where a typical point is: outliers,
/// however far, do not matter. 0 where all points coincide.
double rough_spacing(std::span<const Vec3d> points) {
  const Box3d bounds = box_of(points);
  const double extent = bounds.extent();
  const double smallest_cell = extent * 0x1p-44;
  double cell = extent * std::cbrt(16.0 / static_cast<double>(points.size()));
  if (!(smallest_cell > 0)) return 0;
  constexpr int most_rounds = 48;
  double occupancy = 1;
  for (int round = 0; round < most_rounds; ++round) {
    occupancy = median_occupancy(points, GridCells(bounds, cell));
    if (occupancy > 40 && cell > smallest_cell) {
      cell *= std::cbrt(16 / occupancy);
    } else if (occupancy < 8 && cell < extent) {
      cell *= 1.5;
    } else {
      break;
    }
  }
  return cell / std::cbrt(occupancy);
}

/// What surrounds a place.
struct Probe {
  double density = 0;   // points per cubic metre
  double offset = 0;    // how far the weighted centre of the neighbours is, in kernel radii
  double isotropy = 0;  // 1: they spread alike along all axes; 0: they lie in a plane
};

Probe probe(const NeighbourGrid& grid, Vec3d place, double radius) {
  // The thesis's metaball kernel; its integral is 4 pi 0.0493827 b^3 (4/81 exactly).
  double weight = 0;
  Vec3d centre;
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;
  grid.for_each_within(place, radius, [&](std::uint32_t, Vec3d point, double distance_squared) {
    const double q = std::sqrt(distance_squared) / radius;
    const double f = q < 1.0 / 3 ? 1 - 3 * q * q : 1.5 * (1 - q) * (1 - q);
    const Vec3d d = (point - place) * (1 / radius);
    weight += f;
    centre = centre + d * f;
    xx += f * d.x * d.x, yy += f * d.y * d.y, zz += f * d.z * d.z;
    xy += f * d.x * d.y, xz += f * d.x * d.z, yz += f * d.y * d.z;
  });
  if (!(weight > 0)) return {};
  Probe result;
  result.density = weight / (4 * 3.14159265358979323846 * (4.0 / 81) * radius * radius * radius);
  result.offset = length(centre) / weight;
  const double determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
  const double mean = (xx + yy + zz) / 3;
  result.isotropy = mean > 0 ? determinant / (mean * mean * mean) : 0;
  return result;
}

/// Mean of the half of the values that lies closest together; sorts them. Not empty.
double shorth(std::vector<double>& values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = (values.size() + 1) / 2;
  std::size_t best = 0;
  for (std::size_t i = 0; i + half <= values.size(); ++i) {
    // Relative width: the values are densities.
    if (values[i + half - 1] * values[best] < values[best + half - 1] * values[i]) best = i;
  }
  double sum = 0;
  for (std::size_t i = best; i < best + half; ++i) sum += values[i];
  return sum / static_cast<double>(half);
}

/// Measures the bulk; leaves the estimate as it is when there is none.
void measure_bulk(const NeighbourGrid& grid, double rough, double radius, SpacingEstimate& estimate) {
  // Places are spread evenly over the cells that are at least half full, so that spray does not use them up.
  const double expected = std::pow(radius / rough, 3);
  std::vector<std::size_t> cells;
  for (std::size_t cell = 0; cell < grid.cell_count(); ++cell) {
    if (static_cast<double>(grid.cell_points(cell)) >= 0.5 * expected) cells.push_back(cell);
  }
  if (cells.empty()) return;

  constexpr std::size_t places = 3000;
  constexpr double greatest_offset = 0.1, least_isotropy = 0.5;
  std::vector<Probe> bulk;
  Sequence random(2);
  for (std::size_t i = 0; i < places; ++i) {
    const Vec3d corner = grid.cell_corner(cells[random.index(cells.size())]);
    const double x = random.unit(), y = random.unit(), z = random.unit();
    const Probe p = probe(grid, corner + Vec3d{x, y, z} * grid.cell_size(), radius);
    if (p.density > 0 && p.offset < greatest_offset && p.isotropy > least_isotropy) bulk.push_back(p);
  }
  if (bulk.empty()) return;

  // The more even half of them is the deeper one.
  std::sort(bulk.begin(), bulk.end(), [](const Probe& a, const Probe& b) { return a.offset < b.offset; });
  std::vector<double> densities;
  for (std::size_t i = 0; i <= bulk.size() / 2 && i < bulk.size(); ++i) densities.push_back(bulk[i].density);
  const double density = shorth(densities);

  // A fluid has one density nearly everywhere in its bulk; spray that happens to lie evenly about a place has any.
  constexpr double tolerance = 0.15, least_share = 0.15;
  const auto near = [&](const Probe& p) { return std::abs(p.density / density - 1) < tolerance; };
  estimate.bulk_share = static_cast<double>(std::count_if(bulk.begin(), bulk.end(), near)) / places;
  if (estimate.bulk_share < least_share) return;
  estimate.has_bulk = true;
  estimate.spacing = 1 / std::cbrt(density);
}

/// Median distance from a point to the nearest other one.
double median_nearest(const NeighbourGrid& grid, std::span<const Vec3d> points, double first_radius) {
  constexpr std::size_t most_samples = 6000;
  const std::size_t samples = std::min(points.size(), most_samples);
  Sequence random(3);
  std::vector<std::size_t> open(samples);
  for (std::size_t i = 0; i < samples; ++i) open[i] = points.size() <= most_samples ? i : random.index(points.size());
  std::vector<double> found;
  // The median is known once more than half have their neighbour within the radius; outliers need not be found.
  for (double radius = first_radius; found.size() <= samples / 2; radius *= 2) {
    std::vector<std::size_t> still_open;
    for (const std::size_t i : open) {
      double nearest = radius * radius * 2;
      grid.for_each_within(points[i], radius, [&](std::uint32_t j, Vec3d, double distance_squared) {
        if (j != i) nearest = std::min(nearest, distance_squared);
        return nearest > 0;
      });
      if (nearest <= radius * radius) {
        found.push_back(std::sqrt(nearest));
      } else {
        still_open.push_back(i);
      }
    }
    open = std::move(still_open);
  }
  std::sort(found.begin(), found.end());
  const std::size_t middle = samples / 2;
  return samples % 2 ? found[middle] : 0.5 * (found[middle - 1] + found[middle]);
}

}  // namespace

SpacingEstimate estimate_spacing(const ParticleSet& particles) {
  SpacingEstimate estimate;
  const std::span<const Vec3d> points(particles.positions);
  if (points.size() < 2) return estimate;
  const double rough = rough_spacing(points);
  if (!(rough > 0)) return estimate;
  const double radius = 2.5 * rough;
  const NeighbourGrid grid(points, radius);
  estimate.nearest_neighbour = median_nearest(grid, points, rough);
  // Fewer cannot surround a place.
  constexpr std::size_t least_points = 27;
  if (points.size() >= least_points) measure_bulk(grid, rough, radius, estimate);
  return estimate;
}

}  // namespace embrun
