#pragma once

#include <vector>

#include "io/scene/xml_tree.h"

namespace embrun {

struct SceneReading;

/// Turns what Mitsuba says of a dielectric, the indices inside and outside of its surface, into what Embrun wants: the
/// index inside, relative to the air, and which body wins where several overlap. A body in air has priority 1; one whose
/// outside is the inside of another has a higher one.
class BodyPriorities {
 public:
  struct Body {
    double ior = 1;
    int priority = 1;
  };

  /// Takes note of a dielectric's indices.
  void add(double interior, double exterior);
  /// When all are known.
  void settle();
  /// Null where the exterior is the interior of nothing.
  const Body* find(double interior, double exterior) const;

 private:
  struct Entry {
    double interior, exterior, air;
    int level;
    Body body;
  };
  std::vector<Entry> entries_;
};

}  // namespace embrun
