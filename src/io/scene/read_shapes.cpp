#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/read_mesh.h"
#include "io/scene/reading.h"
#include "io/text.h"

namespace embrun {
namespace {

constexpr std::size_t most_shapes = 1'000'000;

/// The shape's own transform, and what it stands in.
Placement take_placement(SceneObject& shape, const Placement& outer) {
  return compose(outer, shape.placement("to_world"));
}

/// How much a transform enlarges everything; an error where that depends on the direction.
double uniform_scale(SceneObject& shape, const Placement& m) {
  const double x = length(m.x_axis), tolerance = 1e-5 * x * x;
  const bool uniform = x > 0 && std::abs(length(m.y_axis) - x) <= 1e-5 * x &&
                       std::abs(length(m.z_axis) - x) <= 1e-5 * x && std::abs(dot(m.x_axis, m.y_axis)) <= tolerance &&
                       std::abs(dot(m.y_axis, m.z_axis)) <= tolerance && std::abs(dot(m.z_axis, m.x_axis)) <= tolerance;
  if (!uniform) shape.fail("its transform scales it unevenly, which is not supported: use a mesh");
  return x;
}

void refuse_flip(SceneObject& shape) {
  if (shape.flag("flip_normals").value_or(false)) shape.fail("'flip_normals' is not supported here: use a mesh");
}

/// Whether it matters how a shape is turned.
bool shows_pictures(const MaterialDescription& material) {
  const auto has_coordinates = [](const TextureDescription& t) {
    return t.kind == TextureKind::uv_checker || t.kind == TextureKind::bitmap;
  };
  return has_coordinates(material.reflectance) || has_coordinates(material.roughness) || material.roughness_v ||
         std::any_of(material.back.begin(), material.back.end(), shows_pictures);
}

// ---- flat and round shapes ---------------------------------------------------------------------------------------

void read_sphere(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  const Placement m = take_placement(shape, outer);
  BallDescription ball;
  ball.center = place(m, shape.vector("center").value_or(Vec3d{}));
  ball.radius = shape.number("radius", 1) * uniform_scale(shape, m);
  if (!(ball.radius > 0)) shape.fail(fmt::format("its radius {} is not positive", ball.radius));
  refuse_flip(shape);
  BallsDescription set;
  set.material = take_material(reading, shape);
  set.radiance = take_emission(reading, shape);
  set.pole = shape.vector("pole").value_or(set.pole);
  set.meridian = shape.vector("meridian").value_or(set.meridian);
  if (shows_pictures(set.material) && shape.has("to_world")) {
    set.pole = m.z_axis;
    set.meridian = m.x_axis;
  }
  shape.finish();
  // Spheres of one material that follow each other are one set.
  std::vector<BallsDescription>& sets = reading.result.scene.balls;
  const auto alike = [&](const BallsDescription& other) {
    return other.material == set.material && other.radiance == set.radiance && other.pole == set.pole &&
           other.meridian == set.meridian;
  };
  if (sets.empty() || !alike(sets.back())) sets.push_back(set);
  sets.back().balls.push_back(ball);
}

/// The plane spanned by the first two axes of a transform, which takes +z to its normal.
PatchDescription patch_of(SceneObject& shape, const Placement& m) {
  PatchDescription patch;
  patch.center = m.origin;
  patch.axis_u = m.x_axis;
  // A mirror turns the plane's own axes into a left-handed pair; the normal has to stay on its side.
  patch.v_reversed = determinant(m) < 0;
  patch.axis_v = patch.v_reversed ? -1.0 * m.y_axis : m.y_axis;
  patch.half_u = length(m.x_axis);
  patch.half_v = length(m.y_axis);
  if (!(patch.half_u > 0 && patch.half_v > 0)) shape.fail("its transform flattens it");
  if (std::abs(dot(m.x_axis, m.y_axis)) > 1e-6 * patch.half_u * patch.half_v)
    shape.fail("its transform shears it, which is not supported: use a mesh");
  return patch;
}

void finish_patch(SceneReading& reading, SceneObject& shape, PatchDescription patch) {
  if (shape.flag("flip_normals").value_or(false)) {
    patch.axis_v = -1.0 * patch.axis_v;
    patch.v_reversed = !patch.v_reversed;
  }
  patch.material = take_material(reading, shape);
  patch.radiance = take_emission(reading, shape);
  if (has_inside(patch.material)) shape.fail("it has no inside for its material: light could not get out again");
  shape.finish();
  reading.result.scene.patches.push_back(std::move(patch));
}

void read_rectangle(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  finish_patch(reading, shape, patch_of(shape, take_placement(shape, outer)));
}

void read_disk(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  const Placement m = take_placement(shape, outer);
  uniform_scale(shape, m);
  PatchDescription patch = patch_of(shape, m);
  patch.round = true;
  patch.half_v = patch.half_u;
  finish_patch(reading, shape, std::move(patch));
}

/// Embrun's own: a rectangle or disk by its centre, axes and half sides, which may be infinite.
void read_patch(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  PatchDescription patch;
  if (!(outer == Placement{})) shape.fail("a patch cannot be part of a shapegroup: use a rectangle");
  patch.center = shape.vector("center").value_or(Vec3d{});
  patch.axis_u = shape.vector("axis_u").value_or(patch.axis_u);
  patch.axis_v = shape.vector("axis_v").value_or(patch.axis_v);
  patch.half_u = shape.number("half_u", static_cast<double>(infinity));
  patch.half_v = shape.number("half_v", static_cast<double>(infinity));
  patch.round = shape.flag("round").value_or(false);
  patch.v_reversed = shape.flag("v_reversed").value_or(false);
  finish_patch(reading, shape, std::move(patch));
}

void read_cylinder(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  const Placement m = take_placement(shape, outer);
  CylinderDescription cylinder;
  const Vec3d p0 = shape.vector("p0").value_or(Vec3d{}), p1 = shape.vector("p1").value_or(Vec3d{0, 0, 1});
  cylinder.start = place(m, p0);
  cylinder.end = place(m, p1);
  cylinder.radius = shape.number("radius", 1) * uniform_scale(shape, m);
  refuse_flip(shape);
  cylinder.material = take_material(reading, shape);
  cylinder.radiance = take_emission(reading, shape);
  cylinder.meridian = shape.vector("meridian").value_or(cylinder.meridian);
  cylinder.u_reversed = shape.flag("u_reversed").value_or(false);
  if (shows_pictures(cylinder.material) && !(m == Placement{}) && length(p1 - p0) > 0) {
    // Mitsuba's u begins at the first axis of the frame that it makes of the axis before the transform.
    cylinder.meridian = place_vector(m, to_double(Frame(to_float(normalize(p1 - p0))).s));
    cylinder.u_reversed = determinant(m) < 0;
  }
  if (has_inside(cylinder.material)) shape.fail("a cylinder is open at its ends: it has no inside for its material");
  shape.finish();
  reading.result.scene.cylinders.push_back(std::move(cylinder));
}

// ---- meshes ------------------------------------------------------------------------------------------------------

void flip(TriangleMesh& mesh) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  for (Vec3& normal : mesh.normals) normal = -normal;
}

/// [-1, 1]^3, flat.
TriangleMesh cube_mesh() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions.push_back({i & 1 ? 1.0f : -1.0f, i & 2 ? 1.0f : -1.0f, i & 4 ? 1.0f : -1.0f});
  mesh.triangles = {{{0, 4, 6}}, {{0, 6, 2}}, {{1, 3, 7}}, {{1, 7, 5}}, {{0, 1, 5}}, {{0, 5, 4}},
                    {{2, 6, 7}}, {{2, 7, 3}}, {{0, 2, 3}}, {{0, 3, 1}}, {{4, 5, 7}}, {{4, 7, 6}}};
  return mesh;
}

