#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/scene/values.h"

namespace embrun {

/// An object of a scene file (<shape>, <bsdf>, ...): its properties and the objects in it, each of which has to be asked
/// for. Asking marks it as understood; finish() refuses what nobody asked for. All throw located Errors.
class SceneObject {
 public:
  /// `warnings` receives what is read and has no effect. The tree must outlive the object.
  SceneObject(const XmlTree& tree, const XmlElement& element, std::vector<std::string>& warnings);

  const XmlElement& element() const { return element_; }
  const XmlTree& tree() const { return tree_; }
  const std::string& type() const { return type_; }
  /// 'shape "sphere"'
  std::string title() const;
  [[noreturn]] void fail(std::string_view message) const { tree_.fail(element_, title(), message); }
  void warn(std::string_view message) const { warnings_.push_back(tree_.located(element_, title(), message)); }

  // Properties by name; those of another kind are an error.
  bool has(std::string_view name) const;
  std::optional<double> number(std::string_view name);
  double number(std::string_view name, double fallback) { return number(name).value_or(fallback); }
  /// A whole number in [low, high].
  std::optional<int> integer(std::string_view name, int low, int high);
  std::optional<bool> flag(std::string_view name);
  std::optional<std::string> text(std::string_view name);
  std::optional<Vec3d> vector(std::string_view name);
  /// <rgb>, <spectrum> or <float>; `of_light` says how a spectrum is taken (see read_spectrum).
  std::optional<Rgb> color(std::string_view name, bool of_light = false);
  /// The <transform> of that name, or null.
  const XmlElement* transform(std::string_view name);
  Placement placement(std::string_view name);
  /// The property of that name whatever it is, or null; the kinds of it that are objects keep their element.
  const XmlElement* property(std::string_view name);

  /// The next object in it with one of the tags (<bsdf>, <ref>, ...) that nobody asked for yet, or null.
  const XmlElement* take(std::initializer_list<std::string_view> tags);
  /// The next one that nobody asked for yet and that `wanted` says yes to, or null.
  const XmlElement* take(const std::function<bool(const XmlElement&)>& wanted);

  /// A property that the format knows and that has no effect here: warns where it is given.
  void ignore(std::string_view name, std::string_view why);
  /// Throws for what is left.
  void finish();

 private:
  const XmlTree& tree_;
  const XmlElement& element_;
  std::vector<std::string>& warnings_;
  std::string type_;
  std::vector<std::string> names_;  // of the children, in today's spelling
  std::vector<bool> taken_;
  std::vector<std::string> asked_;

  const XmlElement* find(std::string_view name);
  /// The property with one of the tags, or null; any other tag is an error.
  const XmlElement* find(std::string_view name, std::initializer_list<std::string_view> tags);
  const std::string& value_of(const XmlElement& property) const;
  void check_attributes(const XmlElement& element) const;
};

}  // namespace embrun
