// The oracle itself: against bodies with known answers, and against wrong answers, each of which it must catch.

#include "measure/oracle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "measure/ray_recorder.h"

namespace oracle {
namespace {

using embrun::measure::Dice;

Vec random_direction(Dice& dice) {
  const embrun::Vec3 d = dice.direction();
  const Vec v{d.x, d.y, d.z};
  return v * (1 / length(v));
}

/// A ball of radius 1 about the origin: the metaball's f(1/2) = 3/8 at influence 2.
Surface unit_ball() { return {Kernel::metaball, {{{0, 0, 0}, 2, 1, 1 / 0.375, true}}}; }

Answer answer_at(const Ray& ray, double t, bool entering) {
  const Vec p = ray.origin + ray.direction * t;
  return {true, t, entering, p, p * (1 / length(p))};
}

Verdict verdict_on_ball(Vec origin, Vec direction, Start side, const Answer& answer) {
  return judge(unit_ball(), {origin, direction}, side, answer, 1e-3).verdict;
}

TEST(Oracle, FindsBothCrossingsOfABall) {
  const Surface ball = unit_ball();
  Dice dice(1);
  for (int i = 0; i < 2000; ++i) {
    // Past the centre at distance h: crossings at 5 -+ sqrt(1 - h^2).
    const Vec d = random_direction(dice);
    const Vec other = random_direction(dice);
    Vec side = other - d * dot(other, d);
    side = side * (1 / length(side));
    const double h = 1.2 * dice.next();
    const Ray ray{side * h - d * 5.0, d};
    Crossings crossings(ball, ray, 1e-6);
    EXPECT_FALSE(crossings.starts_inside());
    double t;
    if (h > 1) {
      EXPECT_FALSE(crossings.next(t));
      continue;
    }
    const double half = std::sqrt(1 - h * h);
    ASSERT_TRUE(crossings.next(t)) << h;
    EXPECT_NEAR(t, 5 - half, 1e-9);
    ASSERT_TRUE(crossings.next(t));
    EXPECT_NEAR(t, 5 + half, 1e-9);
    EXPECT_FALSE(crossings.next(t));
  }
}

TEST(Oracle, FindsAllThatDenseSamplingFinds) {
  // Random clouds of both branches and all kernels: every change of sign between samples R/300 apart is found, and
  // nothing else that lasts longer than the samples are apart.
  for (const Kernel kernel : {Kernel::metaball, Kernel::zhu_bridson, Kernel::blinn}) {
    Dice dice(7);
    std::vector<Particle> particles;
    for (int i = 0; i < 400; ++i) {
      const Vec p{6 * dice.next(), 6 * dice.next(), 6 * dice.next()};
      const bool recovered = dice.next() < 0.3;
      particles.push_back({p, recovered ? 2.0 * 0.3 : 4.0 * 0.3, 0.3, recovered ? 1 / 0.375 : 1 / 2.0, recovered});
    }
    const Surface surface(kernel, particles);
    int changes = 0;
    for (int i = 0; i < 20; ++i) {
      const Vec d = random_direction(dice);
      const Ray ray{Vec{3, 3, 3} + random_direction(dice) * 2.0 - d * 4.0, d, 0, 9};
      std::vector<double> found;
      Crossings crossings(surface, ray, 1e-6);
      for (double t; crossings.next(t);) found.push_back(t);
      bool inside = surface.inside(ray.origin);
      EXPECT_EQ(crossings.starts_inside(), inside);
      const double step = 1e-3;
      std::size_t k = 0;
      for (double t = step; t < 9; t += step) {
        const bool now = surface.inside(ray.origin + d * t);
        // Pairs closer than a step may lie between samples.
        while (k + 1 < found.size() && found[k + 1] < t && found[k + 1] - found[k] < step) k += 2;
        if (now == inside) continue;
        ASSERT_LT(k, found.size());
        EXPECT_NEAR(found[k], t - step / 2, step);
        ++k;
        ++changes;
        inside = now;
      }
    }
    EXPECT_GT(changes, 20);
  }
}

TEST(Oracle, AcceptsWhatIsRight) {
  EXPECT_EQ(verdict_on_ball({-5, 0, 0}, {1, 0, 0}, Start::outside, answer_at({{-5, 0, 0}, {1, 0, 0}}, 4.0, true)),
            Verdict::right);
  EXPECT_EQ(verdict_on_ball({0, 0, 0}, {0, 1, 0}, Start::inside, answer_at({{0, 0, 0}, {0, 1, 0}}, 1.0, false)),
            Verdict::right);
  EXPECT_EQ(verdict_on_ball({-5, 1.1, 0}, {1, 0, 0}, Start::unknown, {}), Verdict::right);
  // Off by less than the tolerance along the normal: here 0.8 of it.
  EXPECT_EQ(verdict_on_ball({-5, 0, 0}, {1, 0, 0}, Start::outside, answer_at({{-5, 0, 0}, {1, 0, 0}}, 4.0008, true)),
            Verdict::right);
  // A graze shallower than the tolerance may be hit or not.
  const Ray graze{{-5, 1 - 5e-4, 0}, {1, 0, 0}};
  EXPECT_EQ(verdict_on_ball(graze.origin, graze.direction, Start::outside, {}), Verdict::right);
  EXPECT_EQ(verdict_on_ball(graze.origin, graze.direction, Start::outside, answer_at(graze, 5.0, true)),
            Verdict::right);
  // A near miss within the tolerance too.
  const Ray miss{{-5, 1 + 5e-4, 0}, {1, 0, 0}};
  EXPECT_EQ(verdict_on_ball(miss.origin, miss.direction, Start::outside, answer_at(miss, 5.0, true)), Verdict::right);
  // A start that rounding put across the surface: leaving outwards, and through the ball.
  EXPECT_EQ(verdict_on_ball({1 - 1e-6, 0, 0}, {1, 0, 0}, Start::outside, {}), Verdict::right);
  EXPECT_EQ(verdict_on_ball({1 + 1e-6, 0, 0}, {-1, 0, 0}, Start::inside,
                            answer_at({{1 + 1e-6, 0, 0}, {-1, 0, 0}}, 2 + 1e-6, false)),
            Verdict::right);
}

TEST(Oracle, FindsAirThatIsThinnerThanTheTolerance) {
  // Two balls of radius 1, one of each branch, 1e-4 apart where they are nearest: a hit of the first, 3e-4 early, is within
  // the tolerance of the air between them, and one 1.5e-3 early is not.
  const Surface balls(Kernel::metaball,
                      {{{0, 0, 0}, 2, 1, 1 / 0.375, false}, {{2 + 1e-4, 0, 0}, 2, 1, 1 / 0.375, true}});
  const Ray ray{{0.5, 0, 0}, {1, 0, 0}};
  EXPECT_TRUE(balls.surface_within({1 - 3e-4, 0, 0}, 1e-3));
  EXPECT_FALSE(balls.surface_within({1 - 1.5e-3, 0, 0}, 1e-3));
  EXPECT_EQ(judge(balls, ray, Start::inside, answer_at(ray, 0.5 - 3e-4, false), 1e-3).verdict, Verdict::right);
  EXPECT_EQ(judge(balls, ray, Start::inside, answer_at(ray, 0.5 - 1.5e-3, false), 1e-3).verdict, Verdict::early);
}

TEST(Oracle, CatchesWhatIsWrong) {
  const Ray through{{-5, 0, 0}, {1, 0, 0}};
  const auto judged = [&](const Answer& answer) {
    return verdict_on_ball(through.origin, through.direction, Start::outside, answer);
  };
  EXPECT_EQ(judged({}), Verdict::missed);
  EXPECT_EQ(judged(answer_at(through, 4.0015, true)), Verdict::late);
  EXPECT_EQ(judged(answer_at(through, 6.0, true)), Verdict::late);
  EXPECT_EQ(judged(answer_at(through, 3.9985, true)), Verdict::early);
  EXPECT_EQ(judged(answer_at(through, 4.0, false)), Verdict::wrong_way);
  Answer turned = answer_at(through, 4.0, true);
  turned.normal = {0, 1, 0};
  EXPECT_EQ(judged(turned), Verdict::bad_normal);
  turned = answer_at(through, 4.0, true);
  turned.position.y += 0.01;
  EXPECT_EQ(judged(turned), Verdict::bad_normal);
  // Nothing there.
  const Ray past{{-5, 2, 0}, {1, 0, 0}};
  EXPECT_EQ(verdict_on_ball(past.origin, past.direction, Start::outside, answer_at(past, 4.0, true)),
            Verdict::false_hit);
  // A penetration of 1.5 tolerances that is not hit.
  EXPECT_EQ(verdict_on_ball({-5, 1 - 1.5e-3, 0}, {1, 0, 0}, Start::outside, {}), Verdict::missed);
  // A ray that goes in from the surface and meets it again at once instead of on the far side.
  const Ray inward{{-1, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(verdict_on_ball(inward.origin, inward.direction, Start::inside, answer_at(inward, 0.0, false)),
            Verdict::wrong_way);
  // From inside: never out.
  EXPECT_EQ(verdict_on_ball({0, 0, 0}, {1, 0, 0}, Start::inside, {}), Verdict::missed);
}

TEST(Oracle, KernelsAreTheFormulas) {
  EXPECT_DOUBLE_EQ(kernel_value(Kernel::metaball, 0.5), 0.375);
  EXPECT_NEAR(kernel_value(Kernel::metaball, 1.0 / 3), 2.0 / 3, 1e-15);
  EXPECT_DOUBLE_EQ(kernel_value(Kernel::zhu_bridson, 0.5), 27.0 / 64);
  EXPECT_NEAR(kernel_value(Kernel::blinn, 1.0 / 3), 2.0 / 3, 1e-15);
  for (const Kernel kernel : {Kernel::metaball, Kernel::zhu_bridson, Kernel::blinn}) {
    EXPECT_DOUBLE_EQ(kernel_value(kernel, 0), 1);
    for (double u = 0.01; u < kernel_support(kernel) - 0.01; u += 0.013) {
      const double difference = (kernel_value(kernel, u + 1e-6) - kernel_value(kernel, u - 1e-6)) / 2e-6;
      EXPECT_NEAR(kernel_slope(kernel, u), difference, 1e-5);
    }
  }
}

}  // namespace
}  // namespace oracle
