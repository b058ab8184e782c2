// Flights through media on grids, against quadrature of a look-up written anew: hat functions in double precision.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "media/grid_flight.h"
#include "media/grid_medium_build.h"
#include "support/chi_square.h"

namespace embrun {
namespace {

/// Every chi-square test below fails by chance with this probability.
constexpr double significance = 1e-4;

/// A box that is turned, stretched and moved; not a cube.
Transform turned_box() {
  const float c = std::cos(0.7f), s = std::sin(0.7f);
  return {{1.5f * c, 1.5f * s, 0}, {-0.8f * s, 0.8f * c, 0}, {0, 0, 1.1f}, {-0.4f, -0.9f, -0.5f}};
}

GridValues values_of(int nx, int ny, int nz, int channels, const std::function<float(Vec3d, int)>& at,
                     const Transform& to_world = {}) {
  GridValues grid;
  grid.nx = nx, grid.ny = ny, grid.nz = nz, grid.channels = channels;
  grid.to_world = to_world;
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x)
        for (int c = 0; c < channels; ++c)
          grid.values.push_back(at({(x + 0.5) / nx, (y + 0.5) / ny, (z + 0.5) / nz}, c));
  return grid;
}

GridValues random_values(unsigned seed, int nx, int ny, int nz, int channels, float greatest,
                         const Transform& to_world = turned_box()) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(0, greatest);
  // Half of the cells are empty, so that rays pass between others.
  return values_of(
      nx, ny, nz, channels, [&](Vec3d, int) { return std::max(0.0f, 2 * uniform(random) - greatest); }, to_world);
}

/// The value at a point of the world, as the sum over all cells of hats of one cell's width about their centres.
double oracle_value(const GridValues& grid, Vec3d world, int channel) {
  const auto inverse = [&](Vec3d p) {
    const Vec3d x = to_double(grid.to_world.x_axis), y = to_double(grid.to_world.y_axis),
                z = to_double(grid.to_world.z_axis), d = p - to_double(grid.to_world.origin);
    const double volume = dot(cross(x, y), z);
    return Vec3d{dot(cross(y, z), d) / volume, dot(cross(z, x), d) / volume, dot(cross(x, y), d) / volume};
  };
  const Vec3d p = inverse(world);
  for (const double c : {p.x, p.y, p.z})
    if (c < 0 || c > 1) return 0;
  const auto hat = [&](double at, int n, int i) {
    if (grid.nearest) return std::min(static_cast<int>(at * n), n - 1) == i ? 1.0 : 0.0;
    return std::max(0.0, 1 - std::abs(std::clamp(at * n - 0.5, 0.0, n - 1.0) - i));
  };
  double sum = 0;
  std::size_t index = 0;
  for (int z = 0; z < grid.nz; ++z)
    for (int y = 0; y < grid.ny; ++y)
      for (int x = 0; x < grid.nx; ++x)
        for (int c = 0; c < grid.channels; ++c, ++index)
          if (grid.channels == 1 || c == channel)
            sum += hat(p.x, grid.nx, x) * hat(p.y, grid.ny, y) * hat(p.z, grid.nz, z) *
                   static_cast<double>(grid.values[index]);
  return sum;
}

/// Optical depth along a line by the midpoint rule, cumulative.
struct OracleLine {
  std::vector<double> depth;
  double length, step;

  OracleLine(const GridValues& grid, Vec3 origin, Vec3 direction, double end, int channel, int steps = 4000)
      : depth{0}, length(end), step(end / steps) {
    for (int i = 0; i < steps; ++i)
      depth.push_back(depth.back() + step * oracle_value(grid,
                                                         to_double(origin) + ((i + 0.5) * step) * to_double(direction),
                                                         channel));
  }
  double at(double t) const {
    const double place = std::clamp(t / step, 0.0, static_cast<double>(depth.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(place), depth.size() - 2);
    return depth[i] + (place - static_cast<double>(i)) * (depth[i + 1] - depth[i]);
  }
};

struct Line {
  Vec3 origin, direction;
};

std::vector<Line> lines() {
  std::vector<Line> result{{{0, 0, -3}, {0, 0, 1}},  // along an axis of the box
                           {{-3, 0.1f, 0.2f}, {1, 0, 0}},
                           {{0, 0, 0.1f}, {0, 0, -1}}};  // from within
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 4; ++i) {
    const Vec3 d = normalize(Vec3{normal(random), normal(random), normal(random)});
    result.push_back({Vec3{0.1f, 0.2f, 0} - (i % 2 == 0 ? 2.0f : 0.1f) * d, d});
  }
  return result;
}

