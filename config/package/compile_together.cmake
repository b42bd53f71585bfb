# Files of a folder compiled in one go: what costs most, parsing Eigen, Ceres and OpenCV and
# instantiating their templates, is then done once for a few files instead of once for each.

set(SLCMAP_FILES_TOGETHER 8 CACHE STRING
  "Files of a folder compiled together, at most; with 1, a change rebuilds less")

# slcmap_compile_together(TARGET): files of a folder, in their order. In the unnamed namespaces of a
# folder a name then stands for one thing.
function(slcmap_compile_together target)
  if(SLCMAP_FILES_TOGETHER LESS_EQUAL 1)
    return()
  endif()
  set(size ${SLCMAP_FILES_TOGETHER})
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "^[^$]*\\.cc$")
  foreach(source ${sources})
    cmake_path(GET source PARENT_PATH folder)
    string(MAKE_C_IDENTIFIER "${target}_${folder}" group)
    if(NOT DEFINED ${group}_size)
      set(${group}_size 0)
    endif()
    math(EXPR batch "${${group}_size} / ${size}")
    math(EXPR ${group}_size "${${group}_size} + 1")
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group}_${batch})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  # A class that a .cc file alone has may hold what is in the unnamed namespace.
  target_compile_options(${target} PRIVATE -Wno-subobject-linkage)
endfunction()

# Files compiled together need up to 2.5 GB; as many at a time as there is memory for.
cmake_host_system_information(RESULT memory_mb QUERY TOTAL_PHYSICAL_MEMORY)
math(EXPR jobs "${memory_mb} / 3000")
if(jobs LESS 1)
  set(jobs 1)
endif()
set_property(GLOBAL APPEND PROPERTY JOB_POOLS slcmap_compile=${jobs})
set(CMAKE_JOB_POOL_COMPILE slcmap_compile)
