// 10^5 rays of each class on the bundled dam break, and 2 * 10^4 on each synthetic scene, on every instruction set.

#include <gtest/gtest.h>

#include "geometry/tracers.h"
#include "measure/oracle_scene.h"

namespace embrun::test {
namespace {

struct Case {
  std::string scene;
  int order;
  RayClass ray_class;
  std::size_t count;
};

class TracersAtLength : public testing::TestWithParam<Case> {};

TEST_P(TracersAtLength, FindTheFirstCrossing) {
  const Case& c = GetParam();
  const OracleScene scene = make_scene(c.scene, c.order, 2);
  const oracle::Surface surface =
      oracle_surface(scene, resolve_surface_model(scene.positions, scene.radii, scene.settings));
  const std::vector<Tracer> tracers = make_fast_tracers(scene.positions, scene.radii, scene.settings);
  std::vector<Intersector> intersectors;
  for (const Tracer& tracer : tracers) intersectors.push_back(tracer.intersect);
  const std::vector<TestRay> rays = make_rays(scene, surface, intersectors.back(), c.ray_class, c.count, 2);
  const std::vector<OracleReport> reports = judge_rays(scene, surface, intersectors, rays);
  for (std::size_t i = 0; i < reports.size(); ++i) {
    std::printf("%s: %s\n", available_isas()[i].c_str(), reports[i].summary().c_str());
    // None for n = 3; at most one in 10^4 for n = 2.
    EXPECT_LE(reports[i].wrong_count(), c.order == 2 ? rays.size() / 10000 : 0) << reports[i].summary();
  }
}

std::string name_of_case(const testing::TestParamInfo<Case>& info) {
  std::string name = info.param.scene.substr(0, info.param.scene.find('.'));
  name = name.substr(name.rfind('/') + 1) + "_n" + std::to_string(info.param.order) + "_" +
         std::string(name_of(info.param.ray_class));
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (const RayClass ray_class : {RayClass::camera, RayClass::outside, RayClass::inside}) {
    for (const int order : {2, 3}) {
      all.push_back({EMBRUN_DATA_DIR "/dam_break.bgeo", order, ray_class, 100000});
      for (const std::string& scene : synthetic_scene_names()) all.push_back({scene, order, ray_class, 20000});
    }
  }
  return all;
}
INSTANTIATE_TEST_SUITE_P(Scenes, TracersAtLength, testing::ValuesIn(cases()), name_of_case);

}  // namespace
}  // namespace embrun::test
