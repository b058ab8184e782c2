#include "io/scene/xml_tree.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <pugixml.hpp>

#include "base/error.h"
#include "io/cursor.h"
#include "io/text.h"

namespace embrun {
namespace {

constexpr std::size_t largest_file = std::size_t{64} << 20;
constexpr std::size_t most_elements = 2'000'000;
constexpr std::size_t most_files = 1000;
constexpr int deepest_nesting = 64;
constexpr int deepest_include = 16;

struct Parameter {
  std::string name, value;
  bool from_caller = false, used = false;
};

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

bool is_parameter_name(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), is_name_character);
}

/// Where the lines of a text begin, to tell the line of an offset.
class Lines {
 public:
  explicit Lines(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i)
      if (text[i] == '\n') ends_.push_back(i);
  }
  std::size_t line_of(std::ptrdiff_t offset) const {
    const auto at = static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0));
    return static_cast<std::size_t>(std::lower_bound(ends_.begin(), ends_.end(), at) - ends_.begin()) + 1;
  }

 private:
  std::vector<std::size_t> ends_;
};

class Loader {
 public:
  Loader(const std::vector<SceneParameter>& parameters, const ReadFileBytes& read_bytes) : read_bytes_(read_bytes) {
    for (const SceneParameter& p : parameters) {
      if (!is_parameter_name(p.name))
        throw Error(
            fmt::format("the parameter's name {} is not made of letters, digits and _", embrun::quoted(p.name)));
      parameters_.push_back({p.name, p.value, true, false});
    }
  }

  XmlTree run(const std::string& path) {
    tree_.root.tag = "scene";
    load(path, nullptr, 0);
    for (const Parameter& p : parameters_)
      if (p.from_caller && !p.used)
        throw Error(fmt::format("{}: nothing in it uses the parameter ${}", path, printable(p.name)));
    return std::move(tree_);
  }

 private:
  const ReadFileBytes& read_bytes_;
  XmlTree tree_;
  std::vector<Parameter> parameters_;
  std::size_t elements_ = 0;

