#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "geometry/oracle_vectors.h"

// Which hit a ray has on a cloud of splats, by looking at all of them in double precision. Written from the description of
// the method alone: it shares no header with what it judges.

namespace embrun::splat_oracle {

using namespace oracle_vectors;

/// Centre, unit normal, and the two half axes as vectors (a disc: any two of equal length at right angles).
struct Disc {
  V center, normal, major, minor;
};

struct Hit {
  double t = 0;
  std::size_t disc = 0;
  double share = 0;  // 1 - d / r
  bool front = false;
};

struct Answer {
  bool found = false;
  double t = 0;
  V normal{};
  std::vector<std::size_t> group;
  bool entering = false;
  bool by_fronts = false;  ///< it was met from behind with fronts so near by that it may be an edge seen from outside
  /// How near the nearest decision was to going the other way, in units of what decides; small answers are chance.
  double margin = std::numeric_limits<double>::infinity();
};

inline std::vector<Hit> all_hits(const std::vector<Disc>& discs, V origin, V direction, double t_min, double& margin) {
  std::vector<Hit> hits;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const Disc& d = discs[i];
    const double along = dot(direction, d.normal);
    if (along == 0) continue;
    const double t = dot(d.center - origin, d.normal) / along;
    const V p = origin + t * direction - d.center;
    const double u = dot(p, d.major) / dot(d.major, d.major), v = dot(p, d.minor) / dot(d.minor, d.minor);
    const double reach = std::sqrt(u * u + v * v);
    // A ray that is nearly in the disc's plane is a matter of rounding.
    if (reach < 2) margin = std::min(margin, std::abs(1 - reach) * std::abs(along));
    if (reach <= 1 && t > t_min) hits.push_back({t, i, 1 - reach, along < 0});
  }
  std::sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.t < b.t; });
  return hits;
}

/// True when the ray passes by the sphere that touches the fronts hits[begin, end) (by their mean) and the back hits[end],
/// where they are of one smooth sheet.
inline bool passes_by(const std::vector<Disc>& discs, const std::vector<Hit>& hits, std::size_t begin, std::size_t end,
                      V origin, V direction, double sign, double& margin) {
  V n{}, c{};
  double weights = 0, radius = 0;
  for (std::size_t k = begin; k < end; ++k) {
    const Disc& d = discs[hits[k].disc];
    n = n + hits[k].share * d.normal;
    c = c + hits[k].share * d.center;
    weights += hits[k].share;
    radius = std::max(radius, norm(d.major));
  }
  n = (1 / weights) * n;
  c = (1 / weights) * c;
  const Disc& back = discs[hits[end].disc];
  const double apart = (hits[end].t - hits[end - 1].t) / (radius + norm(back.major));
  margin = std::min({margin, std::abs(apart - 1), std::abs(dot(n, back.normal) - 0.5)});
  if (apart > 1 || dot(n, back.normal) < 0.5) return false;
  const V turned = sign * (back.normal - n);
  const double rho = dot(turned, back.center - c) / dot(turned, turned);
  margin = std::min(margin, std::abs(dot(turned, back.center - c)) / radius);
  if (!(rho > 0)) return false;
  const V center = 0.5 * (c + back.center) - (0.5 * sign * rho) * (n + back.normal);
  const V from = origin - center;
  const double distance = norm(from - dot(from, direction) * direction);
  margin = std::min(margin, 0.1 * std::abs(distance - rho) / radius);
  return distance > rho;
}

/// True when the hit's place lies beyond an edge of the surface: on the way from there to the disc's centre another disc is
/// passed from its front that is more than an eighth of its radius behind the place, and that forms a ridge with this one.
inline bool beyond_edge(const std::vector<Disc>& discs, const Hit& hit, V origin, V direction, double& margin) {
  const Disc& own = discs[hit.disc];
  const V met = origin + hit.t * direction, way = own.center - met;
  bool beyond = false;
  for (std::size_t j = 0; j < discs.size(); ++j) {
    const Disc& d = discs[j];
    const double along = dot(way, d.normal), before = dot(met - d.center, d.normal) / norm(d.major);
    const double s = dot(d.center - met, d.normal) / along;
    const V p = met + s * way - d.center;
    const double u = dot(p, d.major) / dot(d.major, d.major), v = dot(p, d.minor) / dot(d.minor, d.minor);
    const double reach = std::sqrt(u * u + v * v);
    if (j == hit.disc || !(reach < 1.1) || s < -0.1 || s > 1.1 || before < 0.1) continue;
    const double ridge = -dot(d.center - own.center, own.normal - d.normal) / norm(d.center - own.center);
    margin = std::min({margin, std::abs(1 - reach) * std::abs(along) / norm(way), std::abs(before - 0.125),
                       std::abs(1 - s), std::abs(ridge)});
    beyond = beyond || (reach <= 1 && s < 1 && before > 0.125 && ridge >= 0);
  }
  return beyond;
}