/// The same with Mitsuba's texture coordinates: [0, 1] x [0, 1] on each face.
TriangleMesh cube_mesh_with_coordinates() {
  // The axes of u and v on the faces -x, +x, -y, +y, -z, +z; negative ones run backwards, counted from 1.
  constexpr int u_axes[6] = {2, 2, 3, -1, -2, 2}, v_axes[6] = {3, -3, 1, -3, 1, 1};
  TriangleMesh mesh;
  for (int face = 0; face < 6; ++face) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec2 uv : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
      Vec3 p;
      p[face / 2] = face % 2 == 0 ? -1.0f : 1.0f;
      for (const auto& [axis, value] : {std::pair{u_axes[face], uv.x}, std::pair{v_axes[face], uv.y}})
        p[std::abs(axis) - 1] = (axis < 0 ? -1.0f : 1.0f) * (2 * value - 1);
      mesh.positions.push_back(p);
      mesh.coordinates.push_back(uv);
    }
    // u to v turns inwards.
    mesh.triangles.push_back({first, first + 2, first + 1});
    mesh.triangles.push_back({first, first + 3, first + 2});
  }
  return mesh;
}

/// The box that the transform makes of [-1, 1]^3, if its sides stay along the axes.
std::optional<Box3d> axis_aligned(const Placement& m) {
  Vec3d half{};
  for (const Vec3d axis : {m.x_axis, m.y_axis, m.z_axis}) {
    const int along = (axis.x != 0) + (axis.y != 0) + (axis.z != 0);
    if (along != 1) return std::nullopt;
    half = half + Vec3d{std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)};
  }
  if (!(half.x > 0 && half.y > 0 && half.z > 0)) return std::nullopt;
  return Box3d{m.origin - half, m.origin + half};
}

