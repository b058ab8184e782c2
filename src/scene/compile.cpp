#include "scene/compile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <tuple>
#include <utility>

#include "base/error.h"
#include "math/box3d.h"
#include "math/median.h"
#include "sampling/gauss_rule.h"
#include "scene/compile_materials.h"
#include "scene/compile_media.h"
#include "scene/compile_splats.h"
#include "scene/pack_balls.h"
#include "scene/wall_contact.h"

namespace embrun {
namespace {

bool is_identity(const Placement& p) { return p == Placement{}; }

/// Of the box round a file's splats.
std::vector<Vec3d> corners_of(const SplatHierarchy& splats) {
  std::vector<Vec3d> corners;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 at{(corner & 1) != 0 ? splats.bounds.high.x : splats.bounds.low.x,
                  (corner & 2) != 0 ? splats.bounds.high.y : splats.bounds.low.y,
                  (corner & 4) != 0 ? splats.bounds.high.z : splats.bounds.low.z};
    corners.push_back(splats.center + to_double(at));
  }
  return corners;
}

/// Where all a mesh stands.
std::span<const Placement> placements_of(const MeshDescription& mesh) {
  if (mesh.copies.empty()) return {&mesh.placement, 1};
  return mesh.copies;
}

Box3d bounds_of(const SceneDescription& scene) {
  Box3d bounds;
  for (const FluidDescription& fluid : scene.fluids) {
    const double reach = 2 * static_cast<double>(fluid.surface.radius) * largest_scale(fluid.placement);
    for (const Vec3d& p : fluid.positions) bounds.include(place(fluid.placement, p), reach);
  }
  for (const VolumeDescription& volume : scene.volumes) {
    for (std::size_t i = 0; i < volume.positions.size(); ++i)
      bounds.include(volume.positions[i], volume.radii.empty() ? volume.radius : static_cast<double>(volume.radii[i]));
  }
  for (const BallsDescription& set : scene.balls)
    for (const BallDescription& ball : set.balls) bounds.include(ball.center, ball.radius);
  for (const CylinderDescription& cylinder : scene.cylinders) {
    bounds.include(cylinder.start, cylinder.radius);
    bounds.include(cylinder.end, cylinder.radius);
  }
  for (const BoxDescription& box : scene.boxes) {
    bounds.include(box.box.low);
    bounds.include(box.box.high);
  }
  for (const PatchDescription& patch : scene.patches) {
    if (!std::isfinite(patch.half_u) || !std::isfinite(patch.half_v)) continue;
    const Vec3d u = normalize(patch.axis_u) * patch.half_u, v = normalize(patch.axis_v) * patch.half_v;
    for (const double a : {-1.0, 1.0})
      for (const double b : {-1.0, 1.0}) bounds.include(patch.center + a * u + b * v);
  }
  for (const SplatsDescription& splats : scene.splats) {
    for (std::size_t i = 0; i < splats.centers.size(); ++i)
      bounds.include(place(splats.placement, splats.centers[i]),
                     static_cast<double>(splats.radii[i]) * largest_scale(splats.placement));
    if (splats.hierarchy != nullptr)
      for (const Vec3d& corner : corners_of(*splats.hierarchy)) bounds.include(place(splats.placement, corner));
  }
  for (const MeshDescription& mesh : scene.meshes)
    for (const Placement& placement : placements_of(mesh))
      for (const Vec3& p : mesh.mesh.positions) bounds.include(place(placement, to_double(p)));
  if (bounds.empty()) bounds.include(scene.camera.target, 1);
  return bounds;
}

/// The point that coordinates are made relative to: the middle of the scene, or where the most particles are, so that
/// strays far away cost the others no precision.
Vec3d middle_of(const SceneDescription& scene, const Box3d& bounds) {
  constexpr std::size_t sample_size = 20000;
  std::vector<double> x, y, z;
  const auto sample = [&](const std::vector<Vec3d>& positions, const Placement& placement) {
    for (std::size_t i = 0; i < positions.size(); i += positions.size() / sample_size + 1) {
      const Vec3d p = place(placement, positions[i]);
      x.push_back(p.x);
      y.push_back(p.y);
      z.push_back(p.z);
    }
  };
  for (const FluidDescription& fluid : scene.fluids) sample(fluid.positions, fluid.placement);
  for (const VolumeDescription& volume : scene.volumes) sample(volume.positions, {});
  for (const SplatsDescription& splats : scene.splats) sample(splats.centers, splats.placement);
  // The coordinates of a file of splats are what they are: another origin would put a translation before every ray.
  for (const SplatsDescription& splats : scene.splats)
    if (splats.hierarchy != nullptr && x.empty() && is_identity(splats.placement)) return splats.hierarchy->center;
  if (x.empty()) return 0.5 * (bounds.low + bounds.high);
  return {median_of(x), median_of(y), median_of(z)};
}

/// What makes two bodies' insides the same.
auto inside_of(const MaterialDescription& m) {
  return std::tuple{m.priority,     m.ior,          m.absorption.r, m.absorption.g, m.absorption.b, m.scattering.r,
                    m.scattering.g, m.scattering.b, m.phase.kind,   m.phase.g,      m.grid_medium};
}

/// Sorts the insides of the scene's bodies into classes by priority.
class MediaClasses {
 public:
  void add(const MaterialDescription& material) {
    if (!has_inside(material)) return;
    const auto same = [&](const MaterialDescription& other) { return inside_of(other) == inside_of(material); };
    if (std::none_of(kinds_.begin(), kinds_.end(), same)) kinds_.push_back(material);
  }
  std::vector<Medium> sort() {
    std::stable_sort(kinds_.begin(), kinds_.end(),
                     [](const auto& a, const auto& b) { return a.priority < b.priority; });
    if (kinds_.size() + 1 > static_cast<std::size_t>(max_media_classes))
      throw Error(fmt::format("{} different media: at most {} besides the air can be told apart", kinds_.size(),
                              max_media_classes - 1));
    std::vector<Medium> media(1);
    for (const MaterialDescription& kind : kinds_)
      media.push_back(
          {static_cast<float>(kind.ior), kind.absorption, kind.scattering, kind.phase, 0, kind.grid_medium});
    return media;
  }
  /// The class of a material's inside; 0 for what has none.
  std::uint8_t class_of(const MaterialDescription& material) const {
    if (!has_inside(material)) return 0;
    for (std::size_t i = 0; i < kinds_.size(); ++i)
      if (inside_of(kinds_[i]) == inside_of(material)) return static_cast<std::uint8_t>(i + 1);
    return 0;
  }