/// True when a disc that faces the ray reaches to within a radius of the way from three radii before the hit to one behind.
inline bool has_fronts_beside(const std::vector<Disc>& discs, const Hit& hit, V origin, V direction) {
  const double radius = norm(discs[hit.disc].major);
  return std::any_of(discs.begin(), discs.end(), [&](const Disc& d) {
    const V to = d.center - origin;
    const double t = std::clamp(dot(to, direction), hit.t - 3 * radius, hit.t + radius);
    return dot(direction, d.normal) < 0 && norm(to - t * direction) <= norm(d.major) + 1.01 * radius;
  });
}

/// The surface that a ray meets. `reach`: hits within so many radii (the least of the group's greater half axes) of its first
/// are a group. `closed`, `inside`: see the method's far phase.
inline Answer surface(const std::vector<Disc>& discs, V origin, V direction, double t_min, double reach, bool closed,
                      bool inside) {
  Answer answer;
  std::vector<Hit> hits = all_hits(discs, origin, direction, t_min, answer.margin);
  for (std::size_t i = 1; i < hits.size(); ++i)
    answer.margin = std::min(answer.margin, (hits[i].t - hits[i - 1].t) / norm(discs[hits[i].disc].major));
  std::size_t begin = 0;
  while (begin < hits.size()) {
    const auto is_front = [&](const Hit& h) { return h.front != inside; };
    if (closed && !is_front(hits[begin])) {
      ++begin;
      continue;
    }
    double window = reach * norm(discs[hits[begin].disc].major);
    std::size_t end = begin + 1;
    for (; end < hits.size() && hits[end].front == hits[begin].front; ++end) {
      const double narrower = std::min(window, reach * norm(discs[hits[end].disc].major));
      const double gap = hits[end].t - hits[begin].t;
      answer.margin = std::min(answer.margin, std::abs(gap - narrower) / narrower);
      if (gap > narrower) break;
      window = narrower;
    }
    bool overhang = closed && (end == hits.size() ? !inside : is_front(hits[end]));
    if (closed && !inside && end == hits.size()) {
      // By a hole: 0.35 is the sine of the slant at which splats reach over a silhouette.
      const double steep = -dot(direction, discs[hits[begin].disc].normal);
      answer.margin = std::min(answer.margin, std::abs(steep - 0.35));
      overhang = steep <= 0.35;
    }
    if (closed && end < hits.size() && !overhang)
      overhang = passes_by(discs, hits, begin, end, origin, direction, inside ? -1 : 1, answer.margin);
    if (!closed && !hits[begin].front) {
      overhang = true;
      for (std::size_t k = begin; k < end && overhang; ++k)
        overhang = beyond_edge(discs, hits[k], origin, direction, answer.margin);
    }
    if (overhang) {
      begin = end;
      continue;
    }
    const double sign = hits[begin].front ? 1 : -1;
    std::size_t chosen = begin;
    V normal{};
    for (std::size_t k = begin; k < end; ++k) {
      const Disc& b = discs[hits[k].disc];
      normal = normal + hits[k].share * b.normal;
      answer.group.push_back(hits[k].disc);
      if (k == begin) continue;
      const Disc& a = discs[hits[chosen].disc];
      const V c = b.center - a.center;
      // The angle as the thesis has it.
      const double angle = std::acos(std::clamp(sign * dot(c, a.normal) / norm(c), -1.0, 1.0)) +
                           std::acos(std::clamp(-sign * dot(c, b.normal) / norm(c), -1.0, 1.0));
      answer.margin = std::min(answer.margin, std::abs(angle - 3.14159265358979323846));
      if (!(angle < 3.14159265358979323846)) chosen = k;
    }
    answer.found = true;
    answer.t = hits[chosen].t;
    answer.entering = hits[begin].front;
    answer.by_fronts = !closed && !hits[begin].front && has_fronts_beside(discs, hits[begin], origin, direction);
    answer.normal = norm(normal) > 0 ? (1 / norm(normal)) * normal : discs[hits[chosen].disc].normal;
    return answer;
  }
  return answer;
}

}  // namespace embrun::splat_oracle
