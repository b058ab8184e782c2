#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "geometry/oracle_vectors.h"

// Moving least squares surfaces by looking at all points in double precision, everywhere along the ray. Written from the
// definition of the surface alone: it shares no header with what it judges.

namespace embrun::mls_oracle {

using namespace oracle_vectors;

struct Point {
  V center, normal;
  double support = 1;
};

/// What is a surface: see the limits of the same names in mls_line.h.
struct Rules {
  double reach = 0.3, least_weight = 0.1, least_agreement = 0.1;
};

inline double weight_of(double r) { return r < 1 ? std::pow(1 - r, 4) * (4 * r + 1) : 0; }

struct Value {
  double weight = 0, support = 0;
  V normal{}, away{};

  /// n(x) . (x - a(x)), normalised: a length.
  double field() const { return norm(normal) > 0 ? dot(normal, away) / (weight * norm(normal)) : 0; }
};

inline Value value_at(const std::vector<Point>& points, V x) {
  Value v;
  for (const Point& p : points) {
    const V q = x - p.center;
    const double w = weight_of(norm(q) / p.support);
    v.weight += w;
    v.support += w * p.support;
    v.normal = v.normal + w * p.normal;
    v.away = v.away + w * q;
  }
  return v;
}

struct Answer {
  bool found = false, entering = false;
  double t = 0;
  V normal{};    ///< n(x)
  V gradient{};  ///< of f, unit, by differences
  double margin =
      1;  ///< how near any decision up to the answer was to being another, relative to the scale of what it is about
};

/// The first surface along a ray. `step` is a share of the least support.
class Search {
 public:
  Search(const std::vector<Point>& all, V origin, V direction, const Rules& rules)
      : o_(origin), d_(direction), rules_(rules) {
    for (const Point& p : all) {
      const V q = p.center - o_;
      const double along = dot(q, d_), across = norm(q - along * d_);
      if (across >= p.support) continue;
      near_.push_back(p);
      first_ = std::min(first_, along - p.support);
      last_ = std::max(last_, along + p.support);
      least_ = std::min(least_, p.support);
    }
  }

  /// `sides`: 0 both, 1 fronts, -1 backs.
  Answer run(double t_min, int sides, double step = 0.01) const {
    Answer answer;
    const double h = step * least_;
    double a = std::max(first_, t_min), fa = field(a);
    double b = a + h, fb = field(b);
    for (; b < last_;) {
      const double c = b + h, fc = field(c);
      if (crosses(a, fa, b, fb, sides, answer)) return answer;
      // A pair of zeros between the samples, or nearly one.
      if (fa * fb > 0 && fb * fc > 0 && std::abs(fb) <= std::abs(fa) && std::abs(fb) <= std::abs(fc)) {
        const double least = least_between(a, c, fb > 0 ? 1 : -1);
        const double f = field(least);
        if (f * fb < 0) {
          if (crosses(a, fa, least, f, sides, answer)) return answer;
          if (crosses(least, f, c, fc, sides, answer)) return answer;
        } else if (f != 0) {
          answer.margin = std::min(answer.margin, std::abs(f) / least_);
        }
      }
      a = b;
      fa = fb;
      b = c;
      fb = fc;
    }
    return answer;
  }

 private:
  V o_, d_;
  Rules rules_;
  std::vector<Point> near_;
  double first_ = 1e300, last_ = -1e300, least_ = 1e300;

  V at(double t) const { return o_ + t * d_; }
  double field(double t) const { return value_at(near_, at(t)).field(); }

  /// Where |f| is least in [a, c], by golden sections.
  double least_between(double a, double c, double sign) const {
    constexpr double g = 0.6180339887498949;
    double x = c - g * (c - a), y = a + g * (c - a);
    double fx = sign * field(x), fy = sign * field(y);
    for (int i = 0; i < 40; ++i) {
      if (fx < fy) {
        c = y;
        y = x;
        fy = fx;
        x = c - g * (c - a);
        fx = sign * field(x);
      } else {
        a = x;
        x = y;
        fx = fy;
        y = a + g * (c - a);
        fy = sign * field(y);
      }
    }
    return 0.5 * (a + c);
  }

  bool crosses(double a, double fa, double b, double fb, int sides, Answer& answer) const {
    if (!(fa * fb < 0)) return false;
    const bool entering = fa > 0;
    for (int i = 0; i < 60; ++i) {
      const double m = 0.5 * (a + b), fm = field(m);
      (fm * fa > 0 ? a : b) = m;
    }
    const double t = 0.5 * (a + b);
    const Value v = value_at(near_, at(t));
    V gradient;
    const double e = 1e-5 * least_;
    for (std::size_t k = 0; k < 3; ++k) {
      V step{};
      step[k] = e;
      gradient[k] = (value_at(near_, at(t) + step).field() - value_at(near_, at(t) - step).field()) / (2 * e);
    }
    const double steep = norm(gradient), along = std::abs(dot(gradient, d_)) / std::max(steep, 1e-300);
    const double outwards = dot(gradient, v.normal) / std::max(steep * norm(v.normal), 1e-300);
    const double reach = norm(v.away) / v.support, agreement = norm(v.normal) / v.weight;
    // Which of the decisions was a near thing. Of those that say no, the one that says so most clearly counts.
    double yes = 1, no = 0;
    const auto decide = [&](double distance) {
      yes = std::min(yes, std::abs(distance));
      if (distance < 0) no = std::max(no, -distance);
    };
    decide((v.weight - rules_.least_weight) / rules_.least_weight);
    decide(rules_.reach - reach);
    decide(agreement - rules_.least_agreement);
    decide(outwards);
    if (no > 0) {
      answer.margin = std::min(answer.margin, no);
      return false;
    }
    answer.margin = std::min({answer.margin, yes, along});
    if (sides != 0 && entering != (sides > 0)) return false;
    answer.found = true;
    answer.entering = entering;
    answer.t = t;
    answer.normal = (1 / norm(v.normal)) * v.normal;
    answer.gradient = (1 / steep) * gradient;
    return true;
  }
};

}  // namespace embrun::mls_oracle
