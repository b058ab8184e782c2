#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "particles/particle_set.h"

namespace embrun {

/// The points of a file, some at a time, so that it need not fit into memory.
class PointStream {
 public:
  virtual ~PointStream() = default;
  /// In the file, or in all.
  virtual std::uint64_t count() const = 0;
  /// The next of them; without any at the end. What is in its notes and counts is of these alone.
  virtual ParticleSet next() = 0;
  virtual void rewind() = 0;
};

/// Reads a file in pieces if it is of a format for that: binary PLY that begins with its vertices, which have no lists. Null
/// for what is not, and for what is no such file at all. Throws Error where the file ends too early.
std::unique_ptr<PointStream> open_point_stream(const std::string& path);

/// Points that are in memory.
std::unique_ptr<PointStream> stream_of(ParticleSet particles);

}  // namespace embrun
