#include "progress_display.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>

namespace embrun {
namespace {

std::string duration(double seconds) {
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  const long whole = static_cast<long>(seconds);
  if (seconds < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string remaining(const Progress& progress) {
  return progress.remaining >= 0 && progress.fraction < 1 ? ", " + duration(progress.remaining) + " left" : "";
}

}  // namespace

ProgressDisplay::ProgressDisplay(bool quiet) : quiet_(quiet), terminal_(isatty(STDERR_FILENO) != 0) {}

void ProgressDisplay::show(const Progress& progress) {
  if (quiet_) return;
  if (stage_ != progress.stage) {
    finish();
    stage_ = progress.stage;
    last_tenth_ = -1;
  }
  if (terminal_)
    draw_bar(progress);
  else
    print_line(progress);
}

void ProgressDisplay::finish() {
  if (open_line_) std::fputc('\n', stderr);
  open_line_ = false;
}

void ProgressDisplay::draw_bar(const Progress& progress) {
  constexpr int width = 30;
  const int filled = static_cast<int>(progress.fraction * width);
  const std::string bar =
      std::string(static_cast<std::size_t>(filled), '=') + std::string(static_cast<std::size_t>(width - filled), ' ');
  // Clears what a longer line left.
  fmt::print(stderr, "\r{:<9} [{}] {:3.0f} %  {}{}\x1b[K", stage_, bar, 100 * progress.fraction,
             duration(progress.elapsed), remaining(progress));
  std::fflush(stderr);
  open_line_ = true;
  if (progress.fraction >= 1) finish();
}

void ProgressDisplay::print_line(const Progress& progress) {
  const int tenth = static_cast<int>(progress.fraction * 10);
  if (tenth == last_tenth_ || (tenth == 0 && stage_ != "rendering")) return;
  last_tenth_ = tenth;
  fmt::print(stderr, "{} {:.0f} %, {}{}\n", stage_, 100 * progress.fraction, duration(progress.elapsed),
             remaining(progress));
}

}  // namespace embrun
