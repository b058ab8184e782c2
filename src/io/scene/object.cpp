#include "io/scene/object.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "io/text.h"

namespace embrun {
namespace {

using Tags = std::initializer_list<std::string_view>;

bool is_one_of(std::string_view tag, Tags tags) { return std::find(tags.begin(), tags.end(), tag) != tags.end(); }

/// Whether an attribute means something on an element.
bool has_meaning(std::string_view attribute, std::string_view tag) {
  if (is_one_of(tag, {"float", "integer", "boolean", "string", "rgb", "spectrum"}))
    return is_one_of(attribute, {"name", "value"});
  if (is_one_of(tag, {"point", "vector"})) return is_one_of(attribute, {"name", "value", "x", "y", "z"});
  if (is_one_of(tag, {"translate", "scale", "matrix"})) return is_one_of(attribute, {"value", "x", "y", "z"});
  if (tag == "rotate") return is_one_of(attribute, {"value", "x", "y", "z", "angle"});
  if (is_one_of(tag, {"lookat", "lookAt"})) return is_one_of(attribute, {"origin", "target", "up"});
  if (tag == "transform") return attribute == "name";
  if (tag == "ref") return is_one_of(attribute, {"name", "id"});
  return is_one_of(attribute, {"type", "id", "name", "version"});
}

}  // namespace

SceneObject::SceneObject(const XmlTree& tree, const XmlElement& element, std::vector<std::string>& warnings)
    : tree_(tree), element_(element), warnings_(warnings), type_(element.get("type")), taken_(element.children.size()) {
  check_attributes(element);
  for (const XmlElement& child : element.children) {
    const std::string name = snake_case(child.get("name"));
    if (!name.empty() && std::find(names_.begin(), names_.end(), name) != names_.end())
      tree.fail(child, title(), fmt::format("{} is given twice", quoted(name)));
    names_.push_back(name);
    check_attributes(child);
    for (const XmlElement& step : child.children)
      if (child.tag == "transform") check_attributes(step);
  }
}

void SceneObject::check_attributes(const XmlElement& element) const {
  for (const XmlAttribute& a : element.attributes)
    if (!has_meaning(a.name, element.tag))
      warnings_.push_back(
          tree_.located(element, element.tag, fmt::format("the attribute {} is not used", quoted(a.name))));
}

std::string SceneObject::title() const {
  return type_.empty() ? element_.tag : fmt::format("{} \"{}\"", element_.tag, printable(type_));
}

bool SceneObject::has(std::string_view name) const {
  return std::find(names_.begin(), names_.end(), name) != names_.end();
}

const XmlElement* SceneObject::find(std::string_view name) {
  asked_.emplace_back(name);
  const auto at = std::find(names_.begin(), names_.end(), name);
  if (at == names_.end()) return nullptr;
  const auto index = static_cast<std::size_t>(at - names_.begin());
  taken_[index] = true;
  return &element_.children[index];
}

const XmlElement* SceneObject::find(std::string_view name, Tags tags) {
  const XmlElement* property = find(name);
  if (property != nullptr && !is_one_of(property->tag, tags))
    tree_.fail(
        *property, title(),
        fmt::format("{} is a <{}>; it has to be a <{}>", quoted(name), property->tag, fmt::join(tags, "> or <")));
  return property;
}

const std::string& SceneObject::value_of(const XmlElement& property) const {
  const std::string* value = property.find("value");
  if (value == nullptr) tree_.fail(property, property.tag, "the attribute 'value' is missing");
  return *value;
}

std::optional<double> SceneObject::number(std::string_view name) {
  const XmlElement* p = find(name, {"float", "integer"});
  if (p == nullptr) return std::nullopt;
  return parse_number(tree_, *p, name, value_of(*p));
}

std::optional<int> SceneObject::integer(std::string_view name, int low, int high) {
  const XmlElement* p = find(name, {"integer"});
  if (p == nullptr) return std::nullopt;
  const double value = parse_number(tree_, *p, name, value_of(*p));
  if (value != std::floor(value) || value < low || value > high)
    tree_.fail(*p, title(),
               fmt::format("'{}' is {}: it has to be a whole number from {} to {}", name, value, low, high));
  return static_cast<int>(value);
}

std::optional<bool> SceneObject::flag(std::string_view name) {
  const XmlElement* p = find(name, {"boolean"});
  if (p == nullptr) return std::nullopt;
  const std::string value = to_lower(trimmed(value_of(*p)));
  if (value != "true" && value != "false")
    tree_.fail(*p, title(), fmt::format("'{}' is {}: it has to be true or false", name, quoted(value)));
  return value == "true";
}

std::optional<std::string> SceneObject::text(std::string_view name) {
  const XmlElement* p = find(name, {"string"});
  if (p == nullptr) return std::nullopt;
  return value_of(*p);
}

std::optional<Vec3d> SceneObject::vector(std::string_view name) {
  const XmlElement* p = find(name, {"point", "vector"});
  if (p == nullptr) return std::nullopt;
  return read_vector(tree_, *p);
}

std::optional<Rgb> SceneObject::color(std::string_view name, bool of_light) {
  const XmlElement* p = find(name, {"rgb", "spectrum", "float", "integer"});
  if (p == nullptr) return std::nullopt;
  if (p->tag == "spectrum") return read_spectrum(tree_, *p, of_light);
  if (p->tag == "rgb") return read_rgb(tree_, *p);
  return grey(static_cast<float>(parse_number(tree_, *p, name, value_of(*p))));
}

const XmlElement* SceneObject::transform(std::string_view name) { return find(name, {"transform"}); }

Placement SceneObject::placement(std::string_view name) {
  const XmlElement* p = transform(name);
  return p != nullptr ? read_transform(tree_, *p) : Placement{};
}

const XmlElement* SceneObject::property(std::string_view name) { return find(name); }

const XmlElement* SceneObject::take(Tags tags) {
  return take([&](const XmlElement& child) { return is_one_of(child.tag, tags); });
}

const XmlElement* SceneObject::take(const std::function<bool(const XmlElement&)>& wanted) {
  for (std::size_t i = 0; i < taken_.size(); ++i) {
    if (taken_[i] || !wanted(element_.children[i])) continue;
    taken_[i] = true;
    return &element_.children[i];
  }
  return nullptr;
}

void SceneObject::ignore(std::string_view name, std::string_view why) {
  const XmlElement* p = find(name);
  if (p != nullptr) warnings_.push_back(tree_.located(*p, title(), fmt::format("'{}' has no effect: {}", name, why)));
}

void SceneObject::finish() {
  for (std::size_t i = 0; i < taken_.size(); ++i) {
    if (taken_[i]) continue;
    const XmlElement& child = element_.children[i];
    const std::string type = child.get("type");
    std::string what = fmt::format("<{}{}>", child.tag, type.empty() ? "" : fmt::format(" type=\"{}\"", type));
    if (child.tag == "ref") what = fmt::format("<ref> to {}", quoted(child.get("id")));
    if (!names_[i].empty()) what = fmt::format("{} named {}", what, quoted(names_[i]));
    std::sort(asked_.begin(), asked_.end());
    asked_.erase(std::unique(asked_.begin(), asked_.end()), asked_.end());
    tree_.fail(child, title(),
               fmt::format("{} is not supported here{}{}", what, asked_.empty() ? "" : "; properties are ",
                           fmt::join(asked_, ", ")));
  }
}

}  // namespace embrun
