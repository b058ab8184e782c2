// What the integrators of a scene file become, with Mitsuba's conventions.

#include "io/scene_files.h"

namespace embrun {
namespace {

using namespace test;

// Mitsuba's depth counts segments: 1 shows the lights alone, which is no scattering.
TEST(SceneIntegrator, CountsDepthAsMitsubaDoes) {
  const auto depth = [](const char* n) {
    return scene_of("<integrator type=\"path\"><integer name=\"max_depth\" value=\"" + std::string(n) +
                    "\"/></integrator>")
        .integrator.max_depth;
  };
  EXPECT_EQ(depth("1"), 0);
  EXPECT_EQ(depth("65"), 64);
  EXPECT_EQ(depth("-1"), 65535);
  const IntegratorDescription defaults = scene_of("<integrator type=\"volpath\"/>").integrator;
  EXPECT_EQ(defaults.max_depth, 65535);
  EXPECT_EQ(defaults.roulette_depth, 5);
  EXPECT_NE(error_of("<integrator type=\"path\"><integer name=\"max_depth\" value=\"0\"/></integrator>").find("black"),
            std::string::npos);
  EXPECT_NE(error_of("<integrator type=\"direct\"/>").find("there are path, volpath, whitted, ao, gauss"),
            std::string::npos);
}

TEST(SceneIntegrator, KnowsWhittedAndAmbientOcclusion) {
  const IntegratorDescription whitted = scene_of("<integrator type=\"whitted\"/>").integrator;
  EXPECT_EQ(whitted.kind, IntegratorKind::whitted);
  EXPECT_TRUE(whitted.straight_shadows);
  EXPECT_FALSE(
      scene_of("<integrator type=\"whitted\"><boolean name=\"straight_shadows\" value=\"false\"/></integrator>")
          .integrator.straight_shadows);
  EXPECT_FALSE(scene_of("<integrator type=\"path\"/>").integrator.straight_shadows);
  const IntegratorDescription ao =
      scene_of("<integrator type=\"ao\"><float name=\"distance\" value=\"0.4\"/></integrator>").integrator;
  EXPECT_EQ(ao.kind, IntegratorKind::ambient_occlusion);
  EXPECT_EQ(ao.occlusion_distance, 0.4);
  EXPECT_NE(
      error_of("<integrator type=\"whitted\"><float name=\"distance\" value=\"1\"/></integrator>").find("distance"),
      std::string::npos);
}

TEST(SceneIntegrator, KnowsGauss) {
  const IntegratorDescription gauss = scene_of("<integrator type=\"gauss\"/>").integrator;
  EXPECT_EQ(gauss.kind, IntegratorKind::gauss);
  EXPECT_EQ(gauss.gauss_nodes, 0);
  EXPECT_FALSE(gauss.straight_shadows);
  const auto with_nodes = [](const std::string& type, const std::string& nodes) {
    return "<integrator type=\"" + type + "\"><integer name=\"nodes\" value=\"" + nodes + "\"/></integrator>";
  };
  EXPECT_EQ(scene_of(with_nodes("gauss", "36")).integrator.gauss_nodes, 36);
  EXPECT_NE(error_of(with_nodes("gauss", "0")).find("nodes"), std::string::npos);
  EXPECT_NE(error_of(with_nodes("path", "36")).find("nodes"), std::string::npos);
}

}  // namespace
}  // namespace embrun
