#include "geometry/thesis_tracer.h"

#include <algorithm>
#include <cmath>

#include "geometry/kernels.h"

namespace embrun {

namespace {

/// Largest number of grid cells: a few stray particles far away must not ask for more memory than there is.
constexpr double cell_limit = 1 << 24;

}  // namespace

ThesisSurface::ThesisSurface(std::span<const Vec3> positions, std::span<const float> radii,
                             const SurfaceSettings& settings)
    : model_(resolve_surface_model(positions, radii, settings)) {
  particles_.resize(positions.size());
  Box3 box;
  for (const Vec3 p : positions) box.include(p);
  // About the middle, so that far from the origin of coordinates no precision is lost.
  center_ = (box.low + box.high) * 0.5f;
  float largest = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const float radius = radii.empty() ? model_.radius : radii[i];
    particles_[i] = {positions[i] - center_, 1.0f / (model_.influence_factor * radius),
                     1.0f / (model_.recover_factor * radius), 0.0f};
    largest = max_of(largest, model_.influence_factor * radius * kernel_support(model_.kernel));
  }
  for (std::size_t k = 0; k < model_.recovered.size(); ++k) {
    particles_[model_.recovered[k]].recover_weight = model_.recovered_weights[k];
  }
  low_ = box.low - center_ - Vec3{largest, largest, largest};
  high_ = box.high - center_ + Vec3{largest, largest, largest};
  const Vec3 size = high_ - low_;
  const double volume = static_cast<double>(size.x) * size.y * size.z;
  cell_size_ = max_of(2.0f * largest, static_cast<float>(std::cbrt(volume / cell_limit)));
  for (int axis = 0; axis < 3; ++axis) cells_[axis] = static_cast<int>(size[axis] / cell_size_) + 1;
  fill_grid();
}

std::size_t ThesisSurface::cell_index(const int cell[3]) const {
  return (static_cast<std::size_t>(cell[2]) * static_cast<std::size_t>(cells_[1]) + static_cast<std::size_t>(cell[1])) *
             static_cast<std::size_t>(cells_[0]) +
         static_cast<std::size_t>(cell[0]);
}

/// Lists in each cell the particles whose influence sphere's box meets it: at most eight cells a particle.
void ThesisSurface::fill_grid() {
  const auto for_each_cell = [&](const Particle& p, const auto& visit) {
    const float reach = kernel_support(model_.kernel) / p.inverse_influence;
    int first[3], last[3], cell[3];
    for (int axis = 0; axis < 3; ++axis) {
      const float at = p.position[axis] - low_[axis];
      first[axis] = std::clamp(static_cast<int>((at - reach) / cell_size_), 0, cells_[axis] - 1);
      last[axis] = std::clamp(static_cast<int>((at + reach) / cell_size_), 0, cells_[axis] - 1);
    }
    for (cell[2] = first[2]; cell[2] <= last[2]; ++cell[2]) {
      for (cell[1] = first[1]; cell[1] <= last[1]; ++cell[1]) {
        for (cell[0] = first[0]; cell[0] <= last[0]; ++cell[0]) visit(cell_index(cell));
      }
    }
  };
  const int last_cell[3] = {cells_[0] - 1, cells_[1] - 1, cells_[2] - 1};
  cell_starts_.assign(cell_index(last_cell) + 2, 0);
  for (const Particle& p : particles_) for_each_cell(p, [&](std::size_t cell) { ++cell_starts_[cell + 1]; });
  for (std::size_t i = 1; i < cell_starts_.size(); ++i) cell_starts_[i] += cell_starts_[i - 1];
  cell_particles_.resize(cell_starts_.back());
  std::vector<std::uint32_t> next(cell_starts_.begin(), cell_starts_.end() - 1);
  for (std::uint32_t i = 0; i < particles_.size(); ++i) {
    for_each_cell(particles_[i], [&](std::size_t cell) { cell_particles_[next[cell]++] = i; });
  }
}

