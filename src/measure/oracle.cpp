#include "measure/oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace oracle {

namespace {

// Blinn's kernel exp(-k q), q = u^2, less its tangent at q = Q where it has fallen to c = 1e-3, over what that leaves
// at 0: (exp(-k q) - c (1 + k (Q - q))) / (1 - c (1 + k Q)).
constexpr double blinn_c = 1e-3;

/// k such that the kernel is 2/3 at u = 1/3, by bisection: it falls with k, and k Q = ln(1/c) whatever k is.
double blinn_rate() {
  const double top = 1 - blinn_c * (1 - std::log(blinn_c));
  double low = 3, high = 4;
  for (int i = 0; i < 60; ++i) {
    const double k = 0.5 * (low + high);
    const double third = (std::exp(-k / 9) - blinn_c * (1 - std::log(blinn_c) - k / 9)) / top;
    (third > 2.0 / 3.0 ? low : high) = k;
  }
  return 0.5 * (low + high);
}

const double blinn_k = blinn_rate();
const double blinn_reach = std::sqrt(-std::log(blinn_c) / blinn_k);
const double blinn_top = 1 - blinn_c * (1 + blinn_k * blinn_reach * blinn_reach);
// Larger than |f''| and |f'(u)/u| of all three kernels (6, 6 and 2k = 7.3).
constexpr double kernel_curvature = 8.0;

double distance_to_box(Vec p, Vec low, Vec high) {
  const double x = std::max({0.0, low.x - p.x, p.x - high.x});
  const double y = std::max({0.0, low.y - p.y, p.y - high.y});
  const double z = std::max({0.0, low.z - p.z, p.z - high.z});
  return std::sqrt(x * x + y * y + z * z);
}

}  // namespace

double length(Vec a) { return std::sqrt(dot(a, a)); }

double kernel_support(Kernel kernel) { return kernel == Kernel::blinn ? blinn_reach : 1.0; }

double kernel_value(Kernel kernel, double u) {
  if (u >= kernel_support(kernel)) return 0;
  if (kernel == Kernel::zhu_bridson) return std::pow(1 - u * u, 3);
  if (kernel == Kernel::blinn) {
    return (std::exp(-blinn_k * u * u) - blinn_c * (1 + blinn_k * (blinn_reach * blinn_reach - u * u))) / blinn_top;
  }
  return u <= 1.0 / 3.0 ? 1 - 3 * u * u : 1.5 * (1 - u) * (1 - u);
}

double kernel_slope(Kernel kernel, double u) {
  if (u >= kernel_support(kernel)) return 0;
  if (kernel == Kernel::zhu_bridson) return -6 * u * (1 - u * u) * (1 - u * u);
  if (kernel == Kernel::blinn) return -2 * blinn_k * u * (std::exp(-blinn_k * u * u) - blinn_c) / blinn_top;
  return u <= 1.0 / 3.0 ? -6 * u : -3 * (1 - u);
}

// ---- Surface ----

