#include "geometry/thesis_tracer.h"

#include <algorithm>
#include <cmath>

#include "geometry/kernels.h"

namespace embrun {

namespace {

/// Largest number of grid cells: a few stray particles far away must not ask for more memory than there is.
constexpr double cell_limit = 1 << 24;

/// What a ray needs in passing; kept by each thread.
struct Scratch {
  std::vector<std::uint32_t> felt;  // particles whose influence sphere holds the current point
  std::vector<float> stops;
};

}  // namespace

ThesisSurface::ThesisSurface(std::span<const Vec3> positions, std::span<const float> radii,
                             const SurfaceSettings& settings)
    : model_(resolve_surface_model(positions, radii, settings)) {
  particles_.resize(positions.size());
  Box3 box;
  float largest = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const float radius = radii.empty() ? model_.radius : radii[i];
    particles_[i] = {positions[i], 1.0f / (model_.influence_factor * radius), 1.0f / (model_.recover_factor * radius),
                     0.0f};
    largest = max_of(largest, model_.influence_factor * radius * kernel_support(model_.kernel));
    box.include(positions[i]);
  }
  for (std::size_t k = 0; k < model_.recovered.size(); ++k) {
    particles_[model_.recovered[k]].recover_weight = model_.recovered_weights[k];
  }
  low_ = box.low - Vec3{largest, largest, largest};
  high_ = box.high + Vec3{largest, largest, largest};
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

bool ThesisSurface::contains(Vec3 point) const {
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

bool ThesisSurface::intersect(const Ray& ray, Side side, SurfaceHit& hit) const {
  // The ray from where it enters the grid's box.
  float begin = ray.t_min, end = ray.t_max;
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
  if (!(begin < end)) return false;
  const Vec3 origin = ray.at(begin), direction = ray.direction;
  static thread_local std::vector<Chord> chords;
  static thread_local Scratch scratch;
  gather(origin, direction, end - begin, chords);

  // The sorted intersections, and samples between those that lie far apart.
  std::vector<float>& stops = scratch.stops;
  stops.clear();
  stops.push_back(0);
  for (const Chord& chord : chords) {
    if (chord.enter > 0) stops.push_back(chord.enter);
    if (chord.exit < end - begin) stops.push_back(chord.exit);
  }
  std::sort(stops.begin(), stops.end());
  const float longest_step = 0.5f * model_.radius;

  // March from stop to stop with the particles that are felt, until the sign says that the ray is on the other side.
  std::vector<std::uint32_t>& felt = scratch.felt;
  felt.clear();
  std::size_t next_chord = 0;
  bool inside = begin == ray.t_min && side == Side::inside;
  float last_t = 0, last_g = 0;
  bool started = false;
  const auto march_to = [&](float t, float& t_hit) {
    // From the last stop on: spheres entered by t, less those left by then.
    while (next_chord < chords.size() && chords[next_chord].enter <= t)
      felt.push_back(static_cast<std::uint32_t>(next_chord++));
    std::erase_if(felt, [&](std::uint32_t c) { return chords[c].exit < last_t; });
    static thread_local std::vector<std::uint32_t> particles;
    particles.clear();
    for (const std::uint32_t c : felt) particles.push_back(chords[c].particle);
    const auto g_at = [&](float s) { return relative_field(origin + direction * s, particles); };
    const float g = g_at(t);
    if (!started) {
      started = true;
      if (begin == ray.t_min && side == Side::unknown) inside = g > 0;
      last_g = g;
      return false;
    }
    const bool crossed = (g > 0) != inside;
    // A start that rounding put across the surface is forgiven for a thousandth of a radius.
    if (crossed && (last_g > 0) != inside && t < 1e-3f * model_.radius) return false;
    if (crossed) {
      t_hit = last_t;
      if ((last_g > 0) == inside) {
        // Secant, in Illinois's variant: the end that stays twice counts half.
        float a = last_t, b = t, ga = last_g, gb = g;
        for (int i = 0; i < 60 && b - a > 1e-5f * model_.radius; ++i) {
          const float s = clamp(a - ga * (b - a) / (gb - ga), a, b);
          const float gs = g_at(s);
          if ((gs > 0) == (gb > 0)) {
            b = s;
            gb = gs;
            ga *= 0.5f;
          } else {
            a = s;
            ga = gs;
            gb *= 0.5f;
          }
          if (gs == 0) break;
        }
        t_hit = 0.5f * (a + b);
      }
      hit.geometric_normal = inside ? direction : -direction;
      fill_normals(origin + direction * t_hit, particles, hit);
      return true;
    }
    last_t = t;
    last_g = g;
    return false;
  };
  for (const float stop : stops) {
    const float from = last_t;
    const int pieces = 1 + static_cast<int>(min_of((stop - from) / longest_step, 1e6f));
    for (int i = 1; i <= pieces; ++i) {
      const float t = i == pieces ? stop : from + (stop - from) * static_cast<float>(i) / static_cast<float>(pieces);
      float t_hit = 0;
      if (!march_to(t, t_hit)) continue;
      hit.t = begin + t_hit;
      hit.position = origin + direction * t_hit;
      hit.entering = !inside;
      return true;
    }
  }
  return false;
}

std::size_t ThesisSurface::bytes() const {
  return particles_.size() * sizeof(Particle) + (cell_starts_.size() + cell_particles_.size()) * sizeof(std::uint32_t);
}

}  // namespace embrun
