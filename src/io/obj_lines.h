#pragma once

#include <span>
#include <string>
#include <string_view>

#include "io/cursor.h"
#include "math/vec.h"

namespace embrun {

/// Walks through the statements of an OBJ file.
class ObjLines {
 public:
  ObjLines(std::span<const std::byte> file, std::string_view name) : cursor_(file, name) {}

  const Cursor& cursor() const { return cursor_; }
  /// The next statement: its keyword (empty for an empty line or a comment), and what follows it. Lines that end with a
  /// backslash are joined. False at the end. Throws Error for a word that is no OBJ keyword.
  bool next(std::string_view& keyword, std::string_view& rest);
  /// Takes three numbers off `line`. Throws Error naming `what` where they are not there.
  Vec3d take_vector(std::string_view& line, std::string_view what) const;

 private:
  Cursor cursor_;
  std::string joined_;
};

/// Whether a text file is an OBJ with vertices: statements of OBJ alone before the first "v" followed by a number.
bool looks_like_obj(std::string_view file);

}  // namespace embrun