/// All influence spheres that the ray meets with t in [0, t_end], sorted by where it enters them.
void ThesisSurface::gather(Vec3 origin, Vec3 direction, float t_end, std::vector<Chord>& chords) const {
  chords.clear();
  int cell[3], step[3];
  float next[3], delta[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float at = (origin[axis] - low_[axis]) / cell_size_;
    cell[axis] = std::clamp(static_cast<int>(at), 0, cells_[axis] - 1);
    const float d = direction[axis];
    step[axis] = d > 0 ? 1 : -1;
    const auto face = static_cast<float>(cell[axis] + (d > 0 ? 1 : 0));
    next[axis] = d != 0 ? (face - at) * cell_size_ / d : infinity;
    delta[axis] = d != 0 ? cell_size_ / fabsf(d) : infinity;
  }
  for (;;) {
    const std::size_t index = cell_index(cell);
    for (std::uint32_t i = cell_starts_[index]; i < cell_starts_[index + 1]; ++i) {
      const Particle& p = particles_[cell_particles_[i]];
      const float reach = kernel_support(model_.kernel) / p.inverse_influence;
      const Vec3 to_centre = p.position - origin;
      const float middle = dot(to_centre, direction);
      const float discriminant = reach * reach - length_squared(to_centre - direction * middle);
      if (discriminant <= 0) continue;
      const float half = sqrtf(discriminant);
      if (middle + half <= 0 || middle - half >= t_end) continue;
      chords.push_back({middle - half, middle + half, cell_particles_[i]});
    }
    const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    if (!(next[axis] < t_end)) break;
    cell[axis] += step[axis];
    if (cell[axis] < 0 || cell[axis] >= cells_[axis]) break;
    next[axis] += delta[axis];
  }
  std::sort(chords.begin(), chords.end(), [](const Chord& a, const Chord& b) {
    return a.enter < b.enter || (a.enter == b.enter && a.particle < b.particle);
  });
  // A sphere in several cells was found several times.
  chords.erase(std::unique(chords.begin(), chords.end(),
                           [](const Chord& a, const Chord& b) { return a.particle == b.particle; }),
               chords.end());
}

ThesisSurface::Field ThesisSurface::field_at(Vec3 x, const std::vector<std::uint32_t>& felt) const {
  Field field;
  for (const std::uint32_t i : felt) {
    const Particle& p = particles_[i];
    const float r = length(x - p.position);
    field.main += kernel_value(model_.kernel, r * p.inverse_influence);
    if (p.recover_weight > 0) {
      field.recovered += p.recover_weight * kernel_value(model_.kernel, r * p.inverse_recover_influence);
    }
  }
  field.main /= model_.threshold;
  field.recovered /= model_.recover_threshold;
  return field;
}

/// max(D/T, D'/T') - 1 by the particles that are felt.
float ThesisSurface::relative_field(Vec3 x, const std::vector<std::uint32_t>& felt) const {
  const Field field = field_at(x, felt);
  return max_of(field.main, field.recovered) - 1.0f;
}

void ThesisSurface::fill_normals(Vec3 x, const std::vector<std::uint32_t>& felt, SurfaceHit& hit) const {
  const Field field = field_at(x, felt);
  const bool recovered = field.recovered > field.main;
  Vec3 down, weighted;  // minus the gradient; sum f (x - p)/|x - p|
  for (const std::uint32_t i : felt) {
    const Particle& p = particles_[i];
    const Vec3 offset = x - p.position;
    const float r = length(offset);
    const float weight = recovered ? p.recover_weight : 1.0f;
    if (r == 0 || weight == 0) continue;
    const float scale = recovered ? p.inverse_recover_influence : p.inverse_influence;
    down += offset * (-weight * kernel_derivative(model_.kernel, r * scale) * scale / r);
    weighted += offset * (weight * kernel_value(model_.kernel, r * scale) / r);
  }
  const bool down_is_sure = length_squared(down) > 0, weighted_is_sure = length_squared(weighted) > 0;
  if (down_is_sure) hit.geometric_normal = normalize(down);
  const bool use_weighted = model_.normal == NormalMode::weighted && weighted_is_sure;
  hit.shading_normal = use_weighted ? normalize(weighted) : hit.geometric_normal;
}

bool ThesisSurface::contains(Vec3 scene_point) const {
  const Vec3 point = scene_point - center_;
  if (!Box3{low_, high_}.contains(point)) return false;
  int cell[3];
  for (int axis = 0; axis < 3; ++axis) {
    cell[axis] = std::clamp(static_cast<int>((point[axis] - low_[axis]) / cell_size_), 0, cells_[axis] - 1);
  }
  const std::size_t index = cell_index(cell);
  const auto begin = cell_particles_.begin();
  const std::vector<std::uint32_t> felt(begin + cell_starts_[index], begin + cell_starts_[index + 1]);
  return relative_field(point, felt) > 0;
}

