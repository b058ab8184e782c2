#pragma once

#include <embree3/rtcore.h>

#include "math/ray.h"

namespace embrun::EMBRUN_ISA_NAMESPACE {

EMBRUN_LOCAL_FN RTCRayHit embree_ray(const Ray& ray, float t_near, float t_far) {
  RTCRayHit query;
  query.ray.org_x = ray.origin.x;
  query.ray.org_y = ray.origin.y;
  query.ray.org_z = ray.origin.z;
  query.ray.tnear = t_near;
  query.ray.dir_x = ray.direction.x;
  query.ray.dir_y = ray.direction.y;
  query.ray.dir_z = ray.direction.z;
  query.ray.time = ray.time;
  query.ray.tfar = t_far;
  query.ray.mask = ~0u;
  query.ray.id = 0;
  query.ray.flags = 0;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return query;
}

}  // namespace embrun::EMBRUN_ISA_NAMESPACE