  /// Adds the elements of a file to the root.
  void load(const std::string& path, const XmlElement* include, int depth) {
    if (include != nullptr && (depth > deepest_include || tree_.files.size() >= most_files))
      tree_.fail(*include, "include",
                 fmt::format("files are included {} deep or {} in all: does one include itself?", deepest_include,
                             most_files));
    const std::size_t file = tree_.files.size();
    tree_.files.push_back(path);
    const std::vector<std::byte> bytes = read_bytes_(path);
    if (bytes.size() > largest_file)
      fail_in_file(path, "", "",
                   fmt::format("{} bytes: a scene file may have {} MiB", bytes.size(), largest_file >> 20));
    const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const Lines lines(text);

    pugi::xml_document document;
    // Always UTF-8: a guess would take other files for UTF-16, and lose their places.
    const pugi::xml_parse_result result =
        document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!result) fail_in_file(path, fmt::format("line {}", lines.line_of(result.offset)), "XML", result.description());
    const pugi::xml_node root = document.document_element();
    if (std::string_view(root.name()) != "scene")
      fail_in_file(path, fmt::format("line {}", lines.line_of(root.offset_debug())), "",
                   fmt::format("the outermost element is <{}>, not <scene>", printable(root.name())));
    for (const pugi::xml_node node : root.children()) convert(node, lines, file, tree_.root, depth, 1);
    if (depth > 0) return;
    for (const pugi::xml_attribute a : root.attributes()) tree_.root.attributes.push_back({a.name(), a.value()});
    tree_.root.line = lines.line_of(root.offset_debug());
  }

  void convert(pugi::xml_node node, const Lines& lines, std::size_t file, XmlElement& parent, int include_depth,
               int depth) {
    XmlElement element;
    element.file = file;
    element.line = lines.line_of(node.offset_debug());
    element.tag = node.name();
    if (node.type() != pugi::node_element)
      tree_.fail(element, "",
                 fmt::format("the text {} is outside of any attribute", embrun::quoted(trimmed(node.value()))));
    if (++elements_ > most_elements)
      tree_.fail(element, "", fmt::format("there are more than {} elements", most_elements));
    if (depth > deepest_nesting)
      tree_.fail(element, "", fmt::format("elements are nested more than {} deep", deepest_nesting));
    for (const pugi::xml_attribute a : node.attributes()) {
      if (element.find(a.name()) != nullptr)
        tree_.fail(element, element.tag, fmt::format("the attribute {} is given twice", embrun::quoted(a.name())));
      element.attributes.push_back({a.name(), with_parameters(element, a.value())});
    }

    if (element.tag == "default") {
      define(element);
    } else if (element.tag == "include") {
      const std::string name = element.get("filename");
      if (name.empty()) tree_.fail(element, "include", "the attribute 'filename' is missing");
      if (depth != 1) tree_.fail(element, "include", "files can be included at the outermost level only");
      load(tree_.resolve_path(element, name), &element, include_depth + 1);
    } else {
      for (const pugi::xml_node child : node.children()) convert(child, lines, file, element, include_depth, depth + 1);
      parent.children.push_back(std::move(element));
    }
  }

  /// A <default>: a parameter's value, unless the caller or an earlier one gave it.
  void define(const XmlElement& element) {
    const std::string name = element.get("name");
    if (!is_parameter_name(name))
      tree_.fail(element, "default", fmt::format("{} is no name of letters, digits and _", embrun::quoted(name)));
    if (element.find("value") == nullptr) tree_.fail(element, "default", "the attribute 'value' is missing");
    const auto same = [&](const Parameter& p) { return p.name == name; };
    const auto known = std::find_if(parameters_.begin(), parameters_.end(), same);
    if (known == parameters_.end())
      parameters_.push_back({name, element.get("value"), false, false});
    else
      known->used = true;
  }

  std::string with_parameters(const XmlElement& element, std::string_view text) {
    std::string result;
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] != '$') {
        result += text[i];
        continue;
      }
      // The longest name that fits: $frame_x is not $frame followed by _x where both are known.
      Parameter* best = nullptr;
      for (Parameter& p : parameters_)
        if (text.substr(i + 1).starts_with(p.name) && (best == nullptr || p.name.size() > best->name.size())) best = &p;
      if (best == nullptr) {
        std::size_t end = i + 1;
        while (end < text.size() && is_name_character(text[end])) ++end;
        const std::string name(text.substr(i, end - i));
        tree_.fail(element, element.tag,
                   fmt::format("the parameter {} has no value: give it one by a <default> above, or by -D {}=VALUE",
                               embrun::quoted(name), printable(name.substr(1))));
      }
      best->used = true;
      result += best->value;
      i += best->name.size();
    }
    return result;
  }
};

}  // namespace

const std::string* XmlElement::find(std::string_view attribute) const {
  for (const XmlAttribute& a : attributes)
    if (a.name == attribute) return &a.value;
  return nullptr;
}

std::string XmlElement::get(std::string_view attribute) const {
  const std::string* value = find(attribute);
  return value != nullptr ? *value : std::string();
}

std::string XmlTree::located(const XmlElement& element, std::string_view what, std::string_view message) const {
  std::string text = fmt::format("{}: line {}", files[element.file], element.line);
  for (const std::string_view part : {what, message})
    if (!part.empty()) text += ": " + printable(part);
  return text;
}

void XmlTree::fail(const XmlElement& element, std::string_view what, std::string_view message) const {
  throw Error(located(element, what, message));
}

std::string XmlTree::resolve_path(const XmlElement& element, const std::string& path) const {
  namespace fs = std::filesystem;
  const fs::path named(path);
  return named.is_absolute() ? path : (fs::path(files[element.file]).parent_path() / named).lexically_normal().string();
}

XmlTree load_xml_tree(const std::string& path, const std::vector<SceneParameter>& parameters,
                      const ReadFileBytes& read_bytes) {
  return Loader(parameters, read_bytes).run(path);
}

}  // namespace embrun