 private:
  std::vector<MaterialDescription> kinds_;
};

/// Makes a FlatScene, one kind of element after the other.
class Compiler {
 public:
  Compiler(const SceneDescription& scene, const FluidMesher& mesher) : scene_(scene), mesher_(mesher) {}

  FlatScene run() {
    const Box3d bounds = bounds_of(scene_);
    flat_.recentring = middle_of(scene_, bounds);
    flat_.bounds.include(local(bounds.low));
    flat_.bounds.include(local(bounds.high));
    radius_ = 0.5 * length(bounds.high - bounds.low);
    flat_.camera = make_camera(scene_.camera, scene_.film.width, scene_.film.height, flat_.recentring);
    add_detail_blocks();
    collect_media();
    for (const PictureDescription& picture : scene_.pictures) flat_.pictures.push_back(picture.image);
    for (const FluidDescription& fluid : scene_.fluids) add(fluid);
    add_balls();
    for (const BoxDescription& box : scene_.boxes) add(box);
    for (const PatchDescription& patch : scene_.patches) add(patch);
    for (const CylinderDescription& cylinder : scene_.cylinders) add(cylinder);
    for (const MeshDescription& mesh : scene_.meshes) add(mesh);
    for (const SplatsDescription& splats : scene_.splats) add(splats);
    finish_solids();
    add_density();
    add_lights();
    flat_.integrator = scene_.integrator;
    if (scene_.integrator.kind == IntegratorKind::gauss)
      flat_.hemisphere_nodes = gauss_hemisphere(*hemisphere_rule_size(gauss_nodes_of(scene_.integrator)));
    flat_.film = scene_.film;
    return std::move(flat_);
  }

