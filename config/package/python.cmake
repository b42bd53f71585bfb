# Whether the Python module is built, which is a shared library of all others: they are then compiled
# for any place in memory, which changes no result.

option(SLCMAP_BUILD_PYTHON "Build the Python module, where pybind11 and Python's headers are" ON)
set(SLCMAP_LIBRARY_OPTIONS "")
if(SLCMAP_SANITIZE)
  # A sanitizer has to be in the program from its start, and Python is built without.
  set(SLCMAP_BUILD_PYTHON OFF)
endif()
if(SLCMAP_BUILD_PYTHON)
  # Debian's own, for which the package is made; others may stand before it in the path.
  if(NOT DEFINED Python_EXECUTABLE AND EXISTS /usr/bin/python3)
    set(Python_EXECUTABLE /usr/bin/python3)
  endif()
  set(PYBIND11_FINDPYTHON ON)
  find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module)
  if(Python_FOUND)
    find_package(pybind11 2.10 QUIET)
  endif()
  if(NOT pybind11_FOUND)
    message(STATUS "No Python module: found no pybind11 or no headers of Python (Debian: "
      "pybind11-dev, python3-dev, python3-numpy)")
    set(SLCMAP_BUILD_PYTHON OFF)
  endif()
endif()
if(SLCMAP_BUILD_PYTHON)
  # The second lets functions of a file be inlined into others of it, as in a program.
  set(SLCMAP_LIBRARY_OPTIONS -fPIC -fno-semantic-interposition)
endif()
