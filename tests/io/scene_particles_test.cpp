// What the particles of a scene file become.

#include <cmath>

#include "io/scene_files.h"

namespace embrun {
namespace {

using namespace test;

const char* particles_csv =
    "x,y,z,density,tint_r,tint_g,tint_b\n0,0,0,1,0.1,0.2,0.3\n1,0,0,2,0.4,0.5,0.6\n0,1,0,3,0.7,0.8,0.9\n";

SceneDescription particles_with(const std::string& properties) {
  const Files files = {{"/scenes/scene.xml", whole("<shape type=\"particles\"><string name=\"filename\" "
                                                   "value=\"p.csv\"/>" +
                                                   properties + "</shape>")},
                       {"/scenes/p.csv", particles_csv}};
  return read_file(files).scene;
}

TEST(SceneParticles, AreWaterUnlessSomethingElseIsSaid) {
  const SceneDescription scene = particles_with("<float name=\"radius\" value=\"0.25\"/>");
  ASSERT_EQ(scene.fluids.size(), 1u);
  const FluidDescription& fluid = scene.fluids[0];
  EXPECT_EQ(fluid.file, "/scenes/p.csv");
  EXPECT_EQ(fluid.positions.size(), 3u);
  EXPECT_EQ(fluid.surface.radius, 0.25f);
  EXPECT_EQ(fluid.material, dielectric_material(1.33));
  EXPECT_FALSE(fluid.medium);
  EXPECT_EQ(fluid.surface.order, 3);
}

TEST(SceneParticles, Surface) {
  const FluidDescription fluid =
      particles_with(
          "<float name=\"radius\" value=\"0.25\"/><string name=\"kernel\" value=\"blinn\"/><integer name=\"order\" "
          "value=\"2\"/><float name=\"threshold\" value=\"0.5\"/><string name=\"recover\" value=\"off\"/><string "
          "name=\"normal\" value=\"gradient\"/><point name=\"container_low\" value=\"-1,-1,-1\"/><point "
          "name=\"container_high\" value=\"2,2,2\"/>")
          .fluids[0];
  EXPECT_EQ(fluid.surface.kernel, Kernel::blinn);
  EXPECT_EQ(fluid.surface.order, 2);
  EXPECT_EQ(fluid.surface.threshold_mode, ThresholdMode::number);
  EXPECT_EQ(fluid.surface.threshold, 0.5f);
  EXPECT_EQ(fluid.surface.recover, RecoverMode::off);
  EXPECT_EQ(fluid.surface.normal, NormalMode::gradient);
  EXPECT_EQ(fluid.container->high, (Vec3d{2, 2, 2}));
}

TEST(SceneParticles, OfOtherKinds) {
  const std::string size = "<float name=\"radius\" value=\"0.25\"/>";
  const auto kind = [&](const std::string& name) {
    return particles_with(size + "<string name=\"kind\" value=\"" + name + "\"/>");
  };
  const SceneDescription foam = kind("foam");
  EXPECT_TRUE(foam.fluids.empty());
  ASSERT_EQ(foam.volumes.size(), 1u);
  EXPECT_EQ(foam.volumes[0].radius, 0.25);
  EXPECT_EQ(foam.volumes[0].positions.size(), 3u);
  EXPECT_EQ(foam.volumes[0].medium.albedo, grey(1));
  EXPECT_EQ(foam.volumes[0].medium.extinction, grey(2));  // one over the diameter
  EXPECT_EQ(foam.volumes[0].medium.model, DensityModel::smooth);
  // What is said of it leaves the rest as it is.
  const SceneDescription thin =
      particles_with(size + "<string name=\"kind\" value=\"foam\"/><float name=\"extinction\" value=\"0.3\"/>");
  EXPECT_EQ(thin.volumes[0].medium.extinction, grey(0.3f));
  EXPECT_EQ(thin.volumes[0].medium.model, DensityModel::smooth);
  EXPECT_EQ(thin.volumes[0].medium.density_radius, 0.125);
  const SceneDescription bubbles = kind("bubble");
  ASSERT_EQ(bubbles.balls.size(), 1u);
  EXPECT_EQ(bubbles.balls[0].balls.size(), 3u);
  EXPECT_EQ(bubbles.balls[0].balls[1].center, (Vec3d{1, 0, 0}));
  EXPECT_EQ(bubbles.balls[0].balls[1].radius, 0.25);
  EXPECT_EQ(bubbles.balls[0].material.ior, 1);
  EXPECT_GT(bubbles.balls[0].material.priority, 1);  // wins over the water it is in
  EXPECT_EQ(kind("sand").balls[0].material.kind, BsdfKind::diffuse);
  EXPECT_EQ(kind("spray").balls[0].material, dielectric_material(1.33));
  EXPECT_THROW(kind("steam"), Error);
}

// What is infinitely dense is a surface: of foam its balls, of water its own.
TEST(SceneParticles, OfInfiniteExtinctionAreOpaque) {
  const std::string radius = "<float name=\"radius\" value=\"0.25\"/>",
                    opaque = "<rgb name=\"extinction\" value=\"inf\"/>",
                    red = "<rgb name=\"albedo\" value=\"0.9,0.1,0.2\"/>";
  const SceneDescription water = particles_with(radius + opaque + red);
  ASSERT_EQ(water.fluids.size(), 1u);
  EXPECT_FALSE(water.fluids[0].medium);
  EXPECT_EQ(water.fluids[0].material.kind, BsdfKind::plastic);
  EXPECT_EQ(water.fluids[0].material.ior, 1.33);
  EXPECT_EQ(water.fluids[0].material.reflectance.first, (Rgb{0.9f, 0.1f, 0.2f}));
  const SceneDescription foam = particles_with(radius + opaque + red + "<string name=\"kind\" value=\"foam\"/>");
  EXPECT_TRUE(foam.volumes.empty());
  ASSERT_EQ(foam.balls.size(), 1u);
  EXPECT_EQ(foam.balls[0].balls.size(), 3u);
  EXPECT_EQ(foam.balls[0].material, diffuse_material({0.9f, 0.1f, 0.2f}));
  for (const auto& [properties, message] :
       {std::pair{radius + opaque + "<string name=\"albedo\" value=\"density\"/>", "one albedo"},
        std::pair{radius + "<rgb name=\"extinction\" value=\"inf,0,0\"/>", "no finite number"},
        std::pair{radius + "<rgb name=\"extinction\" value=\"-1\"/>", "extinction"},
        std::pair{std::string("<float name=\"radius\" value=\"0\"/>"), "'radius' is 0: it has to be positive"}}) {
    try {
      validate(particles_with(properties));
      ADD_FAILURE() << properties;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
  }
}

// The density of the three particles, 1, 2 and 3, tells their kinds.
TEST(SceneParticles, OfSeveralKindsInOneFile) {
  const auto taken = [](const std::string& kind, const std::string& kinds) {
    return particles_with("<float name=\"radius\" value=\"0.25\"/><string name=\"kind\" value=\"" + kind +
                          "\"/><string name=\"kinds\" value=\"" + kinds + "\"/>");
  };
  const std::string kinds = "density:2=sand,3=foam";
  const SceneDescription foam = taken("foam", kinds);
  ASSERT_EQ(foam.volumes[0].positions.size(), 1u);
  EXPECT_EQ(foam.volumes[0].kinds, kinds);
  EXPECT_EQ(taken("sand", kinds).balls[0].balls.size(), 1u);
  EXPECT_EQ(taken("water", kinds).fluids[0].positions.size(), 1u);
  // A frame may hold none of a kind, but there has to be water.
  EXPECT_TRUE(taken("spray", kinds).balls.empty());
  EXPECT_TRUE(taken("foam", "density:2=sand").volumes.empty());
  for (const auto& [kind, mapping, message] :
       {std::tuple{"water", "density:1=sand,2=sand,3=sand", "no particle is water"},
        std::tuple{"foam", "type:1=foam", "\"type\""}, std::tuple{"foam", "density", "give an attribute"}}) {
    try {
      taken(kind, mapping);
      ADD_FAILURE() << mapping;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("scene.xml: line"), std::string::npos) << error.what();
    }
  }
}

TEST(SceneParticles, ScatterByValuesOrAttributes) {
  const ParticleMediumDescription medium =
      *particles_with(
           "<float name=\"radius\" value=\"0.25\"/><float name=\"extinction\" value=\"4.5\"/><string name=\"density\" "
           "value=\"density\"/><rgb name=\"albedo\" value=\"0.9\"/><phase type=\"hg\"><float name=\"g\" "
           "value=\"0.5\"/></phase>")
           .fluids[0]
           .medium;
  EXPECT_EQ(medium.extinction, grey(4.5f));
  EXPECT_EQ(medium.densities, (std::vector<float>{1, 2, 3}));
  EXPECT_EQ(medium.albedo, grey(0.9f));
  EXPECT_EQ(medium.phase.g, 0.5f);
  EXPECT_EQ(medium.sources.density, "density");
  EXPECT_THROW(particles_with("<float name=\"radius\" value=\"0.25\"/><string name=\"extinction\" value=\"none\"/>"),
               Error);
}

}  // namespace
}  // namespace embrun
