// Light in participating media, against what theory says of it: the furnace, slabs, glowing gas, and a photon walk.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "math/black_body.h"
#include "render/transport.h"
#include "scene/kind_scene.h"

namespace embrun {
namespace {

using namespace testing_support;

PhaseFunction hg(float g) { return {PhaseKind::henyey_greenstein, g}; }

ParticleMediumDescription milk(Rgb extinction, Rgb albedo, PhaseFunction phase = {}) {
  ParticleMediumDescription medium;
  medium.extinction = extinction;
  medium.albedo = albedo;
  medium.phase = phase;
  return medium;
}

/// Particles that overlap at random in the unit ball's neighbourhood.
VolumeDescription cloud(ParticleMediumDescription medium) {
  VolumeDescription volume;
  volume.radius = 0.15;
  volume.medium = std::move(medium);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  for (int i = 0; i < 200; ++i) volume.positions.push_back({uniform(random), uniform(random), uniform(random)});
  return volume;
}

SceneDescription view(int samples) { return scene_seen({1.7, 1.1, 2.6}, {0, 0, 0}, 30, 6, samples); }

// ---- furnace -----------------------------------------------------------------------------------------------------

struct Furnace {
  const char* name;
  SceneDescription (*scene)();
};
void PrintTo(const Furnace& f, std::ostream* os) { *os << f.name; }

const Furnace furnaces[] = {
    {"fog_box",
     [] {
       SceneDescription scene = view(600);
       scene.boxes.push_back(box({-0.6, -0.5, -0.5}, {0.6, 0.4, 0.5}, fog_material({}, grey(4), hg(0.7f))));
       return scene;
     }},
    {"milky_glass",
     [] {
       SceneDescription scene = view(600);
       MaterialDescription glass = dielectric_material(1.5);
       glass.scattering = {1, 3, 6};
       glass.phase = {PhaseKind::rayleigh, 0};
       scene.balls.push_back(balls({{{0, 0, 0}, 0.6}}, glass));
       return scene;
     }},
    {"cloud",
     [] {
       SceneDescription scene = view(600);
       scene.volumes.push_back(cloud(milk(grey(8), grey(1), hg(-0.5f))));
       return scene;
     }},
    {"coloured_cloud",
     [] {
       SceneDescription scene = view(600);
       scene.volumes.push_back(cloud(milk({0.5f, 4, 15}, grey(1), hg(0.999f))));
       return scene;
     }},
    {"backward_cloud",
     [] {
       SceneDescription scene = view(600);
       scene.volumes.push_back(cloud(milk(grey(8), grey(1), hg(-0.999f))));
       return scene;
     }},
    {"smooth_cloud",
     [] {
       SceneDescription scene = view(600);
       ParticleMediumDescription medium = milk(grey(3), grey(1));
       medium.model = DensityModel::smooth;
       scene.volumes.push_back(cloud(medium));
       return scene;
     }},
    {"milky_water",
     [] {
       SceneDescription scene = view(600);
       FluidDescription fluid = lattice_fluid({-0.6, -0.6, -0.6}, {0.6, 0.6, 0.6}, 0.12);
       fluid.medium = milk({6, 4, 2}, grey(1), hg(0.5f));
       scene.fluids.push_back(fluid);
       return scene;
     }},
    {"milky_water_with_foam_and_bubble",
     [] {
       SceneDescription scene = view(600);
       FluidDescription fluid = lattice_fluid({-0.6, -0.6, -0.6}, {0.6, 0.4, 0.6}, 0.12);
       fluid.medium = milk(grey(5), grey(1), hg(0.5f));
       scene.fluids.push_back(fluid);
       scene.balls.push_back(balls({{{0, 0, 0}, 0.25}}, dielectric_material(1, {}, 2)));
       VolumeDescription foam = cloud(milk(grey(6), grey(1)));
       for (Vec3d& p : foam.positions) p.y += 0.4;
       scene.volumes.push_back(foam);
       return scene;
     }},
};

class MediaFurnace : public ::testing::TestWithParam<Furnace> {};

// What scatters and absorbs nothing is invisible in light that is the same from everywhere.
TEST_P(MediaFurnace, IsInvisible) {
  for (const LightStrategy strategy : {LightStrategy::mis, LightStrategy::bsdf_only}) {
    const SceneDescription scene = GetParam().scene();
    for (int channel = 0; channel < 3; channel += 2) {
      const Measured m = render_and_measure(scene, strategy, channel);
      EXPECT_NEAR(m.mean, 1, 4 * m.standard_error + 1e-5);
      EXPECT_LT(m.standard_error, 0.02);
      EXPECT_GT(m.counters.collisions, 10000u);
      EXPECT_EQ(m.counters.contradictions, 0u);
      EXPECT_EQ(m.counters.majorants, 0u);
      EXPECT_EQ(m.bad, 0u);
    }
  }
}

TEST_P(MediaFurnace, BringsNoMoreThanThereIsAtAnyDepth) {
  double last = 0;
  for (const int depth : {0, 1, 2, 4, 16}) {
    SceneDescription scene = GetParam().scene();
    scene.integrator.samples = 200;
    scene.integrator.max_depth = depth;
    const Measured m = render_and_measure(scene);
    EXPECT_EQ(m.bad, 0u);
    EXPECT_LE(m.mean, 1 + 4 * m.standard_error + 1e-5) << "depth " << depth;
    EXPECT_GE(m.mean, last - 4 * m.standard_error) << "depth " << depth;
    last = m.mean;
    if (depth == 0) {
      EXPECT_LT(m.mean, 0.95) << "nothing is there";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Media, MediaFurnace, ::testing::ValuesIn(furnaces),
                         [](const auto& test) { return std::string(test.param.name); });

// Radiance inside water is n^2 times that outside, whatever scatters in it.
TEST(MediaRadiance, IsLargerByTheSquareOfTheIndexInside) {
  SceneDescription scene = scene_seen({0, 0, 0}, {0.3, 0.2, -1}, 60, 6, 3000);
  MaterialDescription water = dielectric_material(1.33);
  water.scattering = grey(2);
  water.phase = hg(0.3f);
  scene.balls.push_back(balls({{{0, 0, 0}, 1}}, water));
  const Measured m = render_and_measure(scene);
  EXPECT_NEAR(m.mean, 1.33 * 1.33, 4 * m.standard_error + 1e-5);
  EXPECT_LT(m.standard_error, 0.02);
}

// ---- photon walk -------------------------------------------------------------------------------------------------

/// Radiance along a ray that enters a homogeneous unit ball at `entry`, in an environment of radiance 1: the mean of
/// albedo^n over walks of n collisions. Its own code, in double precision.
double walk_in_ball(Vec3d entry, Vec3d direction, double extinction, double albedo, double g, int walks,
                    double& error) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> uniform(0, 1);
  double sum = 0, squares = 0;
  for (int i = 0; i < walks; ++i) {
    Vec3d p = entry, d = direction;
    double weight = 1;
    while (true) {
      const double along = dot(p, d);
      const double to_surface = -along + std::sqrt(std::max(0.0, along * along - dot(p, p) + 1));
      const double step = -std::log(1 - uniform(random)) / extinction;
      if (step >= to_surface) break;
      p = p + step * d;
      weight *= albedo;
      const double inner = (1 - g * g) / (1 - g + 2 * g * uniform(random));
      const double cosine = g == 0 ? 2 * uniform(random) - 1 : (1 + g * g - inner * inner) / (2 * g);
      const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine)), angle = 2 * M_PI * uniform(random);
      const Vec3d helper = std::abs(d.x) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
      const Vec3d u = normalize(cross(helper, d)), v = cross(d, u);
      d = normalize(cosine * d + sine * std::cos(angle) * u + sine * std::sin(angle) * v);
    }
    sum += weight;
    squares += weight * weight;
  }
  const double mean = sum / walks;
  error = std::sqrt((squares / walks - mean * mean) / walks);
  return mean;
}

TEST(PhotonWalk, AgreesForAnIndexMatchedBall) {
  const double extinction = 2.5, albedo = 0.8;
  for (const float g : {0.0f, 0.6f, -0.4f}) {
    // Along a chord at the height 0.5.
    double error = 0;
    const double expected =
        walk_in_ball({-std::sqrt(0.75), 0.5, 0}, {1, 0, 0}, extinction, albedo, static_cast<double>(g), 400000, error);
    SceneDescription scene = scene_seen({-4, 0.5, 0}, {4, 0.5, 0}, pencil, 2, 40000);

    // As a body of fog, as matched glass, and as a single large particle.
    SceneDescription fog = scene, glass = scene, particle = scene;
    const Rgb scattering = grey(static_cast<float>(extinction * albedo)),
              absorption = grey(static_cast<float>(extinction * (1 - albedo)));
    fog.balls.push_back(balls({{{0, 0, 0}, 1}}, fog_material(absorption, scattering, hg(g))));
    MaterialDescription matched = dielectric_material(1, absorption);
    matched.scattering = scattering;
    matched.phase = hg(g);
    glass.balls.push_back(balls({{{0, 0, 0}, 1}}, matched));
    VolumeDescription one;
    one.positions = {{0, 0, 0}};
    one.radius = 1;
    one.medium = milk(grey(static_cast<float>(extinction)), grey(static_cast<float>(albedo)), hg(g));
    particle.volumes.push_back(one);
    for (const SceneDescription& way : {fog, glass, particle}) {
      const Measured m = render_and_measure(way);
      EXPECT_NEAR(m.mean, expected, 4 * std::hypot(m.standard_error, error)) << "g = " << g;
      EXPECT_LT(m.standard_error, 0.002);
    }
  }
}

// ---- absorption --------------------------------------------------------------------------------------------------

/// Fresnel reflectance of unpolarised light, and the cosine inside.
double reflectance(double cosine, double n, double& inside) {
  inside = std::sqrt(1 - (1 - cosine * cosine) / (n * n));
  const double s = (cosine - n * inside) / (cosine + n * inside), p = (n * cosine - inside) / (n * cosine + inside);
  return 0.5 * (s * s + p * p);
}

// A slab that absorbs, with all its internal reflections: of light from everywhere the slab shows what it transmits
// and what it reflects, (R + T) by the geometric series with e = exp(-depth) on each way through.
TEST(AbsorbingSlab, ShowsTheSeriesOfItsReflections) {
  const double n = 1.33, k = 2.2, thickness = 0.6;
  for (const double degrees : {0.0, 50.0}) {
    const double cosine = std::cos(degrees * M_PI / 180);
    double inside = 1;
    // The series of each polarisation is its own; the path tracer's light is unpolarised at every interface, as is its
    // expectation here.
    const double r = reflectance(cosine, n, inside);
    const double e = std::exp(-k * thickness / inside);
    const double transmitted = (1 - r) * (1 - r) * e / (1 - r * r * e * e);
    const double reflected = r + (1 - r) * (1 - r) * r * e * e / (1 - r * r * e * e);
    const Vec3d from{-4 * std::sin(degrees * M_PI / 180), 0, 4 * cosine};
    SceneDescription scene = scene_seen(from, {0, 0, 0}, pencil, 2, 20000);

    SceneDescription body = scene, particles = scene;
    body.boxes.push_back(box({-50, -50, -0.5 * thickness}, {50, 50, 0.5 * thickness},
                             dielectric_material(n, grey(static_cast<float>(k)))));
    // The same by particles that absorb and whose balls leave no gap, cut flat by a container.
    FluidDescription fluid = lattice_fluid({-1.5, -0.5, -0.6}, {1.5, 0.5, 0.6}, 0.092);
    fluid.surface.radius = 0.05f;
    fluid.material = dielectric_material(n);
    fluid.container = Box3d{{-1.4, -0.4, -0.5 * thickness}, {1.4, 0.4, 0.5 * thickness}};
    fluid.wets_container = false;
    fluid.medium = milk(grey(static_cast<float>(k)), {});
    fluid.medium->density_radius = 0.08;  // 1.6 R0
    particles.fluids.push_back(fluid);
    for (const SceneDescription& way : {body, particles}) {
      const Measured m = render_and_measure(way);
      EXPECT_NEAR(m.mean, transmitted + reflected, 4 * m.standard_error + 1e-4) << degrees;
      EXPECT_LT(m.standard_error, 0.003);
    }
  }
}

// ---- extremes ----------------------------------------------------------------------------------------------------

/// Along a chord of the ball of radius 0.5 round the origin, 0.8 long.
SceneDescription along_chord(int samples = 20000) { return scene_seen({-3, 0.3, 0}, {3, 0.3, 0}, pencil, 2, samples); }

VolumeDescription black_balls(int count) {
  VolumeDescription volume;
  volume.positions.assign(static_cast<std::size_t>(count), Vec3d{});
  volume.radius = 0.5;
  volume.medium = milk({0.5f, 1, 2}, {});
  return volume;
}

// Without scattering light is left by Beer's law. Where particles coincide they count as one; a fluid of one particle is a
// ball of its radius.
TEST(Extremes, OneParticleTransmitsByItsChord) {
  SceneDescription one = along_chord(), many = one, fluid = one;
  one.volumes.push_back(black_balls(1));
  many.volumes.push_back(black_balls(50));
  FluidDescription drop;
  drop.positions = {{0, 0, 0}};
  drop.surface.radius = 0.5f;
  drop.material = dielectric_material(1);
  drop.medium = black_balls(1).medium;
  fluid.fluids.push_back(drop);
  for (const SceneDescription& scene : {one, many, fluid})
    for (int channel = 0; channel < 3; ++channel) {
      const Measured m = render_and_measure(scene, LightStrategy::mis, channel);
      EXPECT_NEAR(m.mean, std::exp(-0.8 * static_cast<double>(drop.medium->extinction[channel])),
                  4 * m.standard_error + 5e-4);
      EXPECT_LT(m.standard_error, 0.01);
      EXPECT_EQ(m.counters.contradictions, 0u);
    }
}

TEST(Extremes, WithoutExtinctionNothingIsThere) {
  SceneDescription scene = view(20);
  scene.volumes.push_back(cloud(milk({}, grey(0.5f))));
  FluidDescription fluid = lattice_fluid({-0.6, -0.6, -0.6}, {0.6, 0.6, 0.6}, 0.12);
  fluid.material = dielectric_material(1);
  fluid.medium = milk({}, {});
  scene.fluids.push_back(fluid);
  const Measured m = render_and_measure(scene);
  EXPECT_EQ(m.counters.collisions, 0u);
  EXPECT_NEAR(m.least, 1, 1e-6);
  EXPECT_NEAR(m.greatest, 1, 1e-6);
}

/// Water seen from straight above, with a flat surface.
SceneDescription bowl(const MaterialDescription& material, std::optional<ParticleMediumDescription> medium) {
  SceneDescription scene = scene_seen({0, 3, 0}, {0, 0, 0}, pencil, 2, 20000);
  FluidDescription fluid = lattice_fluid({-0.6, -0.6, -0.6}, {0.6, 0.6, 0.6}, 0.1);
  fluid.container = Box3d{{-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}};
  fluid.wets_container = false;
  fluid.material = material;
  fluid.medium = std::move(medium);
  scene.fluids.push_back(fluid);
  return scene;
}

// What is infinitely dense is a surface under the water's own, and that the limit of what is very dense: black shows
// Fresnel's reflection alone, 2 % at a right angle; white loses nothing.
TEST(Extremes, WhatIsInfinitelyDenseIsASurface) {
  const MaterialDescription water = dielectric_material(1.33);
  ParticleMediumDescription ink = milk(grey(1e6f), {});
  ink.density_radius = 0.09;
  const double reflected = std::pow(0.33 / 2.33, 2);
  for (const SceneDescription& black : {bowl(opaque_fluid_material(water, {}), std::nullopt), bowl(water, ink)}) {
    const Measured m = render_and_measure(black);
    EXPECT_NEAR(m.mean, reflected, 4 * m.standard_error + 1e-5);
    EXPECT_LT(m.standard_error, 0.002);
  }
  const Measured white = render_and_measure(bowl(opaque_fluid_material(water, grey(1)), std::nullopt));
  EXPECT_NEAR(white.mean, 1, 4 * white.standard_error + 2e-3);
  // Without a surface of its own it is just that colour.
  const Measured matt =
      render_and_measure(bowl(opaque_fluid_material(dielectric_material(1), grey(0.3f)), std::nullopt));
  EXPECT_NEAR(matt.mean, 0.3, 4 * matt.standard_error + 1e-5);
}

// ---- emission ----------------------------------------------------------------------------------------------------

// Gas of radiance L that absorbs all it meets shows L (1 - exp(-depth)).
TEST(GlowingGas, ShowsItsRadianceAsFarAsItIsOpaque) {
  SceneDescription scene = scene_seen({0, 0, 5}, {0, 0, 0}, pencil, 2, 20000);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  VolumeDescription fire;
  fire.positions = {{0, 0, 0}};
  fire.radius = 0.5;
  fire.medium = milk({0.5f, 1, 2}, {});
  SceneDescription coloured = scene, hot = scene;
  fire.medium.emission = {{3, 2, 1}};
  coloured.volumes.push_back(fire);
  fire.medium.emission.clear();
  fire.medium.temperatures = {2200};
  fire.medium.emission_scale = 2;
  hot.volumes.push_back(fire);
  const Rgb glow = 2.0f * black_body_radiance(2200);
  for (int channel = 0; channel < 3; ++channel) {
    const double opaque = 1 - std::exp(-static_cast<double>(fire.medium.extinction[channel]));
    const Measured by_colour = render_and_measure(coloured, LightStrategy::mis, channel);
    EXPECT_NEAR(by_colour.mean, (3 - channel) * opaque, 4 * by_colour.standard_error);
    EXPECT_LT(by_colour.standard_error, 0.02);
    const Measured by_heat = render_and_measure(hot, LightStrategy::mis, channel);
    EXPECT_NEAR(by_heat.mean, static_cast<double>(glow[channel]) * opaque, 4 * by_heat.standard_error);
  }
}

// ---- light sampling ----------------------------------------------------------------------------------------------

// A lamp in fog, however its light is sampled.
TEST(LampInFog, IsTheSameHoweverLightIsSampled) {
  SceneDescription scene = scene_seen({0, 0, 4}, {0, 0, 0}, 20, 3, 40000);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.volumes.push_back(cloud(milk({2, 4, 6}, {0.9f, 0.8f, 0.7f}, hg(0.6f))));
  LightDescription lamp;
  lamp.kind = LightDescription::Kind::sphere;
  lamp.position = {0.9, 0.3, 0.2};
  lamp.radius = 0.3;
  lamp.radiance = {5, 5, 5};
  scene.lights.push_back(lamp);
  const Measured mis = render_and_measure(scene, LightStrategy::mis, 1);
  for (const LightStrategy strategy : {LightStrategy::bsdf_only, LightStrategy::lights_only}) {
    const Measured other = render_and_measure(scene, strategy, 1);
    EXPECT_EQ(other.bad, 0u);
    EXPECT_NEAR(mis.mean, other.mean, 4 * std::hypot(mis.standard_error, other.standard_error));
    EXPECT_LT(other.standard_error, 0.02 * mis.mean);
  }
}

/// A tiny lamp in thin fog, one of the two kinds of medium or both, and the camera beside it.
SceneDescription lamp_in_thin_fog(bool body, bool particles, bool equiangular) {
  SceneDescription scene = scene_seen({0, 0, 4}, {0, 0, 0}, pencil, 2, 40000);
  scene.environment.kind = EnvironmentDescription::Kind::none;
  scene.integrator.equiangular = equiangular;
  if (body)
    scene.boxes.push_back(box({-2, -2, -2}, {2, 2, 2}, fog_material(grey(0.02f), {0.02f, 0.1f, 0.3f}, hg(0.4f))));
  if (particles) {
    VolumeDescription balls = cloud(milk({0.2f, 0.3f, 0.5f}, {0.9f, 0.8f, 0.7f}, hg(-0.3f)));
    scene.volumes.push_back(balls);
    VolumeDescription others = cloud(milk({0.5f, 0.1f, 0}, grey(0.9f), {PhaseKind::rayleigh, 0}));
    for (Vec3d& p : others.positions) p.x += 0.3;
    scene.volumes.push_back(others);
  }
  LightDescription lamp;
  lamp.kind = LightDescription::Kind::sphere;
  lamp.position = {0.1, 0.05, -0.1};
  lamp.radius = 0.002;
  lamp.radiance = grey(1e5f);
  scene.lights.push_back(lamp);
  // Another, so that there is a choice.
  lamp.kind = LightDescription::Kind::disk;
  lamp.position = {-0.3, 0.4, 0.2};
  lamp.normal = normalize(Vec3d{1, -1, 0.2});
  lamp.radius = 0.01;
  lamp.radiance = grey(2e3f);
  scene.lights.push_back(lamp);
  scene.integrator.hide_emitters = true;
  return scene;
}

// Points drawn by where a lamp is bring what flights leave out, for every rule of overlap and at any depth, and quietly.
TEST(LampInFog, IsTheSameHoweverPointsAreDrawn) {
  struct Way {
    bool body, particles;
    MediaOverlap overlap;
    int depth;
  };
  for (const Way& way : {Way{true, false, MediaOverlap::sum, 1}, Way{true, true, MediaOverlap::sum, 60000},
                         Way{false, true, MediaOverlap::sum, 1}, Way{false, true, MediaOverlap::max, 2}}) {
    SceneDescription plain = lamp_in_thin_fog(way.body, way.particles, false),
                     better = lamp_in_thin_fog(way.body, way.particles, true);
    for (SceneDescription* scene : {&plain, &better}) {
      scene->overlap = way.overlap;
      scene->integrator.max_depth = way.depth;
    }
    for (int channel = 0; channel < 3; channel += 2) {
      const Measured m = render_and_measure(plain, LightStrategy::mis, channel),
                     n = render_and_measure(better, LightStrategy::mis, channel);
      EXPECT_EQ(n.bad, 0u);
      EXPECT_NEAR(n.mean, m.mean, 4 * std::hypot(m.standard_error, n.standard_error));
      EXPECT_LT(n.standard_error, 0.02 * n.mean);
      EXPECT_LT(n.standard_error, (way.particles ? 0.7 : 0.3) * m.standard_error);
    }
  }
}

// A point is a small sphere of the same intensity, pi r^2 L, however near it comes.
TEST(LampInFog, APointShinesAsASmallSphere) {
  SceneDescription sphere = lamp_in_thin_fog(true, false, true);
  sphere.integrator.max_depth = 1;
  sphere.lights.resize(1);
  SceneDescription point = sphere;
  point.lights[0].kind = LightDescription::Kind::point;
  point.lights[0].radiance = grey(static_cast<float>(M_PI * 0.002 * 0.002 * 1e5));
  const Measured a = render_and_measure(sphere), b = render_and_measure(point);
  EXPECT_NEAR(a.mean, b.mean, 4 * std::hypot(a.standard_error, b.standard_error));
  EXPECT_LT(b.standard_error, 0.005 * b.mean);
}

// ---- shadow rays straight through ----------------------------------------------------------------------------------

/// A diffuse floor under water with a flat surface, far larger than what is seen of it.
SceneDescription pool(bool straight) {
  SceneDescription scene = scene_seen({0, 2, 0}, {0, 0, 0}, 10, 3, 20000);
  scene.boxes.push_back(box({-200, -0.5, -200}, {200, 0.3, 200}, dielectric_material(1.33)));
  PatchDescription floor = patch({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 150, diffuse_material(grey(0.6f)));
  scene.patches.push_back(floor);
  scene.integrator.straight_shadows = straight;
  scene.integrator.max_depth = 3;
  return scene;
}

// Under a flat surface a level floor gets the flux that gets through the surface, whether it is bent on the way or not. So
// straight shadow rays must bring exactly what refraction brings, and nothing twice.
TEST(StraightShadows, BringWhatRefractionBrings) {
  const Measured bent = render_and_measure(pool(false)), straight = render_and_measure(pool(true));
  EXPECT_GT(bent.mean, 0.3);
  EXPECT_NEAR(straight.mean, bent.mean, 4 * std::hypot(bent.standard_error, straight.standard_error));
  EXPECT_LT(straight.standard_error, 0.01);
}

// A small lamp, which refraction finds by chance only.
TEST(StraightShadows, FindSmallLamps) {
  const auto lit = [](bool straight) {
    SceneDescription scene = pool(straight);
    scene.environment.kind = EnvironmentDescription::Kind::none;
    LightDescription lamp;
    lamp.kind = LightDescription::Kind::sphere;
    lamp.position = {10, 30, 0};  // its mirror image is not in the picture
    lamp.radius = 2;
    lamp.radiance = grey(200);
    scene.lights.push_back(lamp);
    return render_and_measure(scene);
  };
  const Measured bent = lit(false), straight = lit(true);
  EXPECT_LT(straight.standard_error, 0.1 * straight.mean);
  EXPECT_GT(bent.standard_error, 3 * straight.standard_error);
  // In shallow water refraction moves a lamp's light little.
  EXPECT_NEAR(bent.mean, straight.mean, 4 * bent.standard_error + 0.05 * straight.mean);
}

// ---- clamp -------------------------------------------------------------------------------------------------------

TEST(Clamp, CutsWhatSamplesBringAfterTheFirstEvent) {
  SceneDescription scene = pool(false);
  scene.integrator.samples = 400;
  const Measured whole = render_and_measure(scene);
  scene.integrator.clamp = 0.2;
  const Measured cut = render_and_measure(scene);
  EXPECT_LT(cut.mean, 0.9 * whole.mean);
  EXPECT_LE(cut.greatest, 0.2 * 3 + 1e-6);
}

}  // namespace
}  // namespace embrun