void read_cube(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  const Placement m = take_placement(shape, outer);
  const bool flipped = shape.flag("flip_normals").value_or(false);
  const MaterialDescription material = take_material(reading, shape);
  const Rgb radiance = take_emission(reading, shape);
  shape.finish();
  if (const std::optional<Box3d> box = axis_aligned(m); box && is_black(radiance) && !flipped) {
    reading.result.scene.boxes.push_back({*box, material});
    return;
  }
  MeshDescription mesh;
  mesh.mesh = shows_pictures(material) ? cube_mesh_with_coordinates() : cube_mesh();
  if (flipped) flip(mesh.mesh);
  mesh.placement = m;
  mesh.material = material;
  mesh.radiance = radiance;
  reading.result.scene.meshes.push_back(std::move(mesh));
}

/// Embrun's own: a box by two corners.
void read_box(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  if (!(outer == Placement{})) shape.fail("a box cannot be part of a shapegroup: use a cube");
  BoxDescription box;
  box.box.low = shape.vector("low").value_or(Vec3d{-1, -1, -1});
  box.box.high = shape.vector("high").value_or(Vec3d{1, 1, 1});
  box.material = take_material(reading, shape);
  shape.finish();
  reading.result.scene.boxes.push_back(std::move(box));
}

const TriangleMesh& mesh_of_file(SceneReading& reading, const std::string& path) {
  if (const auto known = reading.meshes.find(path); known != reading.meshes.end()) return known->second;
  const std::vector<std::byte> bytes = reading.read_bytes(path);
  return reading.meshes.emplace(path, read_mesh_from_memory(bytes, path)).first->second;
}

/// Embrun's own: a mesh by its numbers.
TriangleMesh mesh_in_place(SceneObject& shape) {
  const XmlTree& tree = shape.tree();
  const auto numbers = [&](const char* name) {
    const std::optional<std::string> text = shape.text(name);
    return text ? parse_numbers(tree, shape.element(), name, *text) : std::vector<double>{};
  };
  const auto vectors = [&](const char* name) {
    const std::vector<double> v = numbers(name);
    if (v.size() % 3 != 0) shape.fail(fmt::format("'{}' has {} numbers, which are not triples", name, v.size()));
    std::vector<Vec3> result;
    for (std::size_t i = 0; i < v.size(); i += 3) result.push_back(to_float(Vec3d{v[i], v[i + 1], v[i + 2]}));
    return result;
  };
  TriangleMesh mesh;
  mesh.positions = vectors("positions");
  mesh.normals = vectors("normals");
  const std::vector<double> coordinates = numbers("coordinates");
  if (!coordinates.empty() && coordinates.size() != 2 * mesh.positions.size())
    shape.fail(fmt::format("'coordinates' has {} numbers for {} positions", coordinates.size(), mesh.positions.size()));
  for (std::size_t i = 0; i + 1 < coordinates.size(); i += 2)
    mesh.coordinates.push_back({static_cast<float>(coordinates[i]), static_cast<float>(coordinates[i + 1])});
  const std::vector<double> corners = numbers("triangles");
  if (corners.empty() || corners.size() % 3 != 0)
    shape.fail("'triangles' has to name three positions of each triangle");
  for (std::size_t i = 0; i < corners.size(); i += 3) {
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t k = 0; k < 3; ++k) {
      const double index = corners[i + k];
      if (index != std::floor(index) || !(index >= 0 && index < static_cast<double>(mesh.positions.size())))
        shape.fail(fmt::format("'triangles' names position {} of {}", index, mesh.positions.size()));
      triangle[k] = static_cast<std::uint32_t>(index);
    }
    mesh.triangles.push_back(triangle);
  }
  if (!mesh.normals.empty() && mesh.normals.size() != mesh.positions.size())
    shape.fail(fmt::format("{} normals for {} positions", mesh.normals.size(), mesh.positions.size()));
  return mesh;
}