/// The part of the ray between its t_min and t_max in the box of everything that is felt.
bool ThesisSurface::clip(const Ray& ray, float& begin, float& end) const {
  begin = ray.t_min;
  end = ray.t_max;
  for (int axis = 0; axis < 3; ++axis) {
    const float o = ray.origin[axis], d = ray.direction[axis];
    if (d == 0) {
      if (o < low_[axis] || o > high_[axis]) return false;
      continue;
    }
    const float a = (low_[axis] - o) / d, b = (high_[axis] - o) / d;
    begin = max_of(begin, min_of(a, b));
    end = min_of(end, max_of(a, b));
  }
  return begin < end;
}

/// Where the field is sampled: at the sorted intersections, and between those that lie farther apart than R0/2.
void ThesisSurface::place_stops(const std::vector<Chord>& chords, float t_end, std::vector<float>& stops) const {
  static thread_local std::vector<float> events;
  events.assign(1, 0.0f);
  for (const Chord& chord : chords) {
    if (chord.enter > 0) events.push_back(chord.enter);
    events.push_back(min_of(chord.exit, t_end));
  }
  std::sort(events.begin(), events.end());
  const float longest_step = 0.5f * model_.radius;
  stops.assign(1, 0.0f);
  for (const float event : events) {
    const float from = stops.back();
    const auto pieces = static_cast<int>(min_of((event - from) / longest_step, 1e6f));
    for (int i = 1; i <= pieces; ++i) {
      stops.push_back(from + (event - from) * static_cast<float>(i) / static_cast<float>(pieces + 1));
    }
    if (event > from) stops.push_back(event);
  }
}

/// The zero of the field between a and b, where it has the values ga and gb of opposite sign: the secant method, in
/// the Illinois variant, which counts an end that stays for half.
float ThesisSurface::secant(const std::function<float(float)>& field, float a, float ga, float b, float gb) const {
  for (int i = 0; i < 60 && b - a > 1e-5f * model_.radius; ++i) {
    const float s = clamp(a - ga * (b - a) / (gb - ga), a, b);
    const float gs = field(s);
    if (gs == 0) return s;
    if ((gs > 0) == (gb > 0)) {
      b = s;
      gb = gs;
      ga *= 0.5f;
    } else {
      a = s;
      ga = gs;
      gb *= 0.5f;
    }
  }
  return 0.5f * (a + b);
}

bool ThesisSurface::intersect(const Ray& scene_ray, Side side, SurfaceHit& hit) const {
  Ray ray = scene_ray;
  ray.origin = scene_ray.origin - center_;
  float begin, end;
  if (!clip(ray, begin, end)) return false;
  // A ray that had to be brought to the box starts outside, whatever was said of its origin.
  if (begin > ray.t_min) side = Side::outside;
  const Vec3 origin = ray.at(begin), direction = ray.direction;
  static thread_local std::vector<Chord> chords;
  static thread_local std::vector<float> stops;
  gather(origin, direction, end - begin, chords);
  place_stops(chords, end - begin, stops);

  // From stop to stop with the particles that are felt, until the sign says that the ray is on the other side.
  static thread_local std::vector<std::uint32_t> open, felt;  // chords, and their particles
  open.clear();
  std::size_t next_chord = 0;
  float last_t = 0, last_g = 0;
  bool inside = side == Side::inside;
  for (std::size_t i = 0; i < stops.size(); ++i) {
    const float t = stops[i];
    while (next_chord < chords.size() && chords[next_chord].enter <= t) {
      open.push_back(static_cast<std::uint32_t>(next_chord++));
    }
    std::erase_if(open, [&](std::uint32_t c) { return chords[c].exit < last_t; });
    felt.clear();
    for (const std::uint32_t c : open) felt.push_back(chords[c].particle);
    const auto field = [&](float s) { return relative_field(origin + direction * s, felt); };
    const float g = field(t);
    if (i == 0 && side == Side::unknown) inside = g > 0;
    // A start that rounding put across the surface is forgiven for a thousandth of a radius.
    const bool started_across = i > 0 && (last_g > 0) != inside;
    const bool crossed = i > 0 && (g > 0) != inside && !(started_across && t < 1e-3f * model_.radius);
    if (crossed) {
      const float t_hit = started_across ? last_t : secant(field, last_t, last_g, t, g);
      hit.t = begin + t_hit;
      const Vec3 local = origin + direction * t_hit;
      hit.position = local + center_;
      hit.entering = !inside;
      hit.geometric_normal = inside ? direction : -direction;
      fill_normals(local, felt, hit);
      return true;
    }
    last_t = t;
    last_g = g;
  }
  return false;
}

std::size_t ThesisSurface::bytes() const {
  return particles_.size() * sizeof(Particle) + (cell_starts_.size() + cell_particles_.size()) * sizeof(std::uint32_t);
}

}  // namespace embrun
