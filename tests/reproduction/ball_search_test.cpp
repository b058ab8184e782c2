#include "reproduction/ball_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "base/error.h"
#include "support/cubic_lattice.h"

namespace embrun {
namespace {

/// Chords of a ray, in double, over all balls.
std::vector<BallChord> brute_force(const std::vector<Vec3>& centers, double radius, Vec3d origin, Vec3d direction,
                                   double end) {
  std::vector<BallChord> chords;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    const Vec3d to = to_double(centers[i]) - origin;
    const double middle = dot(to, direction), squared = radius * radius - (dot(to, to) - middle * middle);
    if (squared <= 1e-9) continue;  // grazed: rounding decides
    const double half = std::sqrt(squared);
    if (middle + half <= 0 || middle - half >= end) continue;
    chords.push_back(
        {static_cast<float>(middle - half), static_cast<float>(middle + half), static_cast<std::uint32_t>(i)});
  }
  return chords;
}

void sort_by_ball(std::vector<BallChord>& chords) {
  std::sort(chords.begin(), chords.end(), [](const BallChord& a, const BallChord& b) { return a.ball < b.ball; });
}

// In random clouds and on a lattice whose faces rays run along; from inside and outside, with and without an end.
TEST(BallSearch, FindsAllBallsOfARayOnce) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1, 1);
  constexpr float radius = 0.125f;
  for (const bool lattice : {false, true}) {
    std::vector<Vec3> centers;
    if (lattice) {
      centers = testing_support::cubic_lattice(8, 8, 8, 0.25f);
    } else {
      for (int i = 0; i < 700; ++i) centers.push_back({uniform(random), uniform(random), 0.3f * uniform(random)});
    }
    const BallGrid grid(centers, radius);
    const BallKdTree tree(centers, radius);
    MetBalls met(centers.size());
    std::size_t all = 0;
    for (int ray = 0; ray < 1500; ++ray) {
      Vec3 origin{1.5f * uniform(random), 1.5f * uniform(random), 1.5f * uniform(random)};
      Vec3 direction = normalize(Vec3{uniform(random), uniform(random), uniform(random)} - 0.7f * origin);
      if (ray % 5 == 0) direction = ray % 2 == 0 ? Vec3{0, -1, 0} : Vec3{1, 0, 0};
      if (ray % 10 == 0) origin = {0.125f, 1.0f, 0.125f};
      const float end = ray % 3 == 0 ? 0.7f : std::numeric_limits<float>::infinity();
      std::vector<BallChord> wanted = brute_force(centers, static_cast<double>(radius), to_double(origin),
                                                  to_double(direction), static_cast<double>(end));
      all += wanted.size();
      for (const bool by_tree : {false, true}) {
        std::vector<BallChord> found;
        met.next_ray();
        if (by_tree)
          tree.gather(origin, direction, end, met, found);
        else
          grid.gather(origin, direction, end, met, found);
        std::erase_if(found, [](const BallChord& c) { return c.exit - c.enter < 1e-4f; });
        std::vector<BallChord> long_enough = wanted;
        std::erase_if(long_enough, [](const BallChord& c) { return c.exit - c.enter < 1e-4f; });
        sort_by_ball(found);
        ASSERT_EQ(found.size(), long_enough.size())
            << (by_tree ? "tree" : "grid") << ", ray " << ray << ", lattice " << lattice;
        for (std::size_t i = 0; i < found.size(); ++i) {
          ASSERT_EQ(found[i].ball, long_enough[i].ball);
          EXPECT_NEAR(found[i].exit - found[i].enter, long_enough[i].exit - long_enough[i].enter, 2e-3f);
        }
      }
    }
    EXPECT_GT(all, 800u);
  }
}

TEST(BallSearch, ComparesBoth) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::vector<Vec3> centers;
  for (int i = 0; i < 3000; ++i) centers.push_back({uniform(random), uniform(random), uniform(random)});
  const BallSearchFigures figures = compare_ball_search(centers, 0.04f, 500);
  EXPECT_TRUE(figures.agree);
  EXPECT_EQ(figures.rays, 500u);
  EXPECT_GT(figures.grid.rays_per_second, 0);
  EXPECT_GT(figures.tree.rays_per_second, 0);
  // 3000 balls of section pi 0.04^2 in a cubic metre: 15 a metre. From a random place in a cube it is about half a metre out.
  EXPECT_GT(figures.chords_per_ray, 4);
  EXPECT_LT(figures.chords_per_ray, 15);
  EXPECT_THROW(compare_ball_search({}, 0.1f, 1), Error);
  EXPECT_TRUE(compare_ball_search(std::vector<Vec3>{{1, 2, 3}}, 0.1f, 10).agree);
}

}  // namespace
}  // namespace embrun