Surface::Surface(Kernel kernel, std::vector<Particle> particles) : kernel_(kernel), particles_(std::move(particles)) {
  // Blocks of 32 neighbours of like size, by size class and then along the cells of a grid of eight supports.
  // Any order gives the same answers; this one makes the blocks small.
  struct Key {
    int size_class;
    std::array<double, 3> cell;
    std::size_t index;
  };
  std::vector<Key> keys(particles_.size());
  for (std::size_t i = 0; i < particles_.size(); ++i) {
    const Particle& p = particles_[i];
    const int size_class = std::ilogb(p.influence);
    const double side = std::ldexp(1.0, size_class) * 0.5;
    keys[i] = {
        size_class, {std::floor(p.centre.x / side), std::floor(p.centre.y / side), std::floor(p.centre.z / side)}, i};
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    if (a.size_class != b.size_class) return a.size_class < b.size_class;
    // Coarse columns first, so that a run of keys stays together in all three directions.
    for (const double coarse : {4.0, 1.0}) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double ca = std::floor(a.cell[axis] / coarse), cb = std::floor(b.cell[axis] / coarse);
        if (ca != cb) return ca < cb;
      }
    }
    return a.index < b.index;
  });
  std::vector<Particle> sorted;
  for (const Key& key : keys) sorted.push_back(particles_[key.index]);
  particles_.swap(sorted);

  const double inf = std::numeric_limits<double>::infinity();
  low_ = {inf, inf, inf};
  high_ = {-inf, -inf, -inf};
  for (std::size_t begin = 0; begin < particles_.size();) {
    Block block{begin, begin, {inf, inf, inf}, {-inf, -inf, -inf}, 0};
    while (block.end < particles_.size() && block.end < begin + 32 &&
           std::ilogb(particles_[block.end].influence) == std::ilogb(particles_[begin].influence)) {
      const Particle& p = particles_[block.end++];
      block.low = {std::min(block.low.x, p.centre.x), std::min(block.low.y, p.centre.y),
                   std::min(block.low.z, p.centre.z)};
      block.high = {std::max(block.high.x, p.centre.x), std::max(block.high.y, p.centre.y),
                    std::max(block.high.z, p.centre.z)};
      block.reach = std::max(block.reach, p.influence * kernel_support(kernel));
    }
    low_ = {std::min(low_.x, block.low.x), std::min(low_.y, block.low.y), std::min(low_.z, block.low.z)};
    high_ = {std::max(high_.x, block.high.x), std::max(high_.y, block.high.y), std::max(high_.z, block.high.z)};
    begin = block.end;
    blocks_.push_back(block);
  }
  for (std::size_t begin = 0; begin < blocks_.size(); begin += 32) {
    Block group = blocks_[begin];
    group.begin = begin;
    group.end = std::min(begin + 32, blocks_.size());
    for (std::size_t i = begin; i < group.end; ++i) {
      const Block& b = blocks_[i];
      group.low = {std::min(group.low.x, b.low.x), std::min(group.low.y, b.low.y), std::min(group.low.z, b.low.z)};
      group.high = {std::max(group.high.x, b.high.x), std::max(group.high.y, b.high.y),
                    std::max(group.high.z, b.high.z)};
      group.reach = std::max(group.reach, b.reach);
    }
    groups_.push_back(group);
  }
  for (const Particle& p : particles_) smallest_influence_ = std::min(smallest_influence_, p.influence);
}

template <class Reaches, class Visit>
void Surface::visit(const Reaches& reaches, const Visit& visit_particle) const {
  for (const Block& group : groups_) {
    if (!reaches(group.low, group.high, group.reach)) continue;
    for (std::size_t b = group.begin; b < group.end; ++b) {
      if (!reaches(blocks_[b].low, blocks_[b].high, blocks_[b].reach)) continue;
      for (std::size_t i = blocks_[b].begin; i < blocks_[b].end; ++i) visit_particle(particles_[i]);
    }
  }
}

Sample Surface::sample(Vec x) const {
  double value[2] = {-1, -1}, curvature[2] = {0, 0};
  Vec gradient[2];
  double radius_sum = 0, share_sum = 0;
  const auto reaches = [&](Vec low, Vec high, double reach) { return distance_to_box(x, low, high) <= reach; };
  visit(reaches, [&](const Particle& p) {
    const Vec offset = x - p.centre;
    const double r = length(offset), u = r / p.influence;
    if (u >= kernel_support(kernel_)) return;
    const double part = p.share * kernel_value(kernel_, u);
    value[p.recovered] += part;
    radius_sum += part * p.radius;
    share_sum += part;
    curvature[p.recovered] += p.share * kernel_curvature / (p.influence * p.influence);
    if (r > 0) {
      gradient[p.recovered] = gradient[p.recovered] + offset * (p.share * kernel_slope(kernel_, u) / (p.influence * r));
    }
  });
  const int larger = value[1] > value[0];
  return {value[larger], gradient[larger], value[1 - larger], std::max(curvature[0], curvature[1]),
          share_sum > 0 ? radius_sum / share_sum : 0};
}