 private:
  const SceneDescription& scene_;
  const FluidMesher& mesher_;
  FlatScene flat_;
  MediaClasses classes_;
  double radius_ = 1;                                      // of the scene
  float nearest_detail_ = infinity, farthest_detail_ = 0;  // of the filled detail blocks' points from the camera

  Vec3 local(Vec3d p) const { return to_float(p - flat_.recentring); }

  void collect_media() {
    for (const FluidDescription& fluid : scene_.fluids) classes_.add(fluid.material);
    for (const BallsDescription& balls : scene_.balls) classes_.add(balls.material);
    for (const BoxDescription& box : scene_.boxes) classes_.add(box.material);
    for (const MeshDescription& mesh : scene_.meshes) classes_.add(mesh.material);
    for (const SplatsDescription& splats : scene_.splats) classes_.add(splats.material);
    flat_.media = classes_.sort();
  }

  void add_density() {
    flat_.density = compile_density(scene_, flat_.recentring);
    for (std::size_t i = 0; i < scene_.fluids.size(); ++i)
      if (scene_.fluids[i].medium) flat_.media[classes_.class_of(scene_.fluids[i].material)].fluids |= 1u << i;
    for (std::size_t i = 0; i < scene_.volumes.size(); ++i) flat_.volumes |= 1u << (scene_.fluids.size() + i);
    for (const GridMediumDescription& medium : scene_.grid_media) {
      flat_.grid_media.push_back(compile_grid_medium(medium, flat_.recentring, flat_.bounds));
      flat_.grids.push_back(flat_.grid_media.back().view());
    }
  }

  Instance make_instance(GeometryKind kind, std::size_t geometry, const MaterialDescription& material) {
    Instance instance;
    instance.kind = kind;
    instance.geometry = static_cast<std::uint32_t>(geometry);
    instance.media_class = classes_.class_of(material);
    instance.material = add_material(material, flat_);
    instance.needs_coordinates = flat_.materials[instance.material].needs_coordinates;
    return instance;
  }

  Instance& add_instance(GeometryKind kind, std::size_t geometry, const MaterialDescription& material) {
    return flat_.instances.emplace_back(make_instance(kind, geometry, material));
  }

  /// Places an instance whose geometry was recentred about `center` in its own space.
  void set_placement(Instance& instance, const Placement& placement, Vec3d center) const {
    instance.to_world.x_axis = to_float(placement.x_axis);
    instance.to_world.y_axis = to_float(placement.y_axis);
    instance.to_world.z_axis = to_float(placement.z_axis);
    instance.to_world.origin = local(place(placement, center));
    instance.to_object = inverse_of(instance.to_world);
    instance.identity = instance.to_world == Transform{};
  }

  /// The point of a geometry's own space that becomes its origin.
  Vec3d own_center(const Placement& placement, const Box3d& own) const {
    return is_identity(placement) ? flat_.recentring : 0.5 * (own.low + own.high);
  }

