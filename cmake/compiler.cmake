# Flags shared by every target: warnings, the base instruction set, floating point.
add_library(embrun_flags INTERFACE)
target_compile_options(embrun_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion
  -fno-math-errno -fno-trapping-math
  # Calls within the shared library stay direct, as in a static one.
  -fno-semantic-interposition)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # gcc 12 warns of its own headers: AVX-512 intrinsics (gcc bug 105593), std::string (105651). clang, with which CI
  # builds too, looks for the real thing.
  target_compile_options(embrun_flags INTERFACE -Wno-uninitialized -Wno-maybe-uninitialized -Wno-restrict)
endif()
if(EMBRUN_WERROR)
  target_compile_options(embrun_flags INTERFACE -Werror)
endif()
if(EMBRUN_NATIVE)
  target_compile_options(embrun_flags INTERFACE -march=native)
else()
  # Any x86-64-v2 machine runs the library; src/backend/cpu holds faster versions of the hot loops. Their targets set
  # EMBRUN_OWN_ISA, as this option would come after theirs and undo it.
  target_compile_options(embrun_flags INTERFACE
    $<$<NOT:$<BOOL:$<TARGET_PROPERTY:EMBRUN_OWN_ISA>>>:-march=x86-64-v2>)
endif()
