// Free flight and transmittance against brute force (density_oracle.h).

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "density_oracle.h"
#include "media/flight_batch.h"
#include "support/chi_square.h"

namespace embrun {
namespace {

using test::OracleRay;
using test::Particles;

/// Every chi-square test below fails by chance with this probability.
constexpr double significance = 1e-4;

struct Line {
  Vec3 origin, direction;
  float end;
};

/// Lines from outside, from within balls, and ones that end midway.
std::vector<Line> lines(std::mt19937& random, int count, float size) {
  std::uniform_real_distribution<float> uniform(-0.5f, 0.5f);
  std::normal_distribution<float> normal;
  std::vector<Line> result;
  for (int i = 0; i < count; ++i) {
    const Vec3 inside = 0.8f * size * Vec3{uniform(random), uniform(random), uniform(random)};
    const Vec3 direction = normalize(Vec3{normal(random), normal(random), normal(random)});
    if (i % 3 == 0) result.push_back({inside - 2 * size * direction, direction, infinity});
    if (i % 3 == 1) result.push_back({inside, direction, infinity});
    if (i % 3 == 2) result.push_back({inside, direction, 0.3f * size});
  }
  result.push_back({{0.01f, 0.02f, -3 * size}, {0, 0, 1}, infinity});  // along an axis
  return result;
}

RandomStream stream(std::uint32_t sample) { return {SampleKey{11, 3, sample, 2}, Dimension::free_flight}; }

float first_number(std::uint32_t sample) {
  return sample_1d(SamplerKind::independent, {12, 5, sample, 0}, Dimension::free_flight);
}

/// What a flight's length is as a probability: the share of flights that are shorter. Those that don't collide are spread
/// over what is left.
double as_probability(const OracleRay& oracle, const Flight& flight, int channel, double u) {
  const double through = std::exp(-oracle.total[channel]);
  if (!flight.collided) return 1 - through * (1 - u);
  return 1 - std::exp(-oracle.depth(static_cast<double>(flight.t), channel));
}

struct Case {
  const char* name;
  int fluids;
  MediaOverlap overlap;
  FlightSampler sampler;
  bool colours = false;
  float radius_spread = 1;
};
void PrintTo(const Case& c, std::ostream* os) { *os << c.name; }

class FreeFlight : public ::testing::TestWithParam<Case> {
 protected:
  std::mt19937 random{GetParam().fluids + 10 * static_cast<unsigned>(GetParam().overlap)};
  Particles particles;

