# What `cmake --install` and CPack make: the program (component `program`) and, for other programs,
# libraries, headers and the files of find_package(slcmap) (component `development`).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(SLCMAP_HEADERS ${CMAKE_INSTALL_INCLUDEDIR}/slcmap-${PROJECT_VERSION})
set(SLCMAP_CMAKE ${CMAKE_INSTALL_LIBDIR}/cmake/slcmap)

install(TARGETS slcmap DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
install(DIRECTORY config/batch config/options config/profiles config/rigs config/scenes
  DESTINATION ${CMAKE_INSTALL_DATADIR}/slcmap/config COMPONENT program USE_SOURCE_PERMISSIONS)
# Missing where it could not be made: see export/page.
install(FILES ${PROJECT_BINARY_DIR}/share/slcmap/page/page.html
  ${PROJECT_BINARY_DIR}/share/slcmap/page/tiles.html
  DESTINATION ${CMAKE_INSTALL_DATADIR}/slcmap/page COMPONENT program OPTIONAL)
install(FILES README.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT program)

# slcmap_install_libraries(PART TARGET...): slcmap_x is slcmap::x to those who find the package.
function(slcmap_install_libraries part)
  foreach(target ${ARGN})
    string(REPLACE slcmap_ "" name ${target})
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  endforeach()
  install(TARGETS ${ARGN} EXPORT slcmap-${part}
    DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    INCLUDES DESTINATION ${SLCMAP_HEADERS})
  install(EXPORT slcmap-${part} FILE slcmap-${part}-targets.cmake NAMESPACE slcmap::
    DESTINATION ${SLCMAP_CMAKE} COMPONENT development)
endfunction()

slcmap_install_libraries(odometry
  slcmap_data slcmap_residuals slcmap_frontend slcmap_structure slcmap_run_folder slcmap_odometry)
slcmap_install_libraries(mapping slcmap_polygon slcmap_mapping)
slcmap_install_libraries(export slcmap_export)

# Headers keep their places, so that includes read as they do here. Those of the libraries' users are
# these, and what they include.
set(SLCMAP_USED_HEADERS data/source/sequence.h odometry/odometry.h odometry/run/run_folder.h
  mapping/mapping.h mapping/map/map_folder.h export/export.h)
install(CODE "set(source \"${PROJECT_SOURCE_DIR}\")
set(headers \"${SLCMAP_USED_HEADERS}\")
set(destination \"${SLCMAP_HEADERS}\")" COMPONENT development)
install(SCRIPT config/package/install_headers.cmake COMPONENT development)
install(FILES ${PROJECT_BINARY_DIR}/generated/data/version.h DESTINATION ${SLCMAP_HEADERS}/data
  COMPONENT development)

set(SLCMAP_OPENCV_MODULES ${OpenCV_FIND_COMPONENTS})
configure_package_config_file(config/package/slcmap-config.cmake.in
  ${PROJECT_BINARY_DIR}/generated/slcmap-config.cmake INSTALL_DESTINATION ${SLCMAP_CMAKE})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/generated/slcmap-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/generated/slcmap-config.cmake
  ${PROJECT_BINARY_DIR}/generated/slcmap-config-version.cmake
  DESTINATION ${SLCMAP_CMAKE} COMPONENT development)

# Debian packages: `cpack -G DEB` in the build folder.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "The slcmap authors <slcmap@example.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Maps buildings from a stereo camera and an IMU")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME slcmap)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libslcmap-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
# The page and the rigs of the simulator are the program's. A module is for one version of Python.
if(SLCMAP_BUILD_PYTHON)
  set(modules lib/python3/dist-packages)
  install(TARGETS slcmap_python DESTINATION ${modules}/slcmap COMPONENT python)
  install(DIRECTORY apps/python/slcmap DESTINATION ${modules} COMPONENT python
    FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN "py.typed")
  install(DIRECTORY apps/python/examples DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-slcmap
    COMPONENT python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-slcmap)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  math(EXPR next_minor "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "slcmap (= ${PROJECT_VERSION}), python3-numpy, \
python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), \
python3 (<< ${Python_VERSION_MAJOR}.${next_minor})")
endif()
# What slcmap-config.cmake looks for.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4), libopencv-dev (>= 4.6), \
libopencv-contrib-dev (>= 4.6), libceres-dev (>= 2.1), libyaml-cpp-dev, libspdlog-dev, libfmt-dev, \
libpcl-dev (>= 1.13), libgeos-dev, libproj-dev, libcairo2-dev, libmetis-dev, liboctomap-dev, libtinygltf-dev, \
zlib1g-dev, liblz4-dev, libbz2-dev, libzstd-dev, libsqlite3-dev, \
libavformat-dev, libavcodec-dev, libavutil-dev, libswscale-dev")
include(CPack)
