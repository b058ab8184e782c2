#pragma once

#include <embree3/rtcore.h>

#include "geometry/surface_hit.h"
#include "geometry/triangle_mesh.h"
#include "math/ray.h"

namespace embrun::bench {

/// A mesh in an Embree scene of high build quality, built by one thread.
class EmbreeMesh {
 public:
  explicit EmbreeMesh(TriangleMesh mesh);
  ~EmbreeMesh();
  EmbreeMesh(const EmbreeMesh&) = delete;
  EmbreeMesh& operator=(const EmbreeMesh&) = delete;

  /// Nearest hit with t in (t_min, t_max): t and the interpolated normal, like the direct tracer's shading normal.
  bool intersect(const Ray& ray, float t_min, SurfaceHit& hit) const;

  const TriangleMesh& mesh() const { return mesh_; }
  /// Of the mesh and of Embree's own structures.
  std::size_t bytes() const;

 private:
  static bool count_memory(void* counter, ssize_t bytes, bool post);

  TriangleMesh mesh_;
  std::size_t embree_bytes_ = 0;
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace embrun::bench