  void add(const FluidDescription& fluid) {
    WettedParticles wetted;
    const bool wets = fluid.container && fluid.wets_container;
    if (wets) wetted = wet_walls(fluid);
    const std::vector<Vec3d>& world = wets ? wetted.positions : fluid.positions;
    const std::vector<float>& radii = wets ? wetted.radii : fluid.radii;

    Box3d own;
    for (const Vec3d& p : world) own.include(p);
    const Vec3d center = own_center(fluid.placement, own);
    std::vector<Vec3> positions;
    positions.reserve(world.size());
    for (const Vec3d& p : world) positions.push_back(to_float(p - center));

    FluidGeometry geometry;
    if (fluid.container) {
      geometry.clipped = true;
      Box3d box = without_contact(*fluid.container, fluid);
      const Vec3d overlap = fluid.wall_overlap * Vec3d{1, 1, 1};
      box = {box.low - overlap, box.high + overlap};
      geometry.clip = {to_float(box.low - center), to_float(box.high - center)};
    }
    if (fluid.method == SurfaceMethod::thesis) {
      flat_.thesis_surfaces.push_back(std::make_unique<ThesisSurface>(positions, radii, fluid.surface));
      geometry.thesis = flat_.thesis_surfaces.back().get();
    } else if (fluid.method == SurfaceMethod::mesh) {
      EMBRUN_CHECK(mesher_);
      flat_.meshes.push_back(add_triangles(mesher_(positions, radii, fluid), {}));
      geometry.mesh = static_cast<std::int32_t>(flat_.meshes.size() - 1);
    } else {
      if (fluid.detail > 0) geometry.levels = add_levels(fluid, positions);
      if (geometry.levels.finest == 0) {
        flat_.surfaces.push_back(build_implicit_surface(positions, radii, fluid.surface));
        geometry.surface = flat_.surfaces.back().view();
      }
    }
    flat_.fluids.push_back(geometry);
    if (flat_.fluids.size() > static_cast<std::size_t>(max_fluids))
      throw Error(fmt::format("{} fluids: at most {} can be told apart", scene_.fluids.size(), max_fluids));

    Instance& instance = add_instance(GeometryKind::fluid, flat_.fluids.size() - 1, fluid.material);
    instance.fluid = static_cast<std::int16_t>(flat_.fluids.size() - 1);
    instance.solid = static_cast<std::int8_t>(instance.fluid);
    set_placement(instance, fluid.placement, center);
    // Crossings are found to 2e-4 of a radius.
    instance.offset = 3e-4f * fluid.surface.radius * static_cast<float>(largest_scale(fluid.placement));
  }

  /// Blocks that hold what is felt of the particles of fluids with levels of detail.
  void add_detail_blocks() {
    Box3 bounds;
    float reach = 0;
    const auto visit = [&](const auto& take) {
      for (const FluidDescription& fluid : scene_.fluids)
        if (fluid.detail > 0)
          for (const Vec3d& p : fluid.positions) take(local(place(fluid.placement, p)));
    };
    visit([&](Vec3 p) { bounds.include(p); });
    if (bounds.empty()) return;
    for (const FluidDescription& fluid : scene_.fluids)
      if (fluid.detail > 0)
        reach = std::max(reach, 4 * rest_spacing(fluid.surface) * static_cast<float>(largest_scale(fluid.placement)));
    const Vec3 extent = bounds.high - bounds.low + Vec3{2 * reach, 2 * reach, 2 * reach};
    const float side = std::max(4 * reach, max_of(extent.x, max_of(extent.y, extent.z)) / 128);
    const CellGrid grid =
        grid_of_cubes(bounds.low - Vec3{reach, reach, reach}, side, 1 + static_cast<int>(extent.x / side),
                      1 + static_cast<int>(extent.y / side), 1 + static_cast<int>(extent.z / side));
    flat_.detail_grid = grid;
    flat_.detail_filled.assign(
        static_cast<std::size_t>(grid.nx) * static_cast<std::size_t>(grid.ny) * static_cast<std::size_t>(grid.nz), 0);
    visit([&](Vec3 p) {
      const auto cell = [&](float v, int count) { return std::clamp(static_cast<int>(v / side), 0, count - 1); };
      const Vec3 low = p - grid.low - Vec3{reach, reach, reach}, high = p - grid.low + Vec3{reach, reach, reach};
      for (int z = cell(low.z, grid.nz); z <= cell(high.z, grid.nz); ++z)
        for (int y = cell(low.y, grid.ny); y <= cell(high.y, grid.ny); ++y)
          for (int x = cell(low.x, grid.nx); x <= cell(high.x, grid.nx); ++x)
            flat_.detail_filled[static_cast<std::size_t>(grid.index(x, y, z))] = 1;
    });
    measure_detail_distances();
  }

