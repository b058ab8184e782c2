#include "measure/oracle_scene.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "io/read_particles.h"

namespace embrun::measure {

namespace {

constexpr float radius = 0.025f;
constexpr double spacing = 0.0465;

Vec3 jittered(Vec3 p, float amount, Dice& dice) {
  return p + Vec3{dice.uniform(-amount, amount), dice.uniform(-amount, amount), dice.uniform(-amount, amount)};
}

/// Disordered lattice points of the box that `keep` keeps.
template <class Keep>
void fill(std::vector<Vec3>& positions, Vec3 low, Vec3 high, float jitter, Dice& dice, const Keep& keep) {
  const auto s = static_cast<float>(spacing);
  for (float z = low.z; z <= high.z; z += s) {
    for (float y = low.y; y <= high.y; y += s) {
      for (float x = low.x; x <= high.x; x += s) {
        if (keep(Vec3{x, y, z})) positions.push_back(jittered({x, y, z}, jitter * s, dice));
      }
    }
  }
}

void add_droplets(OracleScene& scene, Dice& dice) {
  for (int drop = 0; drop < 40; ++drop) {
    const Vec3 centre{dice.uniform(0, 2), dice.uniform(0, 1), dice.uniform(0, 2)};
    const float r = dice.uniform(0.5, 4) * static_cast<float>(spacing);
    fill(scene.positions, centre - Vec3{r, r, r}, centre + Vec3{r, r, r}, 0.25f, dice,
         [&](Vec3 p) { return length(p - centre) <= r; });
  }
}

void add_sheets(OracleScene& scene, Dice& dice) {
  // Of one, two and three layers, one above the other with gaps that shrink, torn and wavy.
  const auto s = static_cast<float>(spacing);
  float height = 0;
  for (int sheet = 0; sheet < 6; ++sheet) {
    const int layers = 1 + sheet % 3;
    std::vector<Vec3> points;
    fill(points, {0, 0, 0}, {1.5f, s * (static_cast<float>(layers) - 0.5f), 1.5f}, 0.2f, dice,
         [&](Vec3 p) { return std::sin(7 * p.x + static_cast<float>(sheet)) * std::sin(6 * p.z) < 0.75f; });
    for (const Vec3 p : points) scene.positions.push_back(p + Vec3{0, height + 0.03f * std::sin(4 * p.x + 3 * p.z), 0});
    height += s * (static_cast<float>(layers) + 4.0f - 0.5f * static_cast<float>(sheet));
  }
}

void add_spread(OracleScene& scene, std::size_t count, Vec3 size, Dice& dice) {
  for (std::size_t i = 0; i < count; ++i) {
    scene.positions.push_back({dice.uniform(0, size.x), dice.uniform(0, size.y), dice.uniform(0, size.z)});
  }
}

}  // namespace

const std::vector<std::string>& synthetic_scene_names() {
  static const std::vector<std::string> names{"droplets", "sheets",      "slab", "lone",
                                              "spray",    "log-uniform", "dust", "offset"};
  return names;
}

Box3 OracleScene::bounds() const {
  Box3 box;
  for (const Vec3 p : positions) box.include(p);
  const Vec3 margin{settings.radius, settings.radius, settings.radius};
  box.low -= margin;
  box.high += margin;
  return box;
}

OracleScene make_scene(const std::string& name, int order, std::uint32_t seed) {
  OracleScene scene;
  scene.name = name;
  scene.settings.order = order;
  scene.settings.radius = radius;
  scene.settings.spacing = spacing;
  scene.tolerance = 1e-3 * static_cast<double>(radius);
  Dice dice(seed);
  if (name == "droplets") {
    add_droplets(scene, dice);
  } else if (name == "sheets") {
    add_sheets(scene, dice);
  } else if (name == "slab") {
    // A perfect lattice: everything aligned with the axes, many equal values.
    fill(scene.positions, {0, 0, 0}, {1.2f, 0.3f, 1.2f}, 0.0f, dice, [](Vec3) { return true; });
  } else if (name == "lone") {
    add_spread(scene, 300, {2, 2, 2}, dice);
  } else if (name == "spray") {
    add_spread(scene, 6000, {1.2f, 1.2f, 1.2f}, dice);
  } else if (name == "log-uniform") {
    add_spread(scene, 4000, {2, 2, 2}, dice);
    for (std::size_t i = 0; i < scene.positions.size(); ++i) {
      scene.radii.push_back(static_cast<float>(std::pow(10.0, -4 + 3 * dice.next())));
    }
    scene.settings.radius = 3.2e-3f;  // the geometric mean
    scene.settings.spacing = 0;
    scene.tolerance = 3.2e-6;
  } else if (name == "dust") {
    // Mean radius 2e-3 beside 1e-8.
    const float scale = 2e-3f / radius;
    add_droplets(scene, dice);
    for (Vec3& p : scene.positions) p = p * scale;
    scene.radii.assign(scene.positions.size(), 2e-3f);
    add_spread(scene, scene.positions.size() / 4, Vec3{2, 1, 2} * scale, dice);
    scene.radii.resize(scene.positions.size(), 1e-8f);
    scene.settings.radius = 2e-3f;
    scene.settings.spacing = 0;
    scene.tolerance = 2e-6;
  } else if (name == "offset") {
    // 1e5 radii from the origin of coordinates, where neighbouring floats are 6e-3 R0 or more apart: particles and ray
    // origins lie on those, and a hit's position is off by half a step.
    add_droplets(scene, dice);
    for (Vec3& p : scene.positions) p += Vec3{1e5f * radius, -1e5f * radius, 0.7e5f * radius};
  } else {
    const ParticleSet particles = read_particles(name);
    for (const Vec3d& p : particles.positions) scene.positions.push_back(to_float(p));
  }
  return scene;
}

oracle::Vec to_oracle(Vec3 v) { return {v.x, v.y, v.z}; }

oracle::Kernel to_oracle(Kernel kernel) {
  switch (kernel) {
    case Kernel::metaball: return oracle::Kernel::metaball;
    case Kernel::zhu_bridson: return oracle::Kernel::zhu_bridson;
    case Kernel::blinn: break;
  }
  return oracle::Kernel::blinn;
}

oracle::Ray to_oracle(const Ray& ray) {
  return {to_oracle(ray.origin), to_oracle(ray.direction), ray.t_min, std::min(1e30, static_cast<double>(ray.t_max))};
}

oracle::Surface oracle_surface(const OracleScene& scene, const SurfaceModel& model) {
  std::vector<oracle::Particle> particles;
  const auto radius_of = [&](std::size_t i) {
    return static_cast<double>(scene.radii.empty() ? scene.settings.radius : scene.radii[i]);
  };
  for (std::size_t i = 0; i < scene.positions.size(); ++i) {
    const double r = radius_of(i);
    particles.push_back({to_oracle(scene.positions[i]), 2.0 * scene.settings.order * r, r,
                         1.0 / static_cast<double>(model.threshold), false});
  }
  for (std::size_t k = 0; k < model.recovered.size(); ++k) {
    const double r = radius_of(model.recovered[k]);
    particles.push_back({to_oracle(scene.positions[model.recovered[k]]), 2 * r, r,
                         static_cast<double>(model.recovered_weights[k]) / static_cast<double>(model.recover_threshold),
                         true});
  }
  return {to_oracle(scene.settings.kernel), std::move(particles)};
}

namespace {

Vec3 axis_direction(Dice& dice) {
  Vec3 d = dice.direction();
  const int axis = static_cast<int>(dice.next() * 3);
  if (dice.next() < 0.5) {
    // Along an axis, either way; a zero may be a negative one.
    const Vec3 along{axis == 0 ? 1.0f : 0.0f, axis == 1 ? 1.0f : 0.0f, axis == 2 ? 1.0f : 0.0f};
    return dice.next() < 0.5 ? along : -along;
  }
  d[axis] = 0.0f;
  return length(d) > 0 ? normalize(d) : Vec3{1, 0, 0};
}

Vec3 point_in(const Box3& box, Dice& dice) {
  return {dice.uniform(box.low.x, box.high.x), dice.uniform(box.low.y, box.high.y),
          dice.uniform(box.low.z, box.high.z)};
}

/// Where a random ray of the class starts: camera rays from a ball around the body, the others where the field is
/// on the class's side.
bool random_ray(const OracleScene& scene, const oracle::Surface& surface, RayClass ray_class, Dice& dice,
                TestRay& out) {
  const Box3 box = scene.bounds();
  out = {};
  out.ray.direction = dice.next() < 1.0 / 3 ? axis_direction(dice) : dice.direction();
  if (ray_class == RayClass::camera) {
    out.ray.origin = point_in(box, dice) - out.ray.direction * (1.5f * length(box.high - box.low));
    return true;
  }
  // Near a particle, so that bodies that fill little of their box are met.
  const auto pick = static_cast<std::size_t>(dice.next() * static_cast<double>(scene.positions.size()));
  const float r = scene.radii.empty() ? scene.settings.radius : scene.radii[pick];
  out.ray.origin =
      ray_class == RayClass::inside || dice.next() < 0.5
          ? scene.positions[pick] + dice.direction() * (r * dice.uniform(0, ray_class == RayClass::inside ? 1 : 6))
          : point_in(box, dice);
  const bool inside = surface.inside(to_oracle(out.ray.origin));
  if (inside != (ray_class == RayClass::inside)) return false;
  out.side = dice.next() < 0.5 ? Side::unknown : inside ? Side::inside : Side::outside;
  return true;
}

/// A ray past a point of the surface at an offset of at most 0.05 R0 from its tangent plane.
bool tangent_ray(const OracleScene& scene, const oracle::Surface& surface, RayClass ray_class, Dice& dice,
                 TestRay& out) {
  TestRay probe;
  if (!random_ray(scene, surface, dice.next() < 0.5 ? RayClass::camera : RayClass::outside, dice, probe)) return false;
  oracle::Crossings crossings(surface, to_oracle(probe.ray), scene.tolerance);
  double t;
  if (!crossings.next(t)) return false;
  const Vec3 point = probe.ray.at(static_cast<float>(t));
  const oracle::Vec gradient = surface.sample(to_oracle(point)).gradient;
  if (!(oracle::length(gradient) > 0)) return false;
  const oracle::Vec unit = gradient * (-1 / oracle::length(gradient));
  const Vec3 normal{static_cast<float>(unit.x), static_cast<float>(unit.y), static_cast<float>(unit.z)};
  const float r0 = scene.settings.radius;
  const Vec3 tangent = normalize(cross(normal, dice.direction()));
  const Vec3 aim = point + normal * dice.uniform(-0.05 * r0, 0.05 * r0);
  out = {};
  out.ray.direction = tangent;
  const float back = ray_class == RayClass::camera ? dice.uniform(50, 300) * r0 : dice.uniform(0.2, 12) * r0;
  out.ray.origin = aim - tangent * back;
  const bool inside = surface.inside(to_oracle(out.ray.origin));
  if (ray_class != RayClass::camera) {
    if (inside != (ray_class == RayClass::inside)) return false;
    out.side = dice.next() < 0.5 ? Side::unknown : inside ? Side::inside : Side::outside;
  }
  // Nothing else should be in the way, so that the ray is decided at the tangency.
  oracle::Crossings way(surface, to_oracle(out.ray), scene.tolerance);
  return !way.next(t) || t > static_cast<double>(back - 3 * r0);
}

}  // namespace

std::vector<TestRay> make_rays(const OracleScene& scene, const oracle::Surface& surface, const Intersector& intersect,
                               RayClass ray_class, std::size_t count, std::uint32_t seed) {
  const std::size_t fifth = count / 5;
  std::vector<TestRay> rays = record_render(intersect, scene.bounds(), count - 2 * fifth, seed).of(ray_class);
  const std::size_t recorded = rays.size();
  // Far from the origin of coordinates a recorded origin may round to well on the wrong side: the field decides then.
  for (TestRay& ray : rays) {
    const oracle::Vec origin = to_oracle(ray.ray.origin);
    if (ray.side != Side::unknown && surface.inside(origin) != (ray.side == Side::inside) &&
        !surface.surface_within(origin, scene.tolerance)) {
      ray.side = Side::unknown;
      ray.ray.clearance = {};
    }
  }
  rays.resize(recorded + 2 * fifth);
  // Each ray has its own dice, so that the rays do not depend on the number of threads.
  parallel_for(2 * fifth, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Dice dice((static_cast<std::uint64_t>(seed) << 32) + 4 * i + static_cast<std::uint64_t>(ray_class));
      TestRay& ray = rays[recorded + i];
      bool made = false;
      for (int attempt = 0; attempt < 200 && !made; ++attempt) {
        made = i < fifth ? random_ray(scene, surface, ray_class, dice, ray)
                         : tangent_ray(scene, surface, ray_class, dice, ray);
      }
      // A body without such rays (nothing inside to start from) gets none.
      if (!made) ray.ray.t_max = -1.0f;
    }
  });
  std::erase_if(rays, [](const TestRay& ray) { return ray.ray.t_max < 0; });
  return rays;
}