  ParticleDensity build(float extinction) {
    const Case& c = GetParam();
    for (int f = 0; f < c.fluids; ++f)
      particles.add_fluid(random, 600, 1, 0.06f, c.radius_spread, extinction / static_cast<float>(1 + f), c.colours);
    return particles.build(c.overlap);
  }
};

TEST_P(FreeFlight, IsDistributedAsTheOpticalDepthSays) {
  const Case& c = GetParam();
  const ParticleDensity density = build(12);
  std::uint64_t exceeded = 0;
  int line_number = 0;
  for (const Line& line : lines(random, 6, 1)) {
    const OracleRay oracle(particles.oracle, to_double(line.origin), normalize(to_double(line.direction)), 0,
                           line.end < infinity ? static_cast<double>(line.end) : 10);
    for (int channel = 0; channel < (c.colours ? 3 : 1); ++channel) {
      const auto value = [&](int i) {
        const auto sample = static_cast<std::uint32_t>(i + 100000 * line_number);
        RandomStream random_numbers = stream(sample);
        const DensityRay ray{line.origin, line.direction, 0, line.end};
        const Flight flight =
            next_collision(density.view(), ray, c.sampler, channel, first_number(sample), random_numbers, exceeded);
        const double u =
            static_cast<double>(sample_1d(SamplerKind::independent, {13, 1, sample, 0}, Dimension::free_flight));
        return std::clamp(as_probability(oracle, flight, channel, u), 0.0, 1 - 1e-9);
      };
      const double p = testing_support::uniform_p_value(value, 20000, 64);
      EXPECT_GT(p, significance) << "line " << line_number << ", channel " << channel << ", optical depth "
                                 << oracle.total[channel];
    }
    ++line_number;
  }
  EXPECT_EQ(exceeded, 0u);
}

// A flight drawn in any channel and weighted by the balance heuristic brings each channel what is its own: to the far end
// its transmittance, and to collisions the rest.
class ColouredFlight : public FreeFlight {};
TEST_P(ColouredFlight, SpectralWeightsAreUnbiased) {
  const Case& c = GetParam();
  const ParticleDensity density = build(12);
  std::uint64_t exceeded = 0;
  for (const Line& line : lines(random, 3, 1)) {
    const OracleRay oracle(particles.oracle, to_double(line.origin), normalize(to_double(line.direction)), 0,
                           line.end < infinity ? static_cast<double>(line.end) : 10);
    const Rgb throughput{0.7f, 0.2f, 0.4f};
    const Rgb shares = channel_shares(throughput);
    constexpr int samples = 40000;
    double through[3] = {}, through_squares[3] = {}, all[3] = {}, all_squares[3] = {};
    for (std::uint32_t i = 0; i < samples; ++i) {
      RandomStream numbers = stream(i);
      const int channel = draw_channel(shares, sample_1d(SamplerKind::independent, {1, 2, i, 3}, Dimension::channel));
      const Flight flight = next_collision(density.view(), {line.origin, line.direction, 0, line.end}, c.sampler,
                                           channel, first_number(i), numbers, exceeded);
      const Rgb weight = spectral_weight(flight.ratio, shares);
      for (int j = 0; j < 3; ++j) {
        EXPECT_GE(weight[j], 0);
        const auto w = static_cast<double>(weight[j]);
        all[j] += w;
        all_squares[j] += w * w;
        if (flight.collided) continue;
        through[j] += w;
        through_squares[j] += w * w;
      }
      // The sum of the throughput never changes.
      EXPECT_NEAR(shares.r * weight.r + shares.g * weight.g + shares.b * weight.b, 1, 1e-4);
    }
    for (int j = 0; j < 3; ++j) {
      const auto check = [&](double sum, double squares, double expected) {
        const double mean = sum / samples, error = std::sqrt(std::max(0.0, squares / samples - mean * mean) / samples);
        EXPECT_NEAR(mean, expected, 4.5 * error + 1e-5) << "channel " << j;
      };
      check(all[j], all_squares[j], 1);
      check(through[j], through_squares[j], std::exp(-oracle.total[j]));
    }
  }
}

// Which fluid of a mixture collides: the share of each by the integral of its own extinction.
class MixedFlight : public FreeFlight {};
TEST_P(MixedFlight, FluidsCollideInProportion) {
  const Case& c = GetParam();
  const ParticleDensity density = build(12);
  const Line line{{-2, 0.05f, 0.03f}, normalize(Vec3{1, 0.02f, 0.01f}), infinity};
  const OracleRay oracle(particles.oracle, to_double(line.origin), normalize(to_double(line.direction)), 0, 10);
  std::vector<double> expected(static_cast<std::size_t>(c.fluids), 0.0);
  for (const OracleRay::Piece& piece : oracle.pieces) {
    if (piece.k[0] <= 0) continue;
    const double share = std::exp(-piece.depth[0]) - std::exp(-piece.depth[0] - piece.k[0] * (piece.end - piece.begin));
    const Vec3d middle =
        to_double(line.origin) + (0.5 * (piece.begin + piece.end)) * normalize(to_double(line.direction));
    int which = -1;
    double k[3];
    particles.oracle.extinction(middle, ~0u, k, &which);
    for (std::size_t f = 0; f < expected.size(); ++f) {
      if (c.overlap == MediaOverlap::sum)
        expected[f] += share * static_cast<double>(particles.oracle.own_extinction(f, middle).r) / piece.k[0];
      else if (static_cast<int>(f) == which)
        expected[f] += share;
    }
  }
  constexpr int samples = 50000;
  std::vector<int> counted(expected.size());
  std::uint64_t exceeded = 0;
  for (std::uint32_t i = 0; i < samples; ++i) {
    RandomStream numbers = stream(i);
    const Flight flight =
        next_collision(density.view(), {line.origin, line.direction}, c.sampler, 0, first_number(i), numbers, exceeded);
    if (flight.collided) ++counted[static_cast<std::size_t>(flight.local.fluid)];
  }
  for (std::size_t f = 0; f < expected.size(); ++f) {
    EXPECT_GT(expected[f], 0.01) << "the test line says nothing of fluid " << f;
    EXPECT_NEAR(counted[f] / static_cast<double>(samples), expected[f],
                4.5 * std::sqrt(expected[f] * (1 - expected[f]) / samples))
        << "fluid " << f;
  }
}

constexpr FlightSampler tracking = FlightSampler::tracking, events = FlightSampler::events;
const Case mixtures[] = {
    {"two_min_tracking", 2, MediaOverlap::min, tracking},   {"two_min_events", 2, MediaOverlap::min, events},
    {"two_max_tracking", 2, MediaOverlap::max, tracking},   {"two_max_events", 2, MediaOverlap::max, events},
    {"two_sum_tracking", 2, MediaOverlap::sum, tracking},   {"two_sum_events", 2, MediaOverlap::sum, events},
    {"three_min_tracking", 3, MediaOverlap::min, tracking}, {"three_min_events", 3, MediaOverlap::min, events},
    {"three_max_tracking", 3, MediaOverlap::max, tracking}, {"three_max_events", 3, MediaOverlap::max, events},
    {"three_sum_tracking", 3, MediaOverlap::sum, tracking}, {"three_sum_events", 3, MediaOverlap::sum, events}};
const Case coloured[] = {{"colours_tracking", 2, MediaOverlap::sum, tracking, true},
                         {"colours_events", 2, MediaOverlap::sum, events, true},
                         {"colours_max_tracking", 2, MediaOverlap::max, tracking, true}};
const Case single[] = {{"one_tracking", 1, MediaOverlap::sum, tracking},
                       {"one_events", 1, MediaOverlap::sum, events},
                       {"many_sizes_tracking", 1, MediaOverlap::sum, tracking, false, 0.01f},
                       {"many_sizes_events", 1, MediaOverlap::sum, events, false, 0.01f}};
const auto name_of = [](const auto& test) { return std::string(test.param.name); };
INSTANTIATE_TEST_SUITE_P(Single, FreeFlight, ::testing::ValuesIn(single), name_of);
INSTANTIATE_TEST_SUITE_P(Mixtures, FreeFlight, ::testing::ValuesIn(mixtures), name_of);
INSTANTIATE_TEST_SUITE_P(Coloured, FreeFlight, ::testing::ValuesIn(coloured), name_of);
INSTANTIATE_TEST_SUITE_P(Mixtures, MixedFlight, ::testing::ValuesIn(mixtures), name_of);
INSTANTIATE_TEST_SUITE_P(Coloured, ColouredFlight, ::testing::ValuesIn(coloured), name_of);

// ---- many at once --------------------------------------------------------------------------------------------------

struct Queries {
  std::vector<FlightQuery> queries;
  std::vector<Flight> answers;
  std::vector<int> settled;

