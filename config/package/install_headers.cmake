# Installs headers with all that they include, in their folders.
#
#   source: the folder of the sources; headers: in it; destination: below the prefix
cmake_policy(VERSION 3.25)
set(todo ${headers})
set(found "")
while(todo)
  list(POP_FRONT todo header)
  if(NOT header IN_LIST found AND EXISTS "${source}/${header}")
    list(APPEND found ${header})
    file(STRINGS "${source}/${header}" includes REGEX "^#include \"")
    list(TRANSFORM includes REPLACE "^#include \"([^\"]+)\".*" "\\1")
    list(APPEND todo ${includes})
  endif()
endwhile()
foreach(header ${found})
  cmake_path(GET header PARENT_PATH folder)
  file(INSTALL "${source}/${header}" DESTINATION "${CMAKE_INSTALL_PREFIX}/${destination}/${folder}")
endforeach()