RandomStream stream(int sample) {
  return {SampleKey{11, 3, static_cast<std::uint32_t>(sample), 2}, Dimension::free_flight};
}
float number(int sample, std::uint32_t seed) {
  return sample_1d(SamplerKind::independent, {seed, 5, static_cast<std::uint32_t>(sample), 0}, Dimension::free_flight);
}

Flight fly(const GridMedium& medium, const Line& line, float end, int channel, int sample, std::uint64_t& exceeded) {
  RandomStream random = stream(sample);
  return track_grid_flight(medium, {line.origin, line.direction, 0, end, 0}, channel, flight_depth(number(sample, 12)),
                           random, exceeded);
}

/// Mean of a function of sample numbers, and its standard error.
template <class Value>
std::pair<double, double> mean_of(int samples, const Value& value) {
  double sum = 0, squares = 0;
  for (int i = 0; i < samples; ++i) {
    const double v = value(i);
    sum += v;
    squares += v * v;
  }
  const double mean = sum / samples;
  return {mean, std::sqrt(std::max(0.0, squares / samples - mean * mean) / samples)};
}

// ---- look-up -----------------------------------------------------------------------------------------------------

TEST(GridMedium, LooksUpBetweenCentres) {
  for (const bool nearest : {false, true}) {
    GridValues grid = random_values(1, 5, 1, 7, 3, 2, {});
    grid.nearest = nearest;
    std::mt19937 random(2);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 p{uniform(random), uniform(random), uniform(random)};
      const Rgb v = value_at(grid.view(), p);
      for (int c = 0; c < 3; ++c) ASSERT_NEAR(v[c], oracle_value(grid, to_double(p), c), 2e-5);
    }
  }
}

TEST(GridMedium, EdgesAreThoseOfTheOutermostCells) {
  const GridValues grid = values_of(2, 1, 1, 1, [](Vec3d p, int) { return p.x < 0.5 ? 1.0f : 3.0f; });
  for (const float x : {-0.5f, 0.0f, 0.1f, 0.25f}) EXPECT_EQ(value_at(grid.view(), {x, 0.5f, 0.5f}).r, 1);
  for (const float x : {0.75f, 0.9f, 1.0f, 1.5f}) EXPECT_EQ(value_at(grid.view(), {x, 0.5f, 0.5f}).r, 3);
  EXPECT_EQ(value_at(grid.view(), {0.5f, 0.5f, 0.5f}).r, 2);
}

// ---- transmittance -----------------------------------------------------------------------------------------------

// Extinction 2 + 3 x over the unit box, linear between the centres of 8 cells and constant beyond the outermost ones: along
// x from 0 to 1 the optical depth is 3.5, as the ends' excess and want cancel; from 0 to 1/2 it is
//   (2 + 3/16)/16 + integral of 2 + 3 x from 1/16 to 1/2 = 0.13671875 + 0.875 + 0.369140625.
TEST(GridTransmittance, OfARamp) {
  const GridMediumData data(values_of(8, 1, 1, 1, [](Vec3d p, int) { return static_cast<float>(2 + 3 * p.x); }), {}, {},
                            {});
  std::uint64_t exceeded = 0;
  for (const auto& [end, depth] : {std::pair{2.0f, 3.5}, {0.5f, 0.13671875 + 0.875 + 0.369140625}}) {
    const auto [mean, error] = mean_of(100000, [&](int i) {
      RandomStream random = stream(i);
      return static_cast<double>(
          track_grid_transmittance(data.view(), {{0, 0.3f, 0.6f}, {1, 0, 0}, 0, end, 0}, random, exceeded).g);
    });
    EXPECT_NEAR(mean, std::exp(-depth), 4 * error);
    EXPECT_LT(error, 0.002);
  }
  EXPECT_EQ(exceeded, 0u);
}