bool Surface::surface_within(Vec x, double least_tolerance) const {
  const Sample here = sample(x);
  const double tolerance = std::max(least_tolerance, 1e-3 * here.radius);
  const double steepness = length(here.gradient);
  const auto other_side = [&](Vec step) { return (sample(x + step).g > 0) != (here.g > 0); };
  // From outside, particles that are not felt here may be within the tolerance where it is larger than they are.
  if (here.g <= 0 && smallest_influence_ < 4 * tolerance) {
    bool found = false;
    visit([&](Vec low, Vec high, double) { return distance_to_box(x, low, high) <= tolerance; },
          [&](const Particle& p) { found = found || (length(p.centre - x) <= tolerance && other_side(p.centre - x)); });
    if (found) return true;
  }
  // Neither branch can have changed by more than this within the tolerance: then the sign is the same all around.
  const double change = steepness * tolerance + 0.5 * here.curvature * tolerance * tolerance;
  if (here.g > 0 && here.g > 1.01 * change) return false;
  // From outside the other branch may be the nearer one; its slope is unknown, so only the sampling below decides.
  if (here.g < 0 && here.g < -1.01 * change && here.other < -20 * change - 0.05) return false;
  // Along the gradient first, just beyond where the nearer branch has its zero by its slope: what is there may be far
  // thinner than the tolerance, such as the air in a crease between the two branches. Then at shrinking distances: the
  // body may be smaller than the tolerance.
  const auto ends_along_gradient = [&](double distance) {
    return other_side(here.gradient * ((here.g > 0 ? -1 : 1) * distance / steepness));
  };
  for (const double beyond : {1.01, 1.05, 1.1, 1.25, 1.5}) {
    const double distance = beyond * std::abs(here.g) / steepness;
    if (distance <= tolerance && ends_along_gradient(distance)) return true;
  }
  for (int halvings = 0; steepness > 0 && halvings < 12; ++halvings) {
    if (ends_along_gradient(std::ldexp(tolerance, -halvings))) return true;
  }
  for (int i = 0; i < 27; ++i) {
    const Vec direction{i % 3 - 1.0, i / 3 % 3 - 1.0, i / 9 - 1.0};
    if (i != 13 && other_side(direction * (tolerance / length(direction)))) return true;
  }
  return false;
}

bool Surface::dust_within(Vec x, double tolerance) const {
  if (smallest_influence_ >= 4 * tolerance) return false;
  bool found = false;
  visit(
      [&](Vec low, Vec high, double) { return distance_to_box(x, low, high) <= tolerance; },
      [&](const Particle& p) { found = found || (p.influence < 4 * tolerance && length(p.centre - x) <= tolerance); });
  return found;
}

std::vector<Particle> Surface::gather(const Ray& ray) const {
  // A box's ball against the ray's line and extent, then the particle's own.
  const auto meets = [&](Vec middle, double radius) {
    const Vec offset = middle - ray.origin;
    const double along = dot(offset, ray.direction);
    const Vec aside = offset - ray.direction * along;
    return dot(aside, aside) <= radius * radius && along + radius >= ray.t_min && along - radius <= ray.t_max;
  };
  std::vector<Particle> tube;
  visit([&](Vec low, Vec high,
            double reach) { return meets((low + high) * 0.5, (0.5 * length(high - low) + reach) * (1 + 1e-9)); },
        [&](const Particle& p) {
          if (meets(p.centre, p.influence * kernel_support(kernel_))) tube.push_back(p);
        });
  return tube;
}

// ---- Crossings ----

