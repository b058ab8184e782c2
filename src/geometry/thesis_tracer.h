#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "geometry/surface_hit.h"
#include "geometry/surface_model.h"
#include "geometry/surface_settings.h"
#include "math/ray.h"

namespace embrun {

/// The thesis's own tracer of the implicit surface (section 5.3.3), kept simple: the baseline of every claim of
/// speed. Particles are binned in a uniform grid of cell 2 R1; a ray gathers its intersections with all influence
/// spheres, sorts them, and searches them in order for a change of sign, which the secant method refines. The finer
/// grid of cell 2 R0 serves the density inside and comes with it.
/// Where the sorted intersections lie farther apart than R0/2 (a lone particle has two), the ray is sampled between.
/// Host code; immutable once built, so threads may share it.
class ThesisSurface {
 public:
  /// Arguments and errors as for build_implicit_surface.
  ThesisSurface(std::span<const Vec3> positions, std::span<const float> radii, const SurfaceSettings& settings);

  /// First crossing with t in (ray.t_min, ray.t_max), as intersect_implicit_surface has it.
  bool intersect(const Ray& ray, Side side, SurfaceHit& hit) const;
  bool contains(Vec3 point) const;

  const SurfaceModel& model() const { return model_; }
  std::size_t bytes() const;

 private:
  struct Particle {
    Vec3 position;
    float inverse_influence;          // of the main field
    float inverse_recover_influence;  // of the recovered field
    float recover_weight;             // 0: not recovered
  };
  /// A ray's way through one influence sphere.
  struct Chord {
    float enter, exit;
    std::uint32_t particle;
  };
  struct Field {
    float main = 0, recovered = 0;  // D/T and D'/T'
  };

  void fill_grid();
  std::size_t cell_index(const int cell[3]) const;
  void gather(Vec3 origin, Vec3 direction, float t_end, std::vector<Chord>& chords) const;
  bool clip(const Ray& ray, float& begin, float& end) const;
  void place_stops(const std::vector<Chord>& chords, float t_end, std::vector<float>& stops) const;
  float secant(const std::function<float(float)>& field, float a, float ga, float b, float gb) const;
  float relative_field(Vec3 x, const std::vector<std::uint32_t>& felt) const;
  Field field_at(Vec3 x, const std::vector<std::uint32_t>& felt) const;
  void fill_normals(Vec3 x, const std::vector<std::uint32_t>& felt, SurfaceHit& hit) const;

  SurfaceModel model_;
  std::vector<Particle> particles_;
  Vec3 center_;          // everything below is relative to it
  Vec3 low_, high_;      // of all supports
  float cell_size_ = 0;  // 2 R1
  int cells_[3] = {};
  std::vector<std::uint32_t> cell_starts_, cell_particles_;
};

}  // namespace embrun
