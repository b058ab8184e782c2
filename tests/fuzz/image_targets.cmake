# libFuzzer targets of the picture readers: fuzz_exr, fuzz_hdr, fuzz_jpeg, fuzz_pfm, fuzz_png (clang, preset fuzz).
# Run one as: fuzz_hdr NEW_CORPUS tests/fuzz/corpus/hdr
foreach(format exr hdr jpeg pfm png)
  add_executable(fuzz_${format} ${CMAKE_CURRENT_LIST_DIR}/image_fuzz_${format}.cpp)
  target_include_directories(fuzz_${format} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(fuzz_${format} PRIVATE embrun_internal)
  target_link_options(fuzz_${format} PRIVATE -fsanitize=fuzzer)
endforeach()