Crossings::Crossings(const Surface& surface, const Ray& ray, double finest, double step)
    : kernel_(surface.kernel()), ray_(ray), finest_(finest), step_(step) {
  double largest_radius = 0;
  for (const Particle& p : surface.gather(ray)) {
    const Vec to_centre = p.centre - ray.origin;
    const double t = dot(to_centre, ray.direction);
    const Vec aside = to_centre - ray.direction * t;
    const double support = p.influence * kernel_support(kernel_);
    const double half = std::sqrt(std::max(0.0, support * support - dot(aside, aside)));
    tube_.push_back({t - half, t + half, t, dot(aside, aside), 1 / p.influence, p.share, p.radius, p.recovered});
    largest_radius = std::max(largest_radius, p.radius);
  }
  std::sort(tube_.begin(), tube_.end(), [](const Chord& a, const Chord& b) { return a.enter < b.enter; });
  top_length_ = largest_radius > 0 ? largest_radius : 1.0;
  position_ = ray.t_min;
  // The side at the start: the chords that hold it.
  for (const Chord& chord : tube_) {
    if (chord.enter <= ray.t_min && chord.exit >= ray.t_min) open_.push_back(chord);
  }
  select(ray.t_min, ray.t_min);
  starts_inside_ = inside_ = value(ray.t_min).g > 0;
  open_.clear();
}

/// Makes the arrays of the chords that touch [a, b].
void Crossings::select(double a, double b) {
  while (next_chord_ < tube_.size() && tube_[next_chord_].enter <= b && b > ray_.t_min) {
    open_.push_back(tube_[next_chord_++]);
  }
  std::erase_if(open_, [a](const Chord& chord) { return chord.exit < a; });
  centre_.clear();
  distance_squared_.clear();
  inverse_influence_.clear();
  share_.clear();
  smallest_radius_ = std::numeric_limits<double>::infinity();
  for (const bool recovered : {false, true}) {
    for (const Chord& chord : open_) {
      if (chord.recovered != recovered) continue;
      centre_.push_back(chord.centre);
      distance_squared_.push_back(chord.distance_squared);
      inverse_influence_.push_back(chord.inverse_influence);
      share_.push_back(chord.share);
      smallest_radius_ = std::min(smallest_radius_, chord.radius);
    }
    if (!recovered) main_count_ = centre_.size();
  }
}

Crossings::Value Crossings::value(double t) const {
  Value result[2] = {{-1, 0}, {-1, 0}};
  for (std::size_t i = 0; i < centre_.size(); ++i) {
    const double along = t - centre_[i];
    const double r = std::sqrt(distance_squared_[i] + along * along);
    const double u = r * inverse_influence_[i];
    Value& sum = result[i >= main_count_];
    sum.g += share_[i] * kernel_value(kernel_, u);
    if (r > 0) sum.slope += share_[i] * kernel_slope(kernel_, u) * inverse_influence_[i] * along / r;
  }
  return result[1].g > result[0].g ? result[1] : result[0];
}

/// low <= g <= high all over [a, b], since the kernels fall with distance.
void Crossings::bounds(double a, double b, double& low, double& high) const {
  double least[2] = {0, 0}, greatest[2] = {0, 0};
  const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
  for (std::size_t i = 0; i < centre_.size(); ++i) {
    const double away = std::abs(centre_[i] - middle);
    const double nearest = std::max(0.0, away - half), farthest = away + half;
    const std::size_t branch = i >= main_count_;
    greatest[branch] +=
        share_[i] * kernel_value(kernel_, std::sqrt(distance_squared_[i] + nearest * nearest) * inverse_influence_[i]);
    least[branch] += share_[i] * kernel_value(kernel_, std::sqrt(distance_squared_[i] + farthest * farthest) *
                                                           inverse_influence_[i]);
  }
  low = std::max(least[0], least[1]) - 1;
  high = std::max(greatest[0], greatest[1]) - 1;
}

