#pragma once

#include <string>
#include <vector>

#include "geometry/surface_model.h"
#include "geometry/surface_settings.h"
#include "measure/oracle.h"
#include "measure/ray_recorder.h"

namespace embrun::measure {

/// Particles and settings that an intersector is judged on.
struct OracleScene {
  std::string name;
  std::vector<Vec3> positions;
  std::vector<float> radii;  ///< empty: settings.radius
  SurfaceSettings settings;
  /// What counts as wrong: 1e-3 R0, or where coordinates are large, what single precision can tell.
  double tolerance = 0;

  Box3 bounds() const;
};

/// "droplets", "sheets", "slab", "lone", "spray", "log-uniform", "dust", "offset"; or the path of a particle file
/// (radius 0.025, spacing 0.0465: the bundled dam break's).
OracleScene make_scene(const std::string& name, int order, std::uint32_t seed);
const std::vector<std::string>& synthetic_scene_names();

/// The scene's surface for the oracle: the thresholds, recovered particles and weights go over as plain numbers.
oracle::Surface oracle_surface(const OracleScene& scene, const SurfaceModel& model);

oracle::Vec to_oracle(Vec3 v);
oracle::Ray to_oracle(const Ray& ray);
oracle::Kernel to_oracle(Kernel kernel);

/// `count` rays of a class: three fifths recorded by `intersect` from renders, a fifth random (a third of those along
/// the axes or in the planes of the coordinates), a fifth within 0.05 R0 of tangency to the surface.
std::vector<TestRay> make_rays(const OracleScene& scene, const oracle::Surface& surface, const Intersector& intersect,
                               RayClass ray_class, std::size_t count, std::uint32_t seed);

/// Verdicts on an intersector, counted; the worst rays first.
struct OracleReport {
  std::array<std::size_t, oracle::verdict_count> counts{};
  struct Wrong {
    TestRay ray;
    oracle::Answer answer;
    oracle::Judgement judgement;
    std::size_t index;
  };
  std::vector<Wrong> wrong;
  std::size_t rays = 0, hits = 0;

  std::size_t wrong_count() const { return rays - counts[0]; }
  std::string summary() const;
};
OracleReport judge_rays(const OracleScene& scene, const oracle::Surface& surface, const Intersector& intersect,
                        const std::vector<TestRay>& rays);
/// A report for each of the intersectors. An answer that is the first one's to a hundredth of the tolerance has its
/// verdict too, which spares judging versions of one tracer for several instruction sets anew.
std::vector<OracleReport> judge_rays(const OracleScene& scene, const oracle::Surface& surface,
                                     const std::vector<Intersector>& intersectors, const std::vector<TestRay>& rays);

}  // namespace embrun::measure
