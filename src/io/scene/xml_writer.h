#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "math/rgb.h"
#include "scene/placement.h"

namespace embrun {

// Numbers are written as short as they read back the same.

inline std::string number(double v) { return fmt::format("{}", v); }
inline std::string number(float v) { return fmt::format("{}", v); }
inline std::string triple(Vec3d v) { return fmt::format("{}, {}, {}", v.x, v.y, v.z); }
inline std::string triple(Rgb v) {
  return v.r == v.g && v.g == v.b ? number(v.r) : fmt::format("{}, {}, {}", v.r, v.g, v.b);
}

inline std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&': result += "&amp;"; break;
      case '<': result += "&lt;"; break;
      case '>': result += "&gt;"; break;
      case '"': result += "&quot;"; break;
      case '\n': result += "&#10;"; break;
      case '\t': result += "&#9;"; break;
      case '\r': result += "&#13;"; break;
      default: result += c;
    }
  }
  return result;
}

/// Lines of XML, indented by what is open.
class Xml {
 public:
  void open(const std::string& start) {
    line("<" + start + ">");
    open_.push_back(start.substr(0, start.find(' ')));
  }
  void close() {
    const std::string tag = open_.back();
    open_.pop_back();
    line("</" + tag + ">");
  }
  void property(const char* tag, const char* name, const std::string& value) {
    line(fmt::format("<{} name=\"{}\" value=\"{}\"/>", tag, name, escaped(value)));
  }
  void real(const char* name, double v) { property("float", name, number(v)); }
  void real(const char* name, float v) { property("float", name, number(v)); }
  void whole(const char* name, long long v) { property("integer", name, std::to_string(v)); }
  void flag(const char* name, bool v) { property("boolean", name, v ? "true" : "false"); }
  void text(const char* name, const std::string& v) { property("string", name, v); }
  void color(const char* name, Rgb v) { property("rgb", name, triple(v)); }
  void point(const char* name, Vec3d v) { property("point", name, triple(v)); }
  void vector(const char* name, Vec3d v) { property("vector", name, triple(v)); }
  void file(const std::string& path) { text("filename", absolute(path)); }
  void files(const std::string& first, const std::vector<std::string>& more) {
    if (more.empty()) return file(first);
    std::string all = absolute(first);
    for (const std::string& path : more) all += "; " + absolute(path);
    if (std::count(all.begin(), all.end(), ';') != static_cast<std::ptrdiff_t>(more.size()))
      throw Error(all + ": a list of files in a scene file cannot name one with a ; in its name");
    text("filenames", all);
  }
  void placement(const Placement& m, const char* name = "to_world") {
    if (m == Placement{}) return;
    open(fmt::format("transform name=\"{}\"", name));
    line(fmt::format("<matrix value=\"{} {} {} {}  {} {} {} {}  {} {} {} {}  0 0 0 1\"/>", m.x_axis.x, m.y_axis.x,
                     m.z_axis.x, m.origin.x, m.x_axis.y, m.y_axis.y, m.z_axis.y, m.origin.y, m.x_axis.z, m.y_axis.z,
                     m.z_axis.z, m.origin.z));
    close();
  }
  void line(const std::string& content) {
    result_.append(2 * open_.size(), ' ');
    result_ += content + "\n";
  }
  std::string take() { return std::move(result_); }

 private:
  std::string result_;
  std::vector<std::string> open_;

  static std::string absolute(const std::string& path) {
    return std::filesystem::absolute(path).lexically_normal().string();
  }
};

/// Throws Error for what is not from a file.
inline void need_file(const std::string& file, const char* what, std::size_t index) {
  if (file.empty()) throw Error(fmt::format("{} {} is not from a file: a scene file cannot name it", what, index + 1));
}

}  // namespace embrun
