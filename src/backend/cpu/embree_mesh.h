#pragma once

#include <embree3/rtcore.h>

#include "geometry/sided_ray.h"
#include "geometry/surface_hit.h"
#include "geometry/triangle_mesh.h"
#include "math/ray.h"

namespace embrun {

/// How Embree is asked: ray by ray, sixteen at once, or for all of a list.
enum class EmbreeMode { single, packets, stream };
inline constexpr EmbreeMode embree_modes[] = {EmbreeMode::single, EmbreeMode::packets, EmbreeMode::stream};
const char* name_of(EmbreeMode mode);

/// A mesh in an Embree scene of high build quality, built by one thread: for measurements.
class EmbreeMesh {
 public:
  explicit EmbreeMesh(TriangleMesh mesh);
  ~EmbreeMesh();
  EmbreeMesh(const EmbreeMesh&) = delete;
  EmbreeMesh& operator=(const EmbreeMesh&) = delete;

  /// Nearest hit with t in (t_min, t_max): t and the interpolated normal, like the direct tracer's shading normal.
  bool intersect(const Ray& ray, float t_min, SurfaceHit& hit) const;
  /// The same for up to max_rays rays. Those that start on the surface begin at `surface_start`.
  static constexpr int max_rays = 256;
  void intersect(EmbreeMode mode, const SidedRay* rays, int count, float surface_start, SurfaceHit* hits,
                 bool* found) const;

  const TriangleMesh& mesh() const { return mesh_; }
  /// Of the mesh and of Embree's own structures.
  std::size_t bytes() const;

 private:
  bool take(const RTCRayHit& query, SurfaceHit& hit) const;
  static bool count_memory(void* counter, ssize_t bytes, bool post);

  TriangleMesh mesh_;
  std::size_t embree_bytes_ = 0;
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace embrun
