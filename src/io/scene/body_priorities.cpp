#include "io/scene/body_priorities.h"

#include <algorithm>
#include <cmath>

namespace embrun {
namespace {

/// Vacuum, air and all that is written for them.
bool is_air(double index) { return std::abs(index - 1) < 6e-4; }
bool same_index(double a, double b) { return std::abs(a - b) < 1e-4; }

}  // namespace

void BodyPriorities::add(double interior, double exterior) {
  const auto same = [&](const Entry& e) { return e.interior == interior && e.exterior == exterior; };
  if (std::none_of(entries_.begin(), entries_.end(), same)) entries_.push_back({interior, exterior, 1, 0, {}});
}

void BodyPriorities::settle() {
  // Level by level: first what stands in air, then what stands in that.
  for (Entry& e : entries_) {
    if (!is_air(e.exterior)) continue;
    e.level = 1;
    e.air = e.exterior;
  }
  for (int level = 1; level <= static_cast<int>(entries_.size()); ++level) {
    for (Entry& e : entries_) {
      if (e.level != 0) continue;
      const auto holds = [&](const Entry& other) {
        return other.level == level && same_index(other.interior, e.exterior);
      };
      const auto holder = std::find_if(entries_.begin(), entries_.end(), holds);
      if (holder == entries_.end()) continue;
      e.level = level + 1;
      e.air = holder->air;
    }
  }
  for (Entry& e : entries_) e.body = {is_air(e.interior) ? 1 : e.interior / e.air, e.level};
}

const BodyPriorities::Body* BodyPriorities::find(double interior, double exterior) const {
  for (const Entry& e : entries_)
    if (e.interior == interior && e.exterior == exterior && e.level > 0) return &e.body;
  return nullptr;
}

}  // namespace embrun
