#pragma once

#include <stdexcept>
#include <string>

namespace embrun {

/// A mistake of the user's: a bad file, a bad option, a scene that cannot be rendered. The message
/// names the file (and the byte offset, line or attribute) and says what is wrong and, where it
/// helps, what to do. Programmer errors are EMBRUN_CHECK instead.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A file that holds none where particles are wanted: a solver writes such of foam that has not come up yet.
class NoParticles : public Error {
 public:
  using Error::Error;
};

[[noreturn]] void check_failed(const char* condition, const char* file, int line);

}  // namespace embrun

/// Aborts with the condition and its place when it is false; active in every build type.
#define EMBRUN_CHECK(condition) ((condition) ? (void)0 : ::embrun::check_failed(#condition, __FILE__, __LINE__))
