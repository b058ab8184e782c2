#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "media/particle_density_build.h"

// Extinction and optical depth of overlapping balls by the definitions of method section 3, in double precision: every
// event of every ball is sorted, and the point between two events is looked up by going through all balls.

namespace embrun::test {

struct OracleBall {
  Vec3d center;
  double radius;
  double extinction[3];
};

struct OracleScene {
  std::vector<std::vector<OracleBall>> fluids;
  MediaOverlap overlap = MediaOverlap::sum;

  /// Extinction of one fluid at a point: the mean over the balls that hold it.
  Rgb own_extinction(std::size_t fluid, Vec3d p) const {
    double sum[3] = {0, 0, 0};
    int count = 0;
    for (const OracleBall& ball : fluids[fluid]) {
      if (length(p - ball.center) > ball.radius) continue;
      ++count;
      for (int c = 0; c < 3; ++c) sum[c] += ball.extinction[c];
    }
    if (count == 0) return {};
    return {static_cast<float>(sum[0] / count), static_cast<float>(sum[1] / count), static_cast<float>(sum[2] / count)};
  }

  /// What counts at a point, of the fluids in `mask`; `which` receives the fluid of min and max.
  void extinction(Vec3d p, unsigned mask, double (&k)[3], int* which = nullptr) const {
    double best = -1;
    k[0] = k[1] = k[2] = 0;
    for (std::size_t f = 0; f < fluids.size(); ++f) {
      if ((mask >> f & 1u) == 0) continue;
      const Rgb own = own_extinction(f, p);
      const double rank = (static_cast<double>(own.r) + static_cast<double>(own.g) + static_cast<double>(own.b)) / 3;
      if (rank <= 0) continue;
      if (overlap == MediaOverlap::sum) {
        for (int c = 0; c < 3; ++c) k[c] += static_cast<double>(own[c]);
        continue;
      }
      if (best >= 0 && (overlap == MediaOverlap::min ? rank >= best : rank <= best)) continue;
      best = rank;
      for (int c = 0; c < 3; ++c) k[c] = static_cast<double>(own[c]);
      if (which != nullptr) *which = static_cast<int>(f);
    }
  }
};

/// Optical depth along a ray, as pieces of constant extinction.
class OracleRay {
 public:
  struct Piece {
    double begin, end;
    double k[3];
    double depth[3];  ///< up to `begin`
  };
  std::vector<Piece> pieces;
  double total[3] = {0, 0, 0};

  OracleRay(const OracleScene& scene, Vec3d origin, Vec3d direction, double t_begin, double t_end,
            unsigned mask = ~0u) {
    std::vector<double> events{t_begin, t_end};
    for (const auto& fluid : scene.fluids)
      for (const OracleBall& ball : fluid) {
        const Vec3d to = ball.center - origin;
        const double middle = dot(to, direction);
        const Vec3d off = to - middle * direction;
        const double half_squared = ball.radius * ball.radius - dot(off, off);
        if (half_squared <= 0) continue;
        const double half = std::sqrt(half_squared);
        for (const double t : {middle - half, middle + half})
          if (t > t_begin && t < t_end) events.push_back(t);
      }
    std::sort(events.begin(), events.end());
    for (std::size_t i = 0; i + 1 < events.size(); ++i) {
      Piece piece{events[i], events[i + 1], {}, {total[0], total[1], total[2]}};
      if (piece.end <= piece.begin) continue;
      scene.extinction(origin + (0.5 * (piece.begin + piece.end)) * direction, mask, piece.k);
      for (int c = 0; c < 3; ++c) total[c] += piece.k[c] * (piece.end - piece.begin);
      pieces.push_back(piece);
    }
  }

  /// Optical depth up to t in a channel.
  double depth(double t, int channel) const {
    auto after =
        std::upper_bound(pieces.begin(), pieces.end(), t, [](double v, const Piece& p) { return v < p.begin; });
    if (after == pieces.begin()) return 0;
    const Piece& piece = *(after - 1);
    return piece.depth[channel] + piece.k[channel] * (std::min(t, piece.end) - piece.begin);
  }
};

/// The same particles for the oracle and for the code under test.
struct Particles {
  std::vector<std::vector<Vec3>> positions;
  std::vector<std::vector<float>> radii;
  std::vector<DensityParticles> inputs;
  OracleScene oracle;

  /// `colours`: extinctions differ from channel to channel, and from ball to ball.
  void add_fluid(std::mt19937& random, int count, float size, float radius, float radius_spread, float extinction,
                 bool colours = false) {
    std::uniform_real_distribution<float> uniform(0, 1);
    auto& points = positions.emplace_back();
    auto& own_radii = radii.emplace_back();
    auto& balls = oracle.fluids.emplace_back();
    DensityParticles input;
    input.extinction = grey(extinction);
    input.albedo = grey(0.5f);
    input.radius = radius;
    for (int i = 0; i < count; ++i) {
      const Vec3 p = size * Vec3{uniform(random) - 0.5f, uniform(random) - 0.5f, uniform(random) - 0.5f};
      const float r = radius * std::pow(radius_spread, uniform(random));
      points.push_back(p);
      own_radii.push_back(r);
      OracleBall ball{to_double(p), static_cast<double>(r), {}};
      if (colours) {
        const Rgb k = extinction * Rgb{uniform(random), 0.3f * uniform(random), i % 3 == 0 ? 0 : 2 * uniform(random)};
        input.extinctions.push_back(k);
        for (int c = 0; c < 3; ++c) ball.extinction[c] = static_cast<double>(k[c]);
      } else {
        const float factor = i % 7 == 0 ? 0 : 0.5f + uniform(random);
        input.factors.push_back(factor);
        for (double& k : ball.extinction) k = static_cast<double>(extinction * factor);
      }
      balls.push_back(ball);
    }
    inputs.push_back(std::move(input));
  }

  ParticleDensity build(MediaOverlap overlap, float brick = 0) {
    oracle.overlap = overlap;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      inputs[i].positions = positions[i];
      inputs[i].radii = radii[i];
    }
    return ParticleDensity(inputs, overlap, brick);
  }
};

}  // namespace embrun::test
