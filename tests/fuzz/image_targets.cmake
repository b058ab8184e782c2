# libFuzzer targets of the picture readers. Like the particle readers' (CMakeLists.txt beside this), they compile the
# sources themselves.
add_library(fuzzed_images OBJECT)
set(source ${PROJECT_SOURCE_DIR}/src)
target_sources(fuzzed_images PRIVATE
  ${source}/base/error.cpp
  ${source}/image/image.cpp
  ${source}/image/tone_curve.cpp
  ${source}/math/srgb.cpp
  ${source}/io/exr_header.cpp
  ${source}/io/file_bytes.cpp
  ${source}/io/image_exr.cpp
  ${source}/io/image_hdr.cpp
  ${source}/io/image_jpeg.cpp
  ${source}/io/image_pfm.cpp
  ${source}/io/image_png.cpp
  ${source}/io/image_read.cpp)
target_include_directories(fuzzed_images PUBLIC ${source})
target_link_libraries(fuzzed_images PUBLIC embrun_flags fmt::fmt OpenEXR::OpenEXR PNG::PNG JPEG::JPEG)

foreach(format exr hdr jpeg pfm png)
  add_executable(fuzz_${format} ${CMAKE_CURRENT_LIST_DIR}/image_fuzz_${format}.cpp)
  target_include_directories(fuzz_${format} PRIVATE ${CMAKE_CURRENT_LIST_DIR}/..)
  target_link_libraries(fuzz_${format} PRIVATE fuzzed_images)
  target_link_options(fuzz_${format} PRIVATE -fsanitize=fuzzer)
endforeach()