double Crossings::bisect(double a, double b) const {
  const bool sign = value(a).g > 0;
  for (int i = 0; i < 60 && b - a > 0; ++i) {
    const double middle = 0.5 * (a + b);
    if (middle <= a || middle >= b) break;
    ((value(middle).g > 0) == sign ? a : b) = middle;
  }
  return 0.5 * (a + b);
}

/// The next stretch of at most top_length_ in which something is felt goes on the stack.
bool Crossings::next_top_interval() {
  while (position_ < ray_.t_max) {
    std::erase_if(open_, [this](const Chord& chord) { return chord.exit < position_; });
    if (open_.empty()) {
      if (next_chord_ >= tube_.size()) return false;
      position_ = std::max(position_, tube_[next_chord_].enter);
    }
    const double end = std::min(position_ + top_length_, ray_.t_max);
    if (!(end > position_)) return false;
    select(position_, end);
    stack_.push_back({position_, end});
    position_ = end;
    return true;
  }
  return false;
}

/// Looks for a crossing in an interval too short to halve. If there is one, what is left of the interval goes back
/// on the stack.
bool Crossings::settle_leaf(Interval leaf, double& t) {
  const Value first = value(leaf.a), last = value(leaf.b);
  if ((last.g > 0) != inside_) {
    t = (first.g > 0) == inside_ ? bisect(leaf.a, leaf.b) : leaf.a;
    return true;
  }
  // Both ends on the same side: is there a maximum (or, inside, a minimum) between that crosses?
  const double toward = inside_ ? -1 : 1;
  if (!(first.slope * toward > 0 && last.slope * toward < 0)) return false;
  double a = leaf.a, b = leaf.b;
  for (int i = 0; i < 50; ++i) {
    const double middle = 0.5 * (a + b);
    const Value at = value(middle);
    if ((at.g > 0) != inside_) {
      t = bisect(leaf.a, middle);
      stack_.push_back({middle, leaf.b});
      return true;
    }
    (at.slope * toward > 0 ? a : b) = middle;
  }
  return false;
}

bool Crossings::next(double& t) {
  while (!stack_.empty() || next_top_interval()) {
    const Interval interval = stack_.back();
    stack_.pop_back();
    double low, high;
    bounds(interval.a, interval.b, low, high);
    if (inside_ ? low > 0 : high < 0) continue;
    const double middle = 0.5 * (interval.a + interval.b);
    const double leaf = std::max(finest_, step_ * smallest_radius_);
    if (interval.b - interval.a > leaf && middle > interval.a && middle < interval.b) {
      stack_.push_back({middle, interval.b});
      stack_.push_back({interval.a, middle});
      continue;
    }
    if (settle_leaf(interval, t)) {
      inside_ = !inside_;
      return true;
    }
  }
  return false;
}

// ---- Judge ----

const char* name_of(Verdict verdict) {
  const char* names[verdict_count] = {"right", "missed", "false", "early", "late", "wrong way", "bad normal"};
  return names[static_cast<int>(verdict)];
}

