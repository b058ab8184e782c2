# Every third-party package the project uses, all of them Debian's.

# embrun_require(PACKAGE DEBIAN_PACKAGE [version]): find_package that, when it fails, says what to install.
macro(embrun_require package debian_package)
  find_package(${package} ${ARGN} QUIET)
  if(NOT ${package}_FOUND)
    message(FATAL_ERROR
      "${package} was not found. On Debian: apt-get install ${debian_package}; "
      "or let scripts/setup.sh install everything the build needs.")
  endif()
endmacro()

embrun_require(TBB libtbb-dev)
embrun_require(embree libembree-dev 3)
# Debian's Imath package tells at length that its Python part is not installed; nobody needs to know.
set(CMAKE_MESSAGE_LOG_LEVEL NOTICE)
embrun_require(OpenEXR libopenexr-dev 3)
unset(CMAKE_MESSAGE_LOG_LEVEL)
embrun_require(PNG libpng-dev)
embrun_require(JPEG libjpeg-dev)
embrun_require(ZLIB zlib1g-dev)
embrun_require(fmt libfmt-dev)
embrun_require(spdlog libspdlog-dev)
embrun_require(CLI11 libcli11-dev)
embrun_require(nlohmann_json nlohmann-json3-dev)
embrun_require(pugixml libpugixml-dev)
# OpenVDB writes density grids (embrun mesh --density); without it that one option is an error. Debian has no CMake
# package of it, and its headers want Boost's, on which its package does not depend.
set(EMBRUN_HAS_OPENVDB OFF)
if(EMBRUN_OPENVDB)
  find_path(OPENVDB_INCLUDE_DIR openvdb/openvdb.h)
  find_path(BOOST_HEADERS_DIR boost/numeric/conversion/conversion_traits.hpp)
  find_library(OPENVDB_LIBRARY openvdb)
  if(OPENVDB_INCLUDE_DIR AND BOOST_HEADERS_DIR AND OPENVDB_LIBRARY)
    set(EMBRUN_HAS_OPENVDB ON)
    set(EMBRUN_OPENVDB_LIBRARIES ${OPENVDB_LIBRARY} Imath::Imath TBB::tbb)  # its headers call these
    # Not those that the compiler looks in by itself: named as a system folder, /usr/include comes before the standard
    # library's own and hides from it the headers that it wraps (#include_next <stdlib.h>).
    set(EMBRUN_OPENVDB_INCLUDES ${OPENVDB_INCLUDE_DIR} ${BOOST_HEADERS_DIR})
    list(REMOVE_DUPLICATES EMBRUN_OPENVDB_INCLUDES)
    list(REMOVE_ITEM EMBRUN_OPENVDB_INCLUDES /usr/include ${CMAKE_CXX_IMPLICIT_INCLUDE_DIRECTORIES})
  else()
    message(STATUS "OpenVDB was not found: embrun mesh --density is left out. On Debian: apt-get install "
                   "libopenvdb-dev libboost-dev")
  endif()
endif()
if(EMBRUN_BUILD_TESTS)
  embrun_require(GTest libgtest-dev)
endif()
if(EMBRUN_BUILD_BENCH)
  embrun_require(benchmark libbenchmark-dev)
endif()
if(EMBRUN_BUILD_FUZZERS AND NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
  message(FATAL_ERROR "EMBRUN_BUILD_FUZZERS needs clang (apt-get install clang-14 libclang-rt-14-dev): "
                      "cmake --preset fuzz")
endif()