void read_mesh_shape(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  MeshDescription mesh;
  if (shape.type() == "mesh") {
    mesh.mesh = mesh_in_place(shape);
  } else {
    const std::optional<std::string> name = shape.text("filename");
    if (!name) shape.fail("'filename' is missing");
    mesh.file = reading.path_of(shape, *name);
    mesh.mesh = mesh_of_file(reading, mesh.file);
  }
  if (shape.flag("face_normals").value_or(false)) {
    mesh.mesh.normals.clear();
    mesh.face_normals = true;
  }
  // An OBJ's coordinates are read as Mitsuba turns them unless told not to.
  const bool turned_already = shape.type() == "obj";
  mesh.coordinates_flipped = shape.flag("flip_tex_coords").value_or(turned_already) != turned_already;
  if (mesh.coordinates_flipped)
    for (Vec2& c : mesh.mesh.coordinates) c.y = 1 - c.y;
  mesh.flipped = shape.flag("flip_normals").value_or(false);
  if (mesh.flipped) flip(mesh.mesh);
  mesh.placement = take_placement(shape, outer);
  mesh.material = take_material(reading, shape);
  mesh.radiance = take_emission(reading, shape);
  shape.finish();
  reading.result.scene.meshes.push_back(std::move(mesh));
}

}  // namespace

void read_shape(SceneReading& reading, const XmlElement& element, const Placement& outer) {
  SceneObject shape = reading.object(element);
  if (++reading.shapes > most_shapes) shape.fail(fmt::format("there are more than {} shapes", most_shapes));
  using Reader = void (*)(SceneReading&, SceneObject&, const Placement&);
  struct Kind {
    std::string_view type;
    Reader read;
  };
  constexpr Kind kinds[] = {{"ply", read_mesh_shape},
                            {"obj", read_mesh_shape},
                            {"mesh", read_mesh_shape},
                            {"sphere", read_sphere},
                            {"rectangle", read_rectangle},
                            {"cube", read_cube},
                            {"disk", read_disk},
                            {"cylinder", read_cylinder},
                            {"instance", read_instance},
                            {"patch", read_patch},
                            {"box", read_box},
                            {"particles", read_particles_shape},
                            {"splats", read_splats_shape}};
  if (shape.type() == "shapegroup") return;  // stands nowhere by itself
  for (const Kind& kind : kinds) {
    if (shape.type() != kind.type) continue;
    kind.read(reading, shape, outer);
    return;
  }
  shape.fail(
      "this shape is not supported: there are ply, obj, sphere, rectangle, cube, disk, cylinder, shapegroup, instance, "
      "and Embrun's particles, splats, patch, box, mesh");
}

void read_instance(SceneReading& reading, SceneObject& shape, const Placement& outer) {
  const Placement m = take_placement(shape, outer);
  const XmlElement* element = shape.take({"ref", "shape"});
  if (element == nullptr) shape.fail("it names no shapegroup");
  const XmlElement& target = reading.resolve(*element);
  if (target.tag != "shape" || target.get("type") != "shapegroup") shape.fail("what it refers to is no shapegroup");
  shape.finish();
  SceneObject group = reading.object(target);
  SceneReading::Group& made = reading.groups[&target];
  SceneDescription& scene = reading.result.scene;
  std::size_t index = 0;
  while (const XmlElement* child = group.take({"shape"})) {
    const std::string type = child->get("type");
    if (type == "instance" || type == "shapegroup")
      group.fail(fmt::format("a shapegroup cannot hold a shape of type {}", type));
    // A mesh is made once; further instances are copies of it.
    const bool is_mesh = type == "ply" || type == "obj" || type == "mesh";
    if (made.meshes.size() <= index) made.meshes.push_back({});
    SceneReading::Group::Mesh& mesh = made.meshes[index++];
    if (is_mesh && mesh.known) {
      if (++reading.shapes > most_shapes) shape.fail(fmt::format("there are more than {} shapes", most_shapes));
      MeshDescription& first = scene.meshes[mesh.index];
      if (first.copies.empty()) first.copies.push_back(first.placement);
      first.copies.push_back(compose(m, mesh.own));
      continue;
    }
    read_shape(reading, *child, m);
    if (!is_mesh) continue;
    SceneObject own = reading.object(*child);
    mesh = {true, scene.meshes.size() - 1, own.placement("to_world")};
  }
  group.finish();
}

}  // namespace embrun
