#pragma once

#include "geometry/box.h"
#include "geometry/splat_hits.h"
#include "geometry/surface_hit.h"
#include "math/rgb.h"

// Which hit a ray has on a cloud of splats, and the normal there [Beddiaf2018, 2.3].

namespace embrun {

/// A view of a cloud's splats. Splat i is lane i % splats_per_block of block i / splats_per_block; arrays of what splats
/// have besides are by that number.
struct SplatSet {
  const SplatBlock* blocks = nullptr;
  std::uint32_t block_count = 0;
  const Rgb* colors = nullptr;       ///< linear, or null: they are all white
  const SplatBend* bends = nullptr;  ///< linear fields of normals, or null: a splat has one normal
  bool closed = false;               ///< the splats bound a body
  Box3 bounds;                       ///< of all splats and a little more

  EMBRUN_FN Splat splat(std::uint32_t index) const {
    return blocks[index / splats_per_block].splat(index % splats_per_block);
  }
};

/// Splats that reach over a silhouette are tangents of the surface less than a diameter away from it: where its radius of
/// curvature is 4 radii (see splat_sheet_depth) a ray that passes by meets them at less than half a radian, and mostly at
/// less than two thirds of that. The sine.
inline constexpr float splat_edge_slant = 0.35f;

/// Where splats are not resolved: as if the first hit were the surface's. For pictures of what the rules are good for.
enum class SplatRules : std::uint8_t { resolve, first_hit };

/// The near phase: which of the group's splats is the surface, and the normal and colour that the group has there.
/// over_edge(): see comes_over_an_edge(); asked only where it matters.
template <class OverEdge>
EMBRUN_LOCAL_FN void fill_splat_hit(const SplatSet& set, const Ray& ray, const SplatHits& hits, SplatRules rules,
                                    const OverEdge& over_edge, SurfaceHit& hit) {
  const SplatHits::Hit& first = hits.member(0);
  const bool entering = first.meeting.along < 0.0f;
  const float sign = entering ? 1.0f : -1.0f;
  const int size = hits.group_size();
  int chosen = 0;
  Splat surface = set.splat(first.index);
  Vec3 normals;
  Rgb color;
  float shares = 0.0f;
  for (int i = 0; i < size; ++i) {
    const SplatHits::Hit& member = hits.member(i);
    const Splat splat = set.splat(member.index);
    if (i > 0 && rules == SplatRules::resolve && !form_hollow(surface, splat, sign)) {
      chosen = i;
      surface = splat;
    }
    const float share = member.meeting.share;
    const Vec3 from_center = ray.at(member.meeting.t) - splat.center;
    normals += share * (set.bends != nullptr ? bent_normal(splat, set.bends[member.index], from_center) : splat.normal);
    if (set.colors != nullptr) color += share * set.colors[member.index];
    shares += share;
  }
  hit.t = hits.member(chosen).meeting.t;
  const Vec3 met = ray.at(hit.t);
  hit.position = met - dot(met - surface.center, surface.normal) * surface.normal;
  hit.entering = entering;
  hit.splat_radius = surface.radius;
  hit.shading_normal = length_squared(normals) > 0.0f ? normalize(normals) : surface.normal;
  // An open cloud's splats of the far side that reach over its silhouette are met at a slant from behind. They are taken for
  // the surface's edge, which is lit from outside, and not for its inside, which is dark; and so are those that a ray came
  // to over a sharp edge.
  const float slant = dot(ray.direction, hit.shading_normal);
  const bool resolves_edges = !set.closed && rules == SplatRules::resolve;
  if (resolves_edges && ((slant > 0.0f && slant < splat_edge_slant) || (!entering && over_edge()))) {
    if (slant > 0.0f) hit.shading_normal = normalize(hit.shading_normal - (slant + 0.02f) * ray.direction);
    hit.entering = true;
  }
  // Sides are those of the splat, and where the smooth normal agrees on them it is the better one.
  const bool agrees = (dot(ray.direction, hit.shading_normal) < 0.0f) == hit.entering;
  hit.geometric_normal = agrees ? hit.shading_normal : surface.normal;
  if (set.colors != nullptr)
    hit.color = shares > 0.0f ? color * (1.0f / shares) : set.colors[hits.member(chosen).index];
}

/// What a back that follows a group of fronts says.
///
/// Near the silhouette of a smooth body discs of its far side reach over it as those of the near side do, so that a ray that
/// passes by meets fronts and then a back. Both are tangents of the surface, and the sphere that touches the discs where
/// they have their centres [Guennebaud2007] tells whether the ray comes through the body between them. Where the normals
/// are too different for one smooth sheet, or the two lie apart, the ray does.
EMBRUN_LOCAL_FN bool comes_through(const SplatSet& set, const Ray& ray, const SplatHits& hits, const SplatMeeting& back,
                                   std::uint32_t back_index, float sign) {
  Vec3 normal, center;
  float shares = 0.0f, radius = 0.0f, t = 0.0f;
  for (int i = 0; i < hits.group_size(); ++i) {
    const SplatHits::Hit& member = hits.member(i);
    const Splat splat = set.splat(member.index);
    const float share = member.meeting.share + 1e-6f;
    normal += share * splat.normal;
    center += share * splat.center;
    shares += share;
    radius = max_of(radius, splat.radius);
    t = member.meeting.t;
  }
  const Splat other = set.splat(back_index);
  if (back.t - t > radius + other.radius) return true;
  normal *= 1.0f / shares;
  center *= 1.0f / shares;
  if (dot(normal, other.normal) < splat_sheet_cosine) return true;
  // Centres and normals differ by as much on a sphere of radius 1.
  const Vec3 turned = sign * (other.normal - normal);
  const float curvature_radius = dot(turned, other.center - center) / length_squared(turned);
  if (!(curvature_radius > 0.0f) || !is_finite(curvature_radius)) return true;
  const Vec3 middle = 0.5f * (center + other.center) - (0.5f * sign * curvature_radius) * (normal + other.normal);
  const Vec3 from_ray = middle - ray.at(0.5f * (t + back.t));
  const Vec3 across = from_ray - dot(from_ray, ray.direction) * ray.direction;
  return length_squared(across) <= square(curvature_radius);
}

/// True where a ray meets a group from behind beyond an edge of the surface. Where a body is thin, or ends in an edge,
/// splats of its far side reach over its silhouette, and nothing else along the ray says that they do.
template <class Search>
EMBRUN_LOCAL_FN bool beyond_an_edge(const SplatSet& set, const Search& search, const Ray& ray, const SplatHits& hits) {
  for (int i = 0; i < hits.group_size(); ++i) {
    const SplatHits::Hit& member = hits.member(i);
    const Splat splat = set.splat(member.index);
    SplatEdge edge(splat, ray, member.meeting.t);
    search(edge);
    if (!edge.found()) return false;
  }
  return true;
}

/// True where a ray meets a group from behind but came over a sharp edge, where splats of the near side leave gaps.
template <class Search>
EMBRUN_LOCAL_FN bool comes_over_an_edge(const SplatSet& set, const Search& search, const Ray& ray,
                                        const SplatHits& hits) {
  const SplatHits::Hit& first = hits.member(0);
  for (int side = 0; side < SplatBeside::sides; ++side) {
    SplatBeside beside(set.splat(first.index).radius, ray, first.meeting.t, side);
    search(beside);
    if (beside.found()) return true;
  }
  return false;
}

/// First crossing of the cloud's surface with t in (t_min, t_max); false leaves `hit` alone. `inside`: the ray starts in
/// the body, if it is one. `search(query)` shows query.consider() every splat that query.ray() meets with t in
/// [query.near(), query.limit()], and may show others.
///
/// The far phase: a closed body is entered by a group of fronts that a back follows. Fronts that other fronts follow, or
/// nothing, are splats that reach over the silhouette; so are those that comes_through() tells. From inside it is the same
/// with the sides exchanged, but that the last surface has nothing behind it.
/// Scans have small holes, and a ray that leaves the body by one would meet nothing: fronts that it meets steeply, as none are
/// that reach over a smooth silhouette, need no back behind them.
template <class Search>
EMBRUN_LOCAL_FN bool intersect_splats(const SplatSet& set, const Search& search, const Ray& ray, bool inside,
                                      const SplatStart& start, SurfaceHit& hit,
                                      SplatRules rules = SplatRules::resolve) {
  // Rays from afar start anew at the cloud, so that its splats are met with the precision that they have.
  const BoxSpan span = clip_line(set.bounds, ray);
  if (span.empty() || !(span.exit > ray.t_min) || !(span.enter < ray.t_max)) return false;
  const float skipped = max_of(span.enter, 0.0f);
  Ray near = ray;
  near.origin = ray.at(skipped);
  near.cone_width += near.cone_spread * skipped;
  near.t_min -= skipped;
  near.t_max -= skipped;

  const SplatView view{set.closed && rules == SplatRules::resolve, inside};
  SplatHits hits(near, view, start);
  for (;;) {
    search(hits);
    if (!hits.has_group()) return false;
    bool surface = true;
    if (view.closed) {
      const float sign = inside ? -1.0f : 1.0f;
      if (const SplatHits::Hit* next = hits.follower(); next != nullptr) {
        surface = !next->front && comes_through(set, near, hits, next->meeting, next->index, sign);
      } else {
        SplatFollower next_far(near, view, start, hits);
        search(next_far);
        surface = next_far.found()
                      ? !next_far.front() && comes_through(set, near, hits, next_far.meeting(), next_far.index(), sign)
                      : inside || -sign * hits.member(0).meeting.along > splat_edge_slant;
      }
    } else if (rules == SplatRules::resolve && hits.member(0).meeting.along > 0.0f) {
      surface = !beyond_an_edge(set, search, near, hits);
    }
    if (surface) {
      SurfaceHit met;
      const auto over_edge = [&] { return comes_over_an_edge(set, search, near, hits); };
      fill_splat_hit(set, near, hits, rules, over_edge, met);
      met.t += skipped;
      // The first of the group is in the ray's extent; the one that is the surface may lie behind its end.
      if (!(met.t < ray.t_max)) return false;
      hit = met;
      return true;
    }
    hits.restart_after(SplatHits::Hit(hits.last_member()));
  }
}

/// Where to look whether a point is in a body: no special directions, and none opposite to another.
inline constexpr int splat_inside_directions = 5;
EMBRUN_FN Vec3 splat_inside_direction(int i) {
  const Vec3 directions[splat_inside_directions] = {{0.371f, 0.743f, 0.557f},
                                                    {-0.863f, 0.211f, 0.459f},
                                                    {0.127f, -0.905f, 0.406f},
                                                    {0.482f, 0.365f, -0.796f},
                                                    {-0.339f, -0.518f, -0.785f}};
  return normalize(directions[i]);
}

/// True where most rays from a point meet a back first, as they do in a closed body. Several are asked, as splats that reach
/// over the silhouette say the opposite. `first(ray, hit)` finds what a ray meets first, front or back, if anything.
template <class First>
EMBRUN_LOCAL_FN bool most_meet_backs(Vec3 point, const First& first) {
  int backs = 0;
  for (int i = 0; i < splat_inside_directions; ++i) {
    Ray ray;
    ray.origin = point;
    ray.direction = splat_inside_direction(i);
    SurfaceHit hit;
    if (first(ray, hit) && !hit.entering) ++backs;
  }
  return 2 * backs > splat_inside_directions;
}

/// True for points in a closed body.
template <class Search>
EMBRUN_LOCAL_FN bool splats_contain(const SplatSet& set, const Search& search, Vec3 point) {
  SplatSet open = set;
  open.closed = false;
  return most_meet_backs(
      point, [&](const Ray& ray, SurfaceHit& hit) { return intersect_splats(open, search, ray, false, {}, hit); });
}

}  // namespace embrun
