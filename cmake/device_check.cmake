# embrun_device_check: the per-ray headers compiled by nvcc, for the device, to PTX: what is beyond takes three times as long
# and knows no C++. Nothing runs.
find_program(EMBRUN_NVCC nvcc HINTS ENV CUDA_PATH PATH_SUFFIXES bin PATHS /usr/local/cuda/bin)
if(EMBRUN_NVCC)
  # Named outright: the default of some toolkits is an architecture that newer ones no longer compile.
  set(CMAKE_CUDA_COMPILER ${EMBRUN_NVCC})
  set(CMAKE_CUDA_ARCHITECTURES 80-virtual CACHE STRING "Device architectures of embrun_device_check")
  enable_language(CUDA)
  add_library(embrun_device_check OBJECT EXCLUDE_FROM_ALL
              ${PROJECT_SOURCE_DIR}/src/backend/cuda/device_check.cu)
  target_include_directories(embrun_device_check PRIVATE ${PROJECT_SOURCE_DIR}/src)
  # nvcc has C++20 since 12.0; CMake 3.25 has not heard of it.
  if(NOT CMAKE_CUDA20_STANDARD_COMPILE_OPTION)
    set(CMAKE_CUDA20_STANDARD_COMPILE_OPTION -std=c++20)
  endif()
  set_target_properties(embrun_device_check PROPERTIES CUDA_STANDARD 20 CUDA_STANDARD_REQUIRED ON CUDA_EXTENSIONS OFF
                        CUDA_PTX_COMPILATION ON)
  message(STATUS "CUDA toolkit found: target embrun_device_check compiles the per-ray code for the device")
else()
  message(STATUS "No CUDA toolkit found: the per-ray code is not compiled for the device")
endif()

if(EMBRUN_BUILD_TESTS)
  if(EMBRUN_NVCC)
    add_test(NAME device.compile
             COMMAND ${CMAKE_COMMAND} --build ${PROJECT_BINARY_DIR} --target embrun_device_check)
  else()
    add_test(NAME device.compile COMMAND ${CMAKE_COMMAND} -E echo "skipped: no CUDA toolkit on this machine")
    set_tests_properties(device.compile PROPERTIES SKIP_REGULAR_EXPRESSION "skipped:")
  endif()
  set_tests_properties(device.compile PROPERTIES LABELS fast TIMEOUT 600)
endif()
