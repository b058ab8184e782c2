# Flags shared by every target: warnings, the base instruction set, floating point.
add_library(embrun_flags INTERFACE)
target_compile_options(embrun_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion
  -fno-math-errno -fno-trapping-math
  # Calls within the shared library stay direct, as in a static one.
  -fno-semantic-interposition)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # gcc 12 warns of its own AVX-512 header (gcc bug 105593); clang still looks for the real thing.
  target_compile_options(embrun_flags INTERFACE -Wno-maybe-uninitialized)
endif()
if(EMBRUN_WERROR)
  target_compile_options(embrun_flags INTERFACE -Werror)
endif()
if(EMBRUN_NATIVE)
  target_compile_options(embrun_flags INTERFACE -march=native)
else()
  # Any x86-64-v2 machine runs the library; src/backend/cpu holds faster versions of the hot loops.
  target_compile_options(embrun_flags INTERFACE -march=x86-64-v2)
endif()