namespace {

bool same_answer(const oracle::Answer& a, const oracle::Answer& b, double tolerance) {
  return a.hit == b.hit && (!a.hit || (std::abs(a.t - b.t) <= tolerance && a.entering == b.entering &&
                                       oracle::length(a.position - b.position) <= tolerance &&
                                       oracle::length(a.normal - b.normal) <= 1e-3));
}

}  // namespace

std::vector<OracleReport> judge_rays(const OracleScene& scene, const oracle::Surface& surface,
                                     const std::vector<Intersector>& intersectors, const std::vector<TestRay>& rays) {
  std::vector<std::vector<OracleReport::Wrong>> all(intersectors.size(), std::vector<OracleReport::Wrong>(rays.size()));
  parallel_for(rays.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto side = rays[i].side == Side::unknown   ? oracle::Start::unknown
                        : rays[i].side == Side::outside ? oracle::Start::outside
                                                        : oracle::Start::inside;
      for (std::size_t k = 0; k < intersectors.size(); ++k) {
        SurfaceHit hit;
        const bool found = intersectors[k](rays[i].ray, rays[i].side, hit);
        const oracle::Answer answer{found, found ? static_cast<double>(hit.t) : 0.0, hit.entering,
                                    to_oracle(hit.position), to_oracle(hit.geometric_normal)};
        const bool known = k > 0 && same_answer(answer, all[0][i].answer, 0.01 * scene.tolerance);
        all[k][i] = {
            rays[i], answer,
            known ? all[0][i].judgement : oracle::judge(surface, to_oracle(rays[i].ray), side, answer, scene.tolerance),
            i};
      }
    }
  });
  std::vector<OracleReport> reports(intersectors.size());
  for (std::size_t k = 0; k < intersectors.size(); ++k) {
    OracleReport& report = reports[k];
    report.rays = rays.size();
    for (const OracleReport::Wrong& one : all[k]) {
      ++report.counts[static_cast<std::size_t>(one.judgement.verdict)];
      report.hits += one.answer.hit;
      if (one.judgement.verdict != oracle::Verdict::right) report.wrong.push_back(one);
    }
  }
  return reports;
}

OracleReport judge_rays(const OracleScene& scene, const oracle::Surface& surface, const Intersector& intersect,
                        const std::vector<TestRay>& rays) {
  return judge_rays(scene, surface, std::vector<Intersector>{intersect}, rays).front();
}

std::string OracleReport::summary() const {
  std::string text = fmt::format("{} rays, {} hits, {} wrong", rays, hits, wrong_count());
  for (int v = 1; v < oracle::verdict_count; ++v) {
    const std::size_t n = counts[static_cast<std::size_t>(v)];
    if (n) text += fmt::format(", {} {}", n, oracle::name_of(static_cast<oracle::Verdict>(v)));
  }
  return text;
}

}  // namespace embrun::measure