namespace {

Vec at(const Ray& ray, double t) { return ray.origin + ray.direction * t; }

/// The first t in [a, b] where the ray is farther than the tolerance from the surface, by samples that crowd at the
/// start; false if it never is.
bool first_deep(const Surface& surface, const Ray& ray, double a, double b, double tolerance, double& deep) {
  // From the tolerance up in steps that grow by a fifth, and 64 even ones.
  std::vector<double> stops;
  for (double step = tolerance; a + step < b; step *= 1.2) stops.push_back(a + step);
  for (int i = 1; i < 64; ++i) stops.push_back(a + (b - a) * i / 64);
  std::sort(stops.begin(), stops.end());
  for (const double t : stops) {
    if (!surface.surface_within(at(ray, t), tolerance)) {
      deep = t;
      return true;
    }
  }
  return false;
}

/// Whether an answer on the surface runs the right way through it and describes it rightly.
Verdict judge_description(const Surface& surface, const Ray& ray, bool from_inside, const Answer& answer,
                          double tolerance) {
  const Sample sample = surface.sample(at(ray, answer.t));
  const double steepness = length(sample.gradient);
  // Near a crease, or where the field is level or changes within the tolerance, there is no one normal.
  if (surface.dust_within(at(ray, answer.t), tolerance)) return Verdict::right;
  if (!(steepness > 0) || std::abs(sample.g - sample.other) < 10 * tolerance * steepness) return Verdict::right;
  const double cosine = dot(sample.gradient, ray.direction) / steepness * (from_inside ? -1 : 1);
  if (cosine < -0.05 || answer.entering == from_inside) return Verdict::wrong_way;
  const Vec outward = sample.gradient * (-1 / steepness);
  // A normal may turn by the curvature over the tolerance, and rounding adds some.
  const double turn = 0.02 + 4 * tolerance * sample.curvature / steepness;
  const bool normal_is_right = length(answer.normal - outward) < turn;
  // A position is off by half a unit in the last place of its coordinates, and so is a ray's parameter.
  const Vec exact = at(ray, answer.t);
  const double rounding = 1.2e-7 * (std::abs(exact.x) + std::abs(exact.y) + std::abs(exact.z) + answer.t);
  const bool position_is_right = length(answer.position - exact) <= tolerance + rounding;
  return normal_is_right && position_is_right ? Verdict::right : Verdict::bad_normal;
}

Judgement judge_from(const Surface& surface, const Ray& ray, bool from_inside, const Answer& answer, double tolerance) {
  Judgement judgement;
  Crossings crossings(surface, ray, 0.5 * tolerance);
  // Every stretch on the other side, until the hit is behind or one is deep.
  bool other = crossings.starts_inside() != from_inside;
  double begin = ray.t_min, nearest = -1;
  const double hit = answer.hit ? answer.t : std::numeric_limits<double>::infinity();
  for (bool more = true; more;) {
    double end = 0;
    more = crossings.next(end);
    if (!more) end = std::min(ray.t_max, begin + 1e3 * length(surface.high() - surface.low()) + 1e3);
    if (other) {
      nearest = begin;
      double deep;
      if (first_deep(surface, ray, begin, end, tolerance, deep)) {
        judgement.expected = begin;
        if (!answer.hit) judgement.verdict = Verdict::missed;
        if (answer.hit && deep < hit) judgement.verdict = Verdict::late;
        break;
      }
    }
    other = !other;
    begin = end;
    if (begin > hit && !other) break;
  }
  if (judgement.verdict != Verdict::right || !answer.hit) return judgement;
  if (!(answer.t >= ray.t_min - tolerance && answer.t <= ray.t_max + tolerance) ||
      !surface.surface_within(at(ray, hit), tolerance)) {
    const bool behind = nearest >= 0 && nearest<hit, ahead = nearest> hit;
    judgement.verdict = behind ? Verdict::late : ahead ? Verdict::early : Verdict::false_hit;
    return judgement;
  }
  judgement.verdict = judge_description(surface, ray, from_inside, answer, tolerance);
  return judgement;
}

}  // namespace

Judgement judge(const Surface& surface, const Ray& given, Start side, const Answer& given_answer, double tolerance) {
  // Single-precision directions are not quite of unit length; parameters count in their lengths.
  const double scale = length(given.direction);
  const Ray ray{given.origin, given.direction * (1 / scale), given.t_min * scale, given.t_max * scale};
  Answer answer = given_answer;
  answer.t *= scale;
  if (side != Start::unknown) return judge_from(surface, ray, side == Start::inside, answer, tolerance);
  const Vec start = at(ray, ray.t_min);
  const bool inside = surface.inside(start);
  const Judgement judgement = judge_from(surface, ray, inside, answer, tolerance);
  if (judgement.verdict == Verdict::right || !surface.surface_within(start, tolerance)) return judgement;
  return judge_from(surface, ray, !inside, answer, tolerance);
}

}  // namespace oracle
