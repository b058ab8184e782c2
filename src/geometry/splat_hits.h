#pragma once

#include "geometry/splat.h"
#include "geometry/splat_start.h"

// The splats along a ray in order, as far as they matter: the first group of those that lie together, and what follows.

namespace embrun {

/// Splats that a ray meets within so many radii of each other, on the same side, are one group: the least radius of the
/// group counts. Splats that overlap on one sheet lie an eighth of a radius apart (see splat_sheet_depth), and further
/// along a ray that comes at a slant: a radius is enough for all that are met at more than 7 degrees to the surface. Sheets
/// that the ray meets from different sides are never in one group, however near they are.
inline constexpr float splat_group_reach = 1.0f;

/// True where two splats that the ray meets one after the other form a hollow: the angle between them, on the side the ray
/// comes from, is less than 180 degrees. It is the sum of acos(+c . N_a / |c|) and acos(-c . N_b / |c|) with c from a
/// to b, and acos is monotonous. `sign`: -1 where the ray comes from behind.
EMBRUN_FN bool form_hollow(const Splat& a, const Splat& b, float sign) {
  return sign * dot(b.center - a.center, a.normal - b.normal) > 0.0f;
}

/// How a cloud is looked at from where a ray is.
struct SplatView {
  bool closed = false;  ///< the cloud bounds a body: what the ray is to meet depends on its side
  bool inside = false;  ///< of that body
};

/// Collects what a search offers in any order, and tells it how far to look.
class SplatHits {
 public:
  /// Hits that are kept. Of a group that is larger the first so many count.
  static constexpr int capacity = 32;

  struct Hit {
    SplatMeeting meeting;
    std::uint32_t index;
    float window;  ///< see splat_group_reach
    bool front;
  };

  /// Nothing at or before t_min of the ray counts, nor does what is at t_max or beyond unless a group begins before.
  EMBRUN_FN SplatHits(const Ray& ray, const SplatView& view, const SplatStart& start)
      : ray_(ray), view_(view), start_(start), limit_(ray.t_max), after_(ray.t_min) {}

  /// Forgets what was found, and goes on with what comes after a hit.
  EMBRUN_FN void restart_after(const Hit& hit) {
    after_ = hit.meeting.t;
    after_index_ = hit.index;
    limit_ = ray_.t_max;
    count_ = 0;
    first_ = last_ = -1;
  }

  EMBRUN_FN const Ray& ray() const { return ray_; }
  EMBRUN_FN float near() const { return after_; }
  EMBRUN_FN float limit() const { return limit_; }

  /// What the search has found may be met.
  EMBRUN_FN void consider(const Splat& splat, std::uint32_t index) {
    Hit hit;
    if (!meet_splat(splat, ray_, hit.meeting)) return;
    const float t = hit.meeting.t;
    if (!(t <= limit_) || t < after_ || (t == after_ && index <= after_index_) || (count_ == 0 && t == limit_)) return;
    hit.front = (hit.meeting.along < 0.0f) != view_.inside;
    if (of_the_sheet_left(start_, splat, ray_.origin, hit.meeting.along)) return;
    hit.index = index;
    hit.window = splat_group_reach * splat.radius;
    insert(hit);
    find_group();
  }

  EMBRUN_FN bool has_group() const { return first_ >= 0; }
  EMBRUN_FN int group_size() const { return last_ - first_ + 1; }
  EMBRUN_FN const Hit& member(int i) const { return hits_[first_ + i]; }
  EMBRUN_FN const Hit& last_member() const { return hits_[last_]; }
  /// What comes after the group, or null: not known to be anything.
  EMBRUN_FN const Hit* follower() const { return last_ + 1 < count_ ? &hits_[last_ + 1] : nullptr; }
  EMBRUN_FN float group_window() const { return window_; }

 private:
  const Ray& ray_;
  SplatView view_;
  SplatStart start_;
  float limit_, after_;
  std::uint32_t after_index_ = ~0u;
  float window_ = 0;
  int count_ = 0;
  int first_ = -1, last_ = -1;  ///< of the group
  Hit hits_[capacity];

  EMBRUN_FN static bool before(const Hit& a, const Hit& b) {
    return a.meeting.t < b.meeting.t || (a.meeting.t == b.meeting.t && a.index < b.index);
  }

  EMBRUN_FN void insert(const Hit& hit) {
    // Some searches come by a splat several times.
    for (int i = 0; i < count_; ++i)
      if (hits_[i].index == hit.index) return;
    // Without a front yet the nearest backs matter least: any that follows a front does.
    const int drop = count_ == capacity ? (first_ < 0 ? 0 : capacity - 1) : count_;
    if (count_ == capacity) {
      if (before(hit, hits_[drop]) != (drop > 0)) return;
      for (int i = drop; i + 1 < count_; ++i) hits_[i] = hits_[i + 1];
      --count_;
    }
    int i = count_++;
    for (; i > 0 && before(hit, hits_[i - 1]); --i) hits_[i] = hits_[i - 1];
    hits_[i] = hit;
  }

