# cmake --install: the library, its public headers, the program, and what find_package(embrun) reads.
include(CMakePackageConfigHelpers)

set(embrun_config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/embrun)

# A static library drags its dependencies along: those of its users then need them too.
set(EMBRUN_STATIC_DEPENDENCIES "")
if(NOT BUILD_SHARED_LIBS)
  foreach(package TBB embree OpenEXR PNG JPEG ZLIB fmt spdlog nlohmann_json pugixml)
    string(APPEND EMBRUN_STATIC_DEPENDENCIES "find_dependency(${package})\n")
  endforeach()
endif()

configure_package_config_file(
  ${CMAKE_CURRENT_LIST_DIR}/embrun-config.cmake.in ${PROJECT_BINARY_DIR}/embrun-config.cmake
  INSTALL_DESTINATION ${embrun_config_dir})
write_basic_package_version_file(
  ${PROJECT_BINARY_DIR}/embrun-config-version.cmake COMPATIBILITY SameMinorVersion)

set_target_properties(embrun_huge_pages PROPERTIES EXPORT_NAME huge_pages)
install(TARGETS embrun embrun_huge_pages EXPORT embrun-targets)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/embrun DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
        FILES_MATCHING PATTERN "*.h")
# What embrun reproduce renders.
install(DIRECTORY ${PROJECT_SOURCE_DIR}/data/ DESTINATION ${CMAKE_INSTALL_DATADIR}/embrun/data)
install(EXPORT embrun-targets NAMESPACE embrun:: DESTINATION ${embrun_config_dir})
install(FILES ${PROJECT_BINARY_DIR}/embrun-config.cmake ${PROJECT_BINARY_DIR}/embrun-config-version.cmake
        DESTINATION ${embrun_config_dir})