  explicit Queries(std::vector<FlightQuery> list)
      : queries(std::move(list)), answers(queries.size()), settled(queries.size()) {}
  int count() const { return static_cast<int>(queries.size()); }
  FlightQuery query(int i) const { return queries[static_cast<std::size_t>(i)]; }
  void settle(int i, const Flight& flight) {
    answers[static_cast<std::size_t>(i)] = flight;
    ++settled[static_cast<std::size_t>(i)];
  }
};

// Flights under way together end as they would alone, to the last bit, and each is answered once.
class FlightBatch : public FreeFlight {};
TEST_P(FlightBatch, AnswersAsOneByOne) {
  const Case& c = GetParam();
  const ParticleDensity density = build(12);
  const std::vector<Line> ways = lines(random, 100, 1);
  for (const std::size_t count : {0u, 1u, 15u, 16u, 17u, 101u}) {
    std::vector<FlightQuery> list;
    for (std::size_t i = 0; i < count; ++i) {
      const auto sample = static_cast<std::uint32_t>(i);
      // Some may meet nothing.
      const std::uint32_t fluids = i % 5 == 0 ? 0u : i % 5 == 1 ? 1u : ~0u;
      const DensityRay ray{ways[i].origin, ways[i].direction, 0, ways[i].end, fluids};
      list.push_back({ray, c.colours ? static_cast<int>(i % 3) : 0, first_number(sample), stream(sample)});
    }
    Queries queries(list);
    std::uint64_t together = 0, alone = 0;
    next_collisions(density.view(), c.sampler, queries, together);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_EQ(queries.settled[i], 1);
      FlightQuery& q = list[i];
      const Flight flight = next_collision(density.view(), q.ray, c.sampler, q.channel, q.u, q.random, alone);
      const Flight& answer = queries.answers[i];
      EXPECT_EQ(answer.collided, flight.collided) << i;
      EXPECT_EQ(answer.t, flight.t) << i;
      EXPECT_EQ(answer.ratio, flight.ratio) << i;
      EXPECT_EQ(answer.local.fluid, flight.local.fluid) << i;
      EXPECT_EQ(answer.local.extinction, flight.local.extinction) << i;
    }
    EXPECT_EQ(together, alone);
  }
}
INSTANTIATE_TEST_SUITE_P(Single, FlightBatch, ::testing::ValuesIn(single), name_of);
INSTANTIATE_TEST_SUITE_P(Mixtures, FlightBatch, ::testing::ValuesIn(mixtures), name_of);
INSTANTIATE_TEST_SUITE_P(Coloured, FlightBatch, ::testing::ValuesIn(coloured), name_of);

// ---- transmittance -------------------------------------------------------------------------------------------------

TEST(Transmittance, IsExactByEvents) {
  for (const MediaOverlap overlap : {MediaOverlap::min, MediaOverlap::max, MediaOverlap::sum}) {
    std::mt19937 random(5);
    Particles particles;
    particles.add_fluid(random, 2000, 1, 0.04f, 1, 3);
    particles.add_fluid(random, 2000, 1, 0.04f, 0.2f, 2, true);
    const ParticleDensity density = particles.build(overlap);
    std::uint64_t exceeded = 0;
    RandomStream unused;
    for (const Line& line : lines(random, 60, 1)) {
      const OracleRay oracle(particles.oracle, to_double(line.origin), normalize(to_double(line.direction)), 0,
                             line.end < infinity ? static_cast<double>(line.end) : 10);
      const Rgb got =
          transmittance(density.view(), {line.origin, line.direction, 0, line.end}, events, unused, exceeded);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c], std::exp(-oracle.total[c]), 1e-5);
    }
  }
}

