#include "io/read_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <unordered_set>

#include "base/error.h"
#include "io/cursor.h"
#include "io/file_bytes.h"
#include "io/scene/indices.h"
#include "io/scene/number_in_order.h"
#include "io/scene/reading.h"
#include "io/text.h"

namespace embrun {
namespace {

constexpr int longest_chain_of_references = 32;

/// Notes the ids of the elements, and the indices of the dielectrics among them.
void note_ids(SceneReading& reading, const XmlElement& element) {
  const std::string id = element.get("id");
  const bool names = element.tag == "ref";  // of another
  if (!id.empty() && !names && !reading.ids.emplace(id, &element).second)
    reading.tree.fail(element, element.tag, fmt::format("the id {} is given twice", quoted(id)));
  if (element.tag == "bsdf" && bounds_inside(element.get("type"))) {
    std::vector<std::string> warned_later;
    SceneObject bsdf(reading.tree, element, warned_later);
    const IndexPair indices = read_indices(bsdf);
    reading.priorities.add(indices.interior, indices.exterior);
  }
  for (const XmlElement& child : element.children) note_ids(reading, child);
}

MediaOverlap overlap_from(SceneObject& scene) {
  const std::string name = scene.text("overlap").value_or("sum");
  if (name != "min" && name != "max" && name != "sum")
    scene.fail(fmt::format("'overlap' is {}: there are min, max, sum", quoted(name)));
  return name == "min" ? MediaOverlap::min : name == "max" ? MediaOverlap::max : MediaOverlap::sum;
}

void read_elements(SceneReading& reading) {
  SceneObject scene = reading.object(reading.tree.root);
  SceneDescription& description = reading.result.scene;
  description.environment.kind = EnvironmentDescription::Kind::none;
  const std::string up = scene.text("up").value_or("y");
  if (up != "y" && up != "z") scene.fail(fmt::format("'up' is {}: there are y, z", quoted(up)));
  description.up = up == "z" ? UpAxis::z : UpAxis::y;
  description.overlap = overlap_from(scene);

  const auto each = [&](std::string_view tag, auto&& read, int most) {
    int count = 0;
    while (const XmlElement* element = scene.take({tag})) {
      if (++count > most) reading.tree.fail(*element, element->tag, "there can be one only");
      read(*element);
    }
    return count;
  };
  constexpr int any = 1 << 30;
  each(
      "integrator", [&](const XmlElement& e) { read_integrator(reading, e); }, 1);
  const int sensors = each(
      "sensor", [&](const XmlElement& e) { read_sensor(reading, e); }, 1);
  if (sensors == 0) scene.fail("it has no <sensor>");
  each(
      "emitter", [&](const XmlElement& e) { read_emitter(reading, e); }, any);
  each(
      "shape", [&](const XmlElement& e) { read_shape(reading, e, {}); }, any);
  // What others refer to, or nobody, is still to be right.
  each(
      "bsdf", [&](const XmlElement& e) { read_material(reading, e); }, any);
  for (const std::string_view tag : {"texture", "medium", "volume", "phase", "rfilter", "film", "sampler"})
    each(
        tag,
        [&](const XmlElement& e) {
          if (e.find("id") == nullptr)
            reading.tree.fail(e, e.tag, "it belongs to nothing, and has no id to refer to it by");
          if (tag == "medium") read_interior(reading, e);
        },
        any);
  scene.finish();
  number_in_order(description);
}

}  // namespace

SceneReading::SceneReading(const XmlTree& whole, const ReadFileBytes& files, SceneFile& file)
    : tree(whole), read_bytes(files), result(file) {
  // Particles are water in air if nothing else is said.
  priorities.add(1.33, 1);
  note_ids(*this, tree.root);
  priorities.settle();
}

const XmlElement& SceneReading::resolve(const XmlElement& element) const {
  const XmlElement* target = &element;
  for (int i = 0; target->tag == "ref"; ++i) {
    const std::string id = target->get("id");
    const auto known = ids.find(id);
    if (known == ids.end()) tree.fail(element, "ref", fmt::format("nothing has the id {}", quoted(id)));
    if (i > longest_chain_of_references) tree.fail(element, "ref", fmt::format("{} refers to itself", quoted(id)));
    target = known->second;
  }
  return *target;
}

const XmlElement* SceneReading::take(SceneObject& object, std::string_view tag) const {
  const XmlElement* taken = object.take(
      [&](const XmlElement& child) { return child.tag == tag || (child.tag == "ref" && resolve(child).tag == tag); });
  return taken != nullptr ? &resolve(*taken) : nullptr;
}

SceneFile read_scene(const std::string& path, const std::vector<SceneParameter>& parameters,
                     const ReadFileBytes& read_bytes) {
  try {
    const XmlTree tree = load_xml_tree(path, parameters, read_bytes);
    SceneFile file;
    SceneReading reading(tree, read_bytes, file);
    read_elements(reading);
    // What several elements refer to warns once.
    std::unordered_set<std::string> seen;
    std::erase_if(file.warnings, [&](const std::string& w) { return !seen.insert(w).second; });
    return file;
  } catch (const std::bad_alloc&) {
    fail_in_file(path, "", "", "there is not enough memory for it");
  }
}

SceneFile read_scene(const std::string& path, const std::vector<SceneParameter>& parameters) {
  return read_scene(path, parameters, [](const std::string& name) { return read_file_bytes(name); });
}

}  // namespace embrun