  /// Finds the group among the hits so far and shortens the search to what may still change it or follow it. As the
  /// group's window only shrinks when a hit is added, nothing that is cut off is missed later.
  EMBRUN_FN void find_group() {
    first_ = 0;
    if (view_.closed) {
      while (first_ < count_ && !hits_[first_].front) ++first_;
      if (first_ == count_) {
        first_ = -1;
        return;
      }
    }
    const Hit& nearest = hits_[first_];
    last_ = first_;
    window_ = nearest.window;
    while (last_ + 1 < count_) {
      const Hit& next = hits_[last_ + 1];
      const float window = min_of(window_, next.window);
      if (next.front != nearest.front || next.meeting.t - nearest.meeting.t > window) break;
      window_ = window;
      ++last_;
    }
    if (last_ + 1 < count_) {
      limit_ = min_of(limit_, hits_[last_ + 1].meeting.t);
      count_ = last_ + 2;
    } else if (!view_.closed) {
      limit_ = min_of(limit_, nearest.meeting.t + window_);
    } else if (count_ == capacity) {
      limit_ = min_of(limit_, hits_[last_].meeting.t);
    }
  }
};

/// Finds the first splat after a group that does not belong to it, however far away.
class SplatFollower {
 public:
  EMBRUN_FN SplatFollower(const Ray& ray, const SplatView& view, const SplatStart& start, const SplatHits& group)
      : ray_(ray),
        view_(view),
        start_(start),
        last_(group.last_member()),
        group_end_(group.member(0).meeting.t + group.group_window()) {}

  EMBRUN_FN const Ray& ray() const { return ray_; }
  EMBRUN_FN float near() const { return last_.meeting.t; }
  EMBRUN_FN float limit() const { return meeting_.t; }

  EMBRUN_FN void consider(const Splat& splat, std::uint32_t index) {
    SplatMeeting meeting;
    if (!meet_splat(splat, ray_, meeting)) return;
    const float t = meeting.t;
    const float limit = meeting_.t;
    if (t > limit || (t == limit && index > index_) || t < near() || (t == near() && index <= last_.index)) return;
    const bool front = (meeting.along < 0.0f) != view_.inside;
    if (front == last_.front && t <= group_end_) return;
    if (of_the_sheet_left(start_, splat, ray_.origin, meeting.along)) return;
    meeting_ = meeting;
    index_ = index;
    front_ = front;
  }

  EMBRUN_FN bool found() const { return meeting_.t < infinity; }
  EMBRUN_FN const SplatMeeting& meeting() const { return meeting_; }
  EMBRUN_FN std::uint32_t index() const { return index_; }
  EMBRUN_FN bool front() const { return front_; }

 private:
  const Ray& ray_;
  SplatView view_;
  SplatStart start_;
  SplatHits::Hit last_;
  float group_end_;
  SplatMeeting meeting_{infinity, 0, 0};
  std::uint32_t index_ = ~0u;
  bool front_ = false;
};

/// A short look round from where a ray met something: whether any splat of the kind that is looked for is met.
class SplatProbe {
 public:
  EMBRUN_FN const Ray& ray() const { return ray_; }
  EMBRUN_FN float near() const { return 0.0f; }
  EMBRUN_FN float limit() const { return found_ ? 0.0f : length_; }
  EMBRUN_FN bool found() const { return found_; }

 protected:
  Ray ray_;
  float length_ = 0;
  bool found_ = false;

  /// For levels of detail its footprint is that of `seen_by` at t.
  EMBRUN_FN SplatProbe(const Ray& seen_by, float t) : ray_(seen_by) {
    ray_.cone_width += seen_by.cone_spread * t;
    ray_.cone_spread = 0.0f;
  }

  /// True when a splat is met on the way, from its front.
  EMBRUN_FN bool meets_front(const Splat& splat, SplatMeeting& meeting) const {
    return meet_splat(splat, ray_, meeting) && meeting.along < 0.0f && meeting.t > 0.0f && meeting.t < length_;
  }
};

/// Finds whether a place on a splat lies beyond an edge of the surface: whether on the way from there to the splat's centre,
/// which is on the surface, another splat that forms no hollow with this one is passed from its front, and lies further
/// behind than those of one smooth sheet do (see splat_sheet_depth).
class SplatEdge : public SplatProbe {
 public:
  /// The place is the ray's at t, in the splat's plane.
  EMBRUN_FN SplatEdge(const Splat& splat, const Ray& ray, float t) : SplatProbe(ray, t), splat_(splat) {
    ray_.origin = ray.at(t);
    const Vec3 to_center = splat.center - ray_.origin;
    length_ = length(to_center);
    ray_.direction = length_ > 0.0f ? to_center / length_ : splat.normal;
  }

  EMBRUN_FN void consider(const Splat& splat, std::uint32_t) {
    SplatMeeting meeting;
    found_ = found_ || (meets_front(splat, meeting) && -meeting.along * meeting.t > splat_sheet_depth * splat.radius &&
                        !form_hollow(splat_, splat, 1.0f));
  }

 private:
  const Splat& splat_;
};

/// Finds whether a front lies beside a ray that meets a splat from behind: within a radius of the last three before they
/// meet, and the next. Rays on four sides look for it, one after the other.
class SplatBeside : public SplatProbe {
 public:
  static constexpr int sides = 4;

  /// They meet at t.
  EMBRUN_FN SplatBeside(float radius, const Ray& ray, float t, int side) : SplatProbe(ray, t) {
    const Frame frame(ray.direction);
    const Vec3 aside = (side & 1) != 0 ? frame.s : frame.t;
    ray_.origin = ray.at(t - 3.0f * radius) + ((side & 2) != 0 ? radius : -radius) * aside;
    length_ = 4.0f * radius;
  }

  EMBRUN_FN void consider(const Splat& splat, std::uint32_t) {
    SplatMeeting meeting;
    found_ = found_ || meets_front(splat, meeting);
  }
};

}  // namespace embrun