TEST(Transmittance, HasTheSameMeanByTracking) {
  std::mt19937 random(6);
  Particles particles;
  particles.add_fluid(random, 1000, 1, 0.05f, 1, 4);
  particles.add_fluid(random, 1000, 1, 0.05f, 0.5f, 4, true);
  const ParticleDensity density = particles.build(MediaOverlap::sum);
  std::uint64_t exceeded = 0;
  for (const Line& line : lines(random, 6, 1)) {
    const OracleRay oracle(particles.oracle, to_double(line.origin), normalize(to_double(line.direction)), 0,
                           line.end < infinity ? static_cast<double>(line.end) : 10);
    constexpr int samples = 20000;
    double sum[3] = {}, squares[3] = {};
    for (std::uint32_t i = 0; i < samples; ++i) {
      RandomStream numbers = stream(i);
      const Rgb got =
          transmittance(density.view(), {line.origin, line.direction, 0, line.end}, tracking, numbers, exceeded);
      for (int c = 0; c < 3; ++c) {
        EXPECT_GE(got[c], 0);
        sum[c] += static_cast<double>(got[c]);
        squares[c] += static_cast<double>(got[c] * got[c]);
      }
    }
    for (int c = 0; c < 3; ++c) {
      const double mean = sum[c] / samples;
      const double error = std::sqrt(std::max(0.0, squares[c] / samples - mean * mean) / samples);
      EXPECT_NEAR(mean, std::exp(-oracle.total[c]), 4.5 * error + 1e-6);
    }
  }
  EXPECT_EQ(exceeded, 0u);
}

// Fluids that the mask leaves out are not there.
TEST(Transmittance, CountsTheFluidsOfTheMask) {
  std::mt19937 random(7);
  Particles particles;
  for (int f = 0; f < 3; ++f) particles.add_fluid(random, 400, 1, 0.06f, 1, 3);
  const ParticleDensity density = particles.build(MediaOverlap::max);
  std::uint64_t exceeded = 0;
  RandomStream unused;
  for (const unsigned mask : {0u, 1u, 2u, 5u, 7u}) {
    for (const Line& line : lines(random, 6, 1)) {
      const OracleRay oracle(particles.oracle, to_double(line.origin), normalize(to_double(line.direction)), 0,
                             line.end < infinity ? static_cast<double>(line.end) : 10, mask);
      const DensityRay ray{line.origin, line.direction, 0, line.end, mask};
      EXPECT_NEAR(transmittance(density.view(), ray, events, unused, exceeded).g, std::exp(-oracle.total[1]), 1e-5);
    }
  }
}

}  // namespace
}  // namespace embrun
