# The headers that most files include, parsed once a build instead of once a file. What is compiled
# is the same.

option(SLCMAP_PRECOMPILE_HEADERS "Parse the headers of Eigen, OpenCV and GoogleTest once" ON)

# slcmap_precompile(TARGET LINK HEADER...): precompiles headers in a library of their own, since
# macros on a compiler's command line must be those that they were precompiled with.
function(slcmap_precompile target link)
  file(WRITE ${CMAKE_BINARY_DIR}/generated/${target}.cc "")
  add_library(${target} OBJECT EXCLUDE_FROM_ALL ${CMAKE_BINARY_DIR}/generated/${target}.cc)
  target_link_libraries(${target} PRIVATE ${link} ${OpenCV_LIBS} Eigen3::Eigen)
  target_precompile_headers(${target} PRIVATE <algorithm> <array> <chrono> <cmath> <filesystem>
    <functional> <map> <memory> <numeric> <optional> <random> <set> <sstream> <string>
    <unordered_map> <unordered_set> <variant> <vector> <Eigen/Dense> <nlohmann/json.hpp>
    <opencv2/imgproc.hpp> ${ARGN})
endfunction()

# Lets all targets of a folder, and of those below it, use what is precompiled.
function(slcmap_use_precompiled folder)
  get_property(targets DIRECTORY ${folder} PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target ${targets})
    get_target_property(links ${target} LINK_LIBRARIES)
    get_target_property(type ${target} TYPE)
    if(type MATCHES "STATIC_LIBRARY|EXECUTABLE")
      if("slcmap_test_main" IN_LIST links OR target STREQUAL "slcmap_test_main")
        set_target_properties(${target} PROPERTIES
          PRECOMPILE_HEADERS_REUSE_FROM slcmap_precompiled_tests)
      else()
        set_target_properties(${target} PROPERTIES
          PRECOMPILE_HEADERS_REUSE_FROM slcmap_precompiled)
      endif()
    endif()
  endforeach()
  get_property(folders DIRECTORY ${folder} PROPERTY SUBDIRECTORIES)
  foreach(below ${folders})
    slcmap_use_precompiled(${below})
  endforeach()
endfunction()

if(SLCMAP_PRECOMPILE_HEADERS)
  slcmap_precompile(slcmap_precompiled "")
  target_compile_options(slcmap_precompiled PRIVATE ${SLCMAP_LIBRARY_OPTIONS})
  foreach(folder data odometry mapping export apps)
    slcmap_use_precompiled(${PROJECT_SOURCE_DIR}/${folder})
  endforeach()
  if(SLCMAP_BUILD_TESTS)
    find_package(GTest REQUIRED)
    slcmap_precompile(slcmap_precompiled_tests GTest::gmock <gmock/gmock.h> <gtest/gtest.h>)
    slcmap_use_precompiled(${PROJECT_SOURCE_DIR}/tests)
  endif()
endif()
