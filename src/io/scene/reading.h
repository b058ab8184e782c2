#pragma once

#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "io/read_scene.h"
#include "io/scene/body_priorities.h"
#include "io/scene/object.h"

namespace embrun {

/// What the interior <medium> of a shape makes of its inside.
struct Interior {
  Rgb absorption, scattering;  ///< the same everywhere, per metre
  PhaseFunction phase;         ///< of `scattering`
  int grid_medium = -1;        ///< what is there besides
};

/// What the readers of a scene's parts share.
struct SceneReading {
  SceneReading(const XmlTree& whole, const ReadFileBytes& files, SceneFile& file);

  const XmlTree& tree;
  const ReadFileBytes& read_bytes;
  SceneFile& result;
  BodyPriorities priorities;
  std::unordered_map<std::string, const XmlElement*> ids;
  std::map<const XmlElement*, MaterialDescription> materials;  ///< those read so far
  std::map<const XmlElement*, Interior> interiors;             ///< by <medium>
  std::map<std::string, TriangleMesh> meshes;                  ///< by path
  std::size_t shapes = 0;
  int material_depth = 0;

  /// A shapegroup that has stood somewhere: which meshes of the scene its shapes became, in their order.
  struct Group {
    struct Mesh {
      bool known = false;
      std::size_t index = 0;
      Placement own;  ///< of the shape in the group
    };
    std::vector<Mesh> meshes;
  };
  std::map<const XmlElement*, Group> groups;

  SceneObject object(const XmlElement& element) { return {tree, element, result.warnings}; }
  /// The element that a <ref> stands for; any other stands for itself.
  const XmlElement& resolve(const XmlElement& element) const;
  /// The next <tag> in the object that nobody asked for yet, or the one that a <ref> in it stands for; or null.
  const XmlElement* take(SceneObject& object, std::string_view tag) const;
  /// The path that a property of the object names.
  std::string path_of(const SceneObject& object, const std::string& name) const {
    return tree.resolve_path(object.element(), name);
  }
};

/// A property of a <bsdf> that is a colour or a <texture>.
TextureDescription read_texture(SceneReading& reading, SceneObject& bsdf, std::string_view name, Rgb fallback);
/// A <bsdf>, or a <ref> to one.
MaterialDescription read_material(SceneReading& reading, const XmlElement& element);
/// The material of a shape: its <bsdf>, or `fallback` (else a diffuse grey), and its interior <medium>.
MaterialDescription take_material(SceneReading& reading, SceneObject& shape);
MaterialDescription take_material(SceneReading& reading, SceneObject& shape, const MaterialDescription& fallback);

/// The radiance of the area <emitter> in a shape; black where there is none.
Rgb take_emission(SceneReading& reading, SceneObject& shape);

/// The <phase> in a medium; isotropic where there is none.
PhaseFunction take_phase(SceneReading& reading, SceneObject& medium);
/// A <medium>, which several shapes may have; read once.
const Interior& read_interior(SceneReading& reading, const XmlElement& element);
/// Fills in what a shape's interior <medium>, or null, does to light.
void fill_inside(SceneReading& reading, SceneObject& shape, const XmlElement* medium, MaterialDescription& material);

/// A <shape>, placed by `outer` after its own transform.
void read_shape(SceneReading& reading, const XmlElement& element, const Placement& outer);
/// <shape type="particles">
void read_particles_shape(SceneReading& reading, SceneObject& shape, const Placement& outer);
/// <shape type="splats">
void read_splats_shape(SceneReading& reading, SceneObject& shape, const Placement& outer);
/// <shape type="instance">: the shapes of a group in another place.
void read_instance(SceneReading& reading, SceneObject& shape, const Placement& outer);

void read_emitter(SceneReading& reading, const XmlElement& element);
void read_sensor(SceneReading& reading, const XmlElement& element);
void read_integrator(SceneReading& reading, const XmlElement& element);

}  // namespace embrun
