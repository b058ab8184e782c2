#pragma once

#include <embrun/embrun.h>

#include <string>

namespace embrun {

/// Shows how far a render is, on standard error: a bar that moves on a terminal, a line now and then elsewhere.
class ProgressDisplay {
 public:
  explicit ProgressDisplay(bool quiet);
  void show(const Progress& progress);
  /// Ends the bar's line, if one is under way.
  void finish();

 private:
  bool quiet_;
  bool terminal_;
  bool open_line_ = false;
  std::string stage_;
  int last_tenth_ = -1;

  void draw_bar(const Progress& progress);
  void print_line(const Progress& progress);
};

}  // namespace embrun