TEST(GridTransmittance, HasTheMeanOfTheQuadrature) {
  const GridValues values = random_values(3, 21, 9, 17, 3, 4);
  const GridMediumData data(values, {}, {}, {});
  std::uint64_t exceeded = 0;
  for (const Line& line : lines()) {
    for (int channel = 0; channel < 3; channel += 2) {
      const OracleLine oracle(values, line.origin, line.direction, 6, channel);
      const auto [mean, error] = mean_of(20000, [&](int i) {
        RandomStream random = stream(i);
        return static_cast<double>(track_grid_transmittance(data.view(), {line.origin, line.direction, 0, infinity, 0},
                                                            random, exceeded)[channel]);
      });
      EXPECT_NEAR(mean, std::exp(-oracle.depth.back()), 4 * error + 1e-4);
    }
  }
  EXPECT_EQ(exceeded, 0u);
}

TEST(GridTransmittance, IsOneBesideTheBox) {
  const GridMediumData data(random_values(3, 4, 4, 4, 1, 4), {}, {}, {});
  RandomStream random = stream(0);
  std::uint64_t exceeded = 0;
  for (const Line& line : {Line{{9, 0, 0}, {1, 0, 0}}, Line{{0, 0, 5}, {1, 0, 0}}, Line{{0, 0, 5}, {0, 0, 1}}}) {
    const DensityRay ray{line.origin, line.direction, 0, infinity, 0};
    EXPECT_EQ(track_grid_transmittance(data.view(), ray, random, exceeded), grey(1));
    EXPECT_FALSE(track_grid_flight(data.view(), ray, 0, 0.0f, random, exceeded).collided);
  }
}

// ---- free flight -------------------------------------------------------------------------------------------------

TEST(GridFlight, IsDistributedAsTheOpticalDepthSays) {
  for (const bool nearest : {false, true}) {
    GridValues values = random_values(5, 13, 10, 11, 3, 6);
    values.nearest = nearest;
    const GridMediumData data(values, {}, {}, {});
    std::uint64_t exceeded = 0;
    int line_number = 0;
    for (const Line& line : lines()) {
      const float end = line_number % 2 == 0 ? 6.0f : 1.5f;
      for (int channel = 0; channel < 3; channel += 2) {
        const OracleLine oracle(values, line.origin, line.direction, static_cast<double>(end), channel);
        // What a flight's length is as a probability; those that don't collide are spread over what is left.
        const auto value = [&](int i) {
          const int sample = i + 100000 * line_number;
          const Flight flight = fly(data.view(), line, end, channel, sample, exceeded);
          const double through = std::exp(-oracle.depth.back());
          const double p = flight.collided ? 1 - std::exp(-oracle.at(static_cast<double>(flight.t)))
                                           : 1 - through * (1 - static_cast<double>(number(sample, 13)));
          return std::clamp(p, 0.0, 1 - 1e-9);
        };
        EXPECT_GT(testing_support::uniform_p_value(value, 20000, 64), significance)
            << "line " << line_number << ", channel " << channel << ", optical depth " << oracle.depth.back();
      }
      ++line_number;
    }
    EXPECT_EQ(exceeded, 0u);
  }
}

// Flights drawn in any channel and weighted by the balance heuristic bring each channel what is its own.
TEST(GridFlight, SpectralWeightsAreUnbiased) {
  const GridValues values = random_values(8, 12, 12, 12, 3, 5);
  const GridMediumData data(values, {}, {}, {});
  const Line line = lines()[1];
  const Rgb shares{0.5f, 0.2f, 0.3f};
  std::uint64_t exceeded = 0;
  for (int c = 0; c < 3; ++c) {
    const double through = std::exp(-OracleLine(values, line.origin, line.direction, 6, c).depth.back());
    ASSERT_GT(through, 0.001);
    for (const bool collided : {false, true}) {
      const auto [mean, error] = mean_of(100000, [&](int i) {
        const int channel = draw_channel(shares, number(i, 17));
        const Flight flight = fly(data.view(), line, infinity, channel, i, exceeded);
        return flight.collided == collided ? static_cast<double>(spectral_weight(flight.ratio, shares)[c]) : 0.0;
      });
      EXPECT_NEAR(mean, collided ? 1 - through : through, 4 * error + 1e-4) << "channel " << c;
    }
  }
}