  void measure_detail_distances() {
    const CellGrid& grid = flat_.detail_grid;
    for (int z = 0; z < grid.nz; ++z)
      for (int y = 0; y < grid.ny; ++y)
        for (int x = 0; x < grid.nx; ++x) {
          if (flat_.detail_filled[static_cast<std::size_t>(grid.index(x, y, z))] == 0) continue;
          const Vec3 low =
              grid.low + grid.cell * Vec3{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
          const Vec3 high = low + grid.cell, eye = flat_.camera.eye;
          nearest_detail_ = std::min(nearest_detail_, length(max_of(low, min_of(high, eye)) - eye));
          farthest_detail_ = std::max(farthest_detail_, length(max_of(high - eye, eye - low)));
        }
  }

  /// The levels that some ray from the camera may want, and those between: with level 0 left to the caller.
  FluidLevels add_levels(const FluidDescription& fluid, const std::vector<Vec3>& positions) {
    FluidLevels levels;
    levels.footprints = static_cast<float>(fluid.detail / largest_scale(fluid.placement));
    levels.spacing = rest_spacing(fluid.surface);
    levels.first = static_cast<std::uint32_t>(flat_.coarse_surfaces.size());
    const auto level_at = [&](float distance) {
      constexpr int most_levels = 12;
      return surface_level_for(levels.footprints * flat_.camera.pixel_size * distance, levels.spacing, most_levels);
    };
    const int finest = level_at(nearest_detail_), coarsest = level_at(farthest_detail_);
    for (int level = std::max(finest, 1); level <= coarsest; ++level) {
      std::optional<CoarseSurface> surface = build_coarse_surface(positions, fluid.surface, level);
      if (!surface) break;
      if (levels.coarsest == 0) levels.finest = level == 1 && finest == 0 ? 0 : level;
      levels.coarsest = level;
      flat_.coarse_owners.push_back(std::move(*surface));
      flat_.coarse_surfaces.push_back(flat_.coarse_owners.back().view());
    }
    return levels;
  }

  /// A container that stands on a floor reaches a little into it, so that the floor alone is met there, without a film
  /// of air and without two surfaces at one place.
  Box3d without_contact(Box3d box, const FluidDescription& fluid) const {
    if (!is_identity(fluid.placement)) return box;
    const double tolerance = 0.02 * static_cast<double>(fluid.surface.radius);
    for (const PatchDescription& patch : scene_.patches) {
      const Vec3d normal = normalize(cross(patch.axis_u, patch.axis_v));
      const auto press = [&](double component, double along, double& face, double outwards) {
        if (std::abs(component) > 1 - 1e-9 && std::abs(face - along) < tolerance) face = along + outwards * tolerance;
      };
      press(normal.x, patch.center.x, box.low.x, -1);
      press(normal.y, patch.center.y, box.low.y, -1);
      press(normal.z, patch.center.z, box.low.z, -1);
      press(normal.x, patch.center.x, box.high.x, 1);
      press(normal.y, patch.center.y, box.high.y, 1);
      press(normal.z, patch.center.z, box.high.z, 1);
    }
    return box;
  }

  /// A light that is a shape of the scene.
  std::int32_t add_shape_light(Light light) {
    light.in_scene = true;
    return flat_.lights.add(light);
  }

  /// Sets of one material become one.
  void add_balls() {
    std::vector<bool> taken(scene_.balls.size());
    for (std::size_t i = 0; i < scene_.balls.size(); ++i) {
      if (taken[i]) continue;
      std::vector<Ball> balls;
      if (!is_black(scene_.balls[i].radiance)) {
        add_shining(scene_.balls[i]);
        continue;
      }
      for (std::size_t j = i; j < scene_.balls.size(); ++j) {
        if (!looks_alike(scene_.balls[j], scene_.balls[i])) continue;
        taken[j] = true;
        collect(scene_.balls[j], balls);
      }
      if (!balls.empty()) add(balls, scene_.balls[i]);
    }
  }

  static bool looks_alike(const BallsDescription& a, const BallsDescription& b) {
    return a.material == b.material && a.radiance == b.radiance && a.pole == b.pole && a.meridian == b.meridian;
  }

  /// Each ball is a light of its own.
  void add_shining(const BallsDescription& set) {
    BallsDescription alone = set;
    for (const BallDescription& ball : set.balls) {
      alone.balls = {ball};
      std::vector<Ball> balls;
      collect(alone, balls);
      if (balls.empty()) continue;
      add(balls, alone);
      flat_.instances.back().light = add_shape_light(make_sphere_light(balls[0].center, balls[0].radius, set.radiance));
    }
  }

  void collect(const BallsDescription& set, std::vector<Ball>& balls) const {
    for (const BallDescription& description : set.balls) {
      const Ball ball{local(description.center), static_cast<float>(description.radius)};
      // Balls that are small against the rounding of positions on them are as good as none.
      if (ball.radius > 16.0f * ball_offset(ball.center, 0.0f)) balls.push_back(ball);
    }
  }

  void add(const std::vector<Ball>& balls, const BallsDescription& set) {
    const std::vector<BallBlock> blocks = pack_balls(balls);
    BallRange range;
    range.first = static_cast<std::uint32_t>(flat_.ball_blocks.size());
    range.count = static_cast<std::uint32_t>(blocks.size());
    flat_.ball_blocks.insert(flat_.ball_blocks.end(), blocks.begin(), blocks.end());
    double sum = 0;
    for (const Ball& ball : balls) {
      sum += static_cast<double>(ball.radius);
      range.slack = std::max(range.slack, ball_offset({}, ball.radius));
    }
    range.step = static_cast<float>(2 * sum / static_cast<double>(balls.size()));
    flat_.ball_ranges.push_back(range);
    Instance& instance = add_instance(GeometryKind::balls, flat_.ball_ranges.size() - 1, set.material);
    instance.offset = range.slack;
    const Vec3 pole = to_float(normalize(set.pole)), meridian = to_float(normalize(set.meridian));
    instance.to_world = {meridian, cross(pole, meridian), pole, {}};
    instance.to_object = inverse_of(instance.to_world);
  }

  /// Numbers the solids of balls and splats after the fluids, and tells the balls how far rays start off the other surfaces.
  void finish_solids() {
    int solids = static_cast<int>(flat_.fluids.size());
    float slack = 0;
    for (const Instance& instance : flat_.instances) slack = std::max(slack, instance.offset);
    for (Instance& instance : flat_.instances) {
      const bool balls = instance.kind == GeometryKind::balls;
      if (balls) flat_.ball_ranges[instance.geometry].slack = slack;
      // Of a closed cloud the side counts even where it is opaque: the camera may be inside.
      const bool closed = instance.kind == GeometryKind::splats && flat_.splats[instance.geometry].set.closed;
      if (!closed && !(balls && instance.media_class != 0)) continue;
      if (solids == max_solids)
        throw Error(fmt::format("more than {} fluids, sets of transparent balls and closed clouds in all", max_solids));
      instance.solid = static_cast<std::int8_t>(solids++);
    }
  }

  void add(const BoxDescription& box) {
    flat_.boxes.push_back({local(box.box.low), local(box.box.high)});
    add_instance(GeometryKind::box, flat_.boxes.size() - 1, box.material);
  }

  void add(const PatchDescription& description) {
    Patch patch;
    patch.center = local(description.center);
    patch.axis_u = to_float(normalize(description.axis_u));
    patch.axis_v = to_float(normalize(description.axis_v));
    patch.normal = to_float(normalize(cross(description.axis_u, description.axis_v)));
    patch.half_u = static_cast<float>(description.half_u);
    patch.half_v = static_cast<float>(description.half_v);
    patch.round = description.round;
    patch.v_reversed = description.v_reversed;
    flat_.patches.push_back(patch);
    Instance& instance = add_instance(GeometryKind::patch, flat_.patches.size() - 1, description.material);
    if (is_black(description.radiance)) return;
    const Vec3 u = patch.axis_u * patch.half_u, v = patch.axis_v * patch.half_v;
    instance.light = add_shape_light(
        patch.round ? make_disk_light(patch.center, patch.normal, patch.half_u, description.radiance)
                    : make_rectangle_light(patch.center - u - v, 2.0f * u, 2.0f * v, description.radiance));
  }

  void add(const CylinderDescription& description) {
    const Vec3d axis = description.end - description.start;
    const Vec3 along = to_float(normalize(axis)), meridian = to_float(description.meridian);
    flat_.cylinders.push_back({local(description.start), along, static_cast<float>(length(axis)),
                               static_cast<float>(description.radius),
                               meridian == Vec3{} ? Frame(along).s : normalize(meridian), description.u_reversed});
    Instance& instance = add_instance(GeometryKind::cylinder, flat_.cylinders.size() - 1, description.material);
    if (!is_black(description.radiance))
      instance.light = add_shape_light(make_cylinder_light(
          local(description.start), to_float(axis), static_cast<float>(description.radius), description.radiance));
  }

  void add(const SplatsDescription& description) {
    Vec3d center;
    if (description.hierarchy != nullptr) {
      center = description.hierarchy->center;
      flat_.splats.push_back(splat_geometry(*description.hierarchy, static_cast<float>(description.detail)));
      flat_.splat_files.push_back(description.hierarchy);
    } else {
      Box3d own;
      for (const Vec3d& p : description.centers) own.include(p);
      center = own_center(description.placement, own);
      flat_.splat_arrays.push_back(compile_splat_arrays(description, center));
      flat_.splats.push_back(splat_geometry(flat_.splat_arrays.back(), description.closed, description.surface));
    }
    Instance& instance = add_instance(GeometryKind::splats, flat_.splats.size() - 1, description.material);
    constexpr std::size_t most = 32000;  // by 16 bits
    if (flat_.splats.size() > most) throw Error(fmt::format("more than {} clouds of splats", most));
    instance.splats = static_cast<std::int16_t>(flat_.splats.size() - 1);
    set_placement(instance, description.placement, center);
    // Next to what rounding does to a crossing that is much; the splats near by are told apart by splat_start.h.
    instance.offset = 1e-3f * median_radius(description) * static_cast<float>(largest_scale(description.placement));
  }

  void add(const MeshDescription& description) {
    const TriangleMesh& mesh = description.mesh;
    Box3d own;
    for (const Vec3& p : mesh.positions) own.include(to_double(p));
    const std::span<const Placement> placements = placements_of(description);
    // Copies cannot all be where the world's coordinates are the mesh's own.
    const Vec3d center = placements.size() == 1 ? own_center(placements.front(), own) : 0.5 * (own.low + own.high);

    const MeshRange range = add_triangles(mesh, center);
    flat_.meshes.push_back(range);
    const Instance shared = make_instance(GeometryKind::mesh, flat_.meshes.size() - 1, description.material);
    for (const Placement& placement : placements) {
      Instance& instance = flat_.instances.emplace_back(shared);
      set_placement(instance, placement, center);
      if (!is_black(description.radiance)) instance.light = add_emitter(range, instance.to_world, description.radiance);
    }
  }

  /// Appends a mesh to the arrays, its positions made relative to `center`.
  MeshRange add_triangles(const TriangleMesh& mesh, Vec3d center) {
    MeshRange range;
    range.first_position = static_cast<std::uint32_t>(flat_.mesh_positions.size());
    range.position_count = static_cast<std::uint32_t>(mesh.positions.size());
    range.first_triangle = static_cast<std::uint32_t>(flat_.mesh_triangles.size());
    range.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
    range.smooth = !mesh.normals.empty();
    range.has_coordinates = !mesh.coordinates.empty();
    for (const Vec3& p : mesh.positions) flat_.mesh_positions.push_back(to_float(to_double(p) - center));
    flat_.mesh_normals.resize(flat_.mesh_positions.size());
    std::copy(mesh.normals.begin(), mesh.normals.end(), flat_.mesh_normals.begin() + range.first_position);
    if (range.has_coordinates) flat_.mesh_coordinates.resize(flat_.mesh_positions.size());
    std::copy(mesh.coordinates.begin(), mesh.coordinates.end(), flat_.mesh_coordinates.begin() + range.first_position);
    for (const auto& t : mesh.triangles)
      flat_.mesh_triangles.push_back(
          {range.first_position + t[0], range.first_position + t[1], range.first_position + t[2]});
    return range;
  }

  std::int32_t add_emitter(const MeshRange& range, const Transform& to_world, Rgb radiance) {
    std::vector<LightTriangle> triangles;
    for (std::uint32_t i = 0; i < range.triangle_count; ++i) {
      MeshTriangle t = flat_.mesh_triangles[range.first_triangle + i];
      // A mirror turns the corners round, but not the normal.
      if (determinant(to_world) < 0) std::swap(t.b, t.c);
      const Vec3 a = to_world.point(flat_.mesh_positions[t.a]);
      triangles.push_back(
          {a, to_world.point(flat_.mesh_positions[t.b]) - a, to_world.point(flat_.mesh_positions[t.c]) - a});
    }
    return flat_.lights.add_triangles(triangles, radiance);
  }

  void add_lights() {
    for (const LightDescription& light : scene_.lights) flat_.lights.add(make_light(light));
    add_environment();
    // Light from infinity counts over the scene's disk; a scene that is a point has a disk too.
    flat_.lights.finish(static_cast<float>(std::max(radius_, 1e-6)));
  }

  Light make_light(const LightDescription& light) const {
    using Kind = LightDescription::Kind;
    switch (light.kind) {
      case Kind::rectangle: break;
      case Kind::disk:
        return make_disk_light(local(light.position), to_float(light.normal), static_cast<float>(light.radius),
                               light.radiance, light.two_sided);
      case Kind::sphere:
        return make_sphere_light(local(light.position), static_cast<float>(light.radius), light.radiance);
      case Kind::point: return make_point_light(local(light.position), light.radiance);
      case Kind::directional: return make_directional_light(to_float(light.normal), light.radiance);
      case Kind::distant:
        return make_distant_light(to_float(light.normal), static_cast<float>(light.half_angle * (M_PI / 180)),
                                  light.radiance);
    }
    return make_rectangle_light(local(light.position), to_float(light.edge_u), to_float(light.edge_v), light.radiance,
                                light.two_sided);
  }

  /// The picture of a sky is too coarse for a small sun, which becomes a light of its own.
  void add_sky(const EnvironmentDescription& environment) {
    SkySettings sky = environment.sky;
    const bool apart = sky.sun_irradiance > 0 && sky.sun_diameter < smallest_soft_sun;
    flat_.environment = make_sky(sky, 768, 384, !apart);
    if (!apart) return;
    sky.sun_azimuth += static_cast<float>(environment.turn);
    flat_.lights.add(make_distant_light(sun_direction(sky, scene_.up),
                                        0.5f * sky.sun_diameter * static_cast<float>(M_PI / 180),
                                        sun_radiance(environment.sky)));
  }

  static std::vector<float> scaled_pixels(const EnvironmentDescription& environment) {
    std::vector<float> pixels = environment.image.pixels;
    for (float& v : pixels) v *= static_cast<float>(environment.scale);
    return pixels;
  }

  void add_environment() {
    using Kind = EnvironmentDescription::Kind;
    const EnvironmentDescription& environment = scene_.environment;
    switch (environment.kind) {
      case Kind::none: return;
      case Kind::constant: flat_.lights.set_constant_environment(environment.constant); return;
      case Kind::sky: add_sky(environment); break;
      case Kind::studio: flat_.environment = make_studio(); break;
      case Kind::image:
        if (environment.image.channels != 3) throw Error("environment: the picture must have 3 channels");
        flat_.environment =
            EnvironmentImage(environment.image.width, environment.image.height, scaled_pixels(environment));
        break;
    }
    flat_.lights.set_environment(flat_.environment, scene_.up, static_cast<float>(environment.turn / 360));
  }
};

}  // namespace

SceneView FlatScene::view() const {
  SceneView v;
  v.instances = instances.data();
  v.instance_count = static_cast<int>(instances.size());
  v.fluids = fluids.data();
  v.coarse_surfaces = coarse_surfaces.data();
  v.ball_ranges = ball_ranges.data();
  v.ball_blocks = ball_blocks.data();
  v.splats = splats.data();
  v.boxes = boxes.data();
  v.patches = patches.data();
  v.cylinders = cylinders.data();
  v.meshes = meshes.data();
  v.mesh_positions = mesh_positions.data();
  v.mesh_normals = mesh_normals.data();
  v.mesh_coordinates = mesh_coordinates.data();
  v.mesh_triangles = mesh_triangles.data();
  v.materials = materials.data();
  return v;
}

FlatScene compile(const SceneDescription& scene, const FluidMesher& mesher) {
  validate(scene);
  return Compiler(scene, mesher).run();
}

}  // namespace embrun
