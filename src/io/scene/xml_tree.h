#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "io/read_scene.h"

namespace embrun {

struct XmlAttribute {
  std::string name, value;
};

/// An element of a scene file.
struct XmlElement {
  std::string tag;
  std::vector<XmlAttribute> attributes;
  std::vector<XmlElement> children;
  std::size_t file = 0;  ///< index into XmlTree::files
  std::size_t line = 1;

  /// The attribute's value, or null.
  const std::string* find(std::string_view attribute) const;
  /// The attribute's value, or an empty string.
  std::string get(std::string_view attribute) const;
};

/// A scene file and what it includes as one tree: parameters put in, <default> and <include> elements gone.
struct XmlTree {
  XmlElement root;
  std::vector<std::string> files;  ///< the scene's own first, then the included ones

  /// Throws Error "FILE: line N: WHAT: MESSAGE" with the element's place; `what` may be empty.
  [[noreturn]] void fail(const XmlElement& element, std::string_view what, std::string_view message) const;
  /// The same text, for a warning.
  std::string located(const XmlElement& element, std::string_view what, std::string_view message) const;
  /// The path that a file named in the element stands for: relative to the file that the element is in.
  std::string resolve_path(const XmlElement& element, const std::string& path) const;
};

/// Reads a scene file. `$name` in an attribute's value becomes the parameter's value; a parameter of the caller's takes
/// the place of the <default> of that name. Throws Error for what is no XML, for parameters without a value, for
/// parameters of the caller's that the file never uses, for includes that never end, and for files beyond 64 MiB, two
/// million elements or 64 levels of nesting.
XmlTree load_xml_tree(const std::string& path, const std::vector<SceneParameter>& parameters,
                      const ReadFileBytes& read_bytes);

}  // namespace embrun