TEST(GridFlight, KnowsTheAlbedoWhereItCollides) {
  // The albedo's box is another than the extinction's.
  GridValues albedo = values_of(16, 1, 1, 3, [](Vec3d p, int c) { return static_cast<float>(p.x * (c + 1) / 3); });
  albedo.to_world = {{2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {-0.5f, -0.5f, -0.5f}};
  const GridMediumData data(values_of(3, 3, 3, 1, [](Vec3d, int) { return 5.0f; }), albedo, {}, {});
  std::uint64_t exceeded = 0;
  for (int i = 0; i < 200; ++i) {
    const Flight flight = fly(data.view(), {{-1, 0.5f, 0.5f}, {1, 0, 0}}, infinity, 0, i, exceeded);
    if (!flight.collided) continue;
    const double x = (static_cast<double>(flight.t) - 1 + 0.5) / 2;
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(flight.local.albedo[c], x * (c + 1) / 3, 1e-5);
  }
}

// ---- majorants ---------------------------------------------------------------------------------------------------

TEST(GridMajorants, Hold) {
  for (const int block : {1, 3, 8, 100}) {
    const GridMediumData data(random_values(6, 19, 8, 13, 3, 7, {}), {}, {}, {}, block);
    const GridMedium& medium = data.view();
    std::mt19937 random(7);
    std::uniform_real_distribution<float> uniform(0, 1);
    for (int i = 0; i < 20000; ++i) {
      const Vec3 p{uniform(random), uniform(random), uniform(random)};
      const auto index = [](float c, int n) { return std::min(static_cast<int>(c * static_cast<float>(n)), n - 1); };
      const CellGrid& blocks = medium.blocks;
      const Rgb majorant =
          medium.majorants[blocks.index(index(p.x, blocks.nx), index(p.y, blocks.ny), index(p.z, blocks.nz))];
      ASSERT_FALSE(exceeds(value_at(medium.extinction, p), majorant));
    }
  }
}

// Smaller blocks bound more tightly: an empty half of a grid costs nothing.
TEST(GridMajorants, AreLocal) {
  const GridMediumData data(values_of(32, 8, 8, 1, [](Vec3d p, int) { return p.x < 0.5 ? 0.0f : 9.0f; }), {}, {}, {});
  EXPECT_EQ(data.view().majorants[0].r, 0);
  EXPECT_EQ(data.view().majorants[3].r, 9);
}

TEST(GridMajorants, OneThatIsTooSmallIsCounted) {
  const GridMediumData data(values_of(4, 4, 4, 1, [](Vec3d, int) { return 5.0f; }), {}, {}, {});
  GridMedium wrong = data.view();
  const Rgb low = grey(1);
  wrong.majorants = &low;
  std::uint64_t exceeded = 0;
  RandomStream random = stream(0);
  for (int i = 0; i < 100; ++i) fly(wrong, {{-1, 0.5f, 0.5f}, {1, 0, 0}}, infinity, 0, i, exceeded);
  EXPECT_GT(exceeded, 10u);
  exceeded = 0;
  for (int i = 0; i < 100; ++i)
    track_grid_transmittance(wrong, {{-1, 0.5f, 0.5f}, {1, 0, 0}, 0, infinity, 0}, random, exceeded);
  EXPECT_GT(exceeded, 10u);
}

// A box far away is met as well as one near by; extreme extinctions end rays at once.
TEST(GridFlight, ExtremesEnd) {
  std::uint64_t exceeded = 0;
  for (const float k : {1e-20f, 1e4f, 1e12f, 1e30f}) {
    const GridMediumData data(values_of(9, 9, 9, 1, [&](Vec3d p, int) { return p.y < 0.5 ? k : 0.0f; }), {}, {}, {});
    for (const float distance : {0.0f, 1.0f, 1e4f}) {
      const Line line{{-distance, 0.2f, 0.5f}, {1, 0, 0}};
      RandomStream random = stream(0);
      const Flight flight = fly(data.view(), line, infinity, 0, 1, exceeded);
      const Rgb through =
          track_grid_transmittance(data.view(), {line.origin, line.direction, 0, infinity, 0}, random, exceeded);
      EXPECT_EQ(flight.collided, k > 1);
      if (k > 1) {
        EXPECT_NEAR(flight.t, distance, 1e-3f + 1e-3f * distance);
        EXPECT_LT(through.r, 1e-3f);
      } else {
        EXPECT_EQ(through.r, 1);
      }
    }
  }
  EXPECT_EQ(exceeded, 0u);
}

}  // namespace
}  // namespace embrun
