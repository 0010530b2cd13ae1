# SPDX-License-Identifier: Apache-2.0
# What is installed beside the libraries, and the CMake package. What libsymrig links of ours (protocol, firmware core, simulated
# board) joins the export set symrigTargets in its own folder. Included last, when every target exists.
# Components, for `cmake --install BUILD --component NAME`; debian/*.install has the same parts:
#   library      the shared library with the C interface
#   development  headers, static C++ libraries, the CMake package, the pkg-config file
#   command      symrig, its manual pages and completions, device profiles, udev rules
#   python       the Python package
#   board        symrigd (boards/linux)
#   mpi          symrig-mpi
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/symrig)
install(EXPORT symrigTargets NAMESPACE symrig:: DESTINATION ${package_dir} COMPONENT development)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/host/include/symrig DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
  FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h" PATTERN internal EXCLUDE)
if(TARGET symrig_cli)
  install(TARGETS symrig_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT command)
endif()
# Who may open a board: read by udev where the prefix is /usr or /usr/local; else copy it to /etc/udev/rules.d.
install(FILES ${PROJECT_SOURCE_DIR}/host/udev/60-symrig.rules DESTINATION lib/udev/rules.d COMPONENT command)
install(FILES ${PROJECT_SOURCE_DIR}/host/udev/61-symrig-group.rules DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT command)

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/symrigConfig.cmake.in
  ${PROJECT_BINARY_DIR}/symrigConfig.cmake INSTALL_DESTINATION ${package_dir})
# Before 1.0 a minor version may break its users.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/symrigConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/symrigConfig.cmake ${PROJECT_BINARY_DIR}/symrigConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/SymrigDependencies.cmake DESTINATION ${package_dir} COMPONENT development)
# The pkg-config file has the prefix of this install, for any --prefix. A relative one is meant from where the command ran.
install(CODE "
  get_filename_component(CMAKE_INSTALL_PREFIX \"\${CMAKE_INSTALL_PREFIX}\" ABSOLUTE)
  set(CMAKE_INSTALL_INCLUDEDIR \"${CMAKE_INSTALL_INCLUDEDIR}\")
  set(CMAKE_INSTALL_LIBDIR \"${CMAKE_INSTALL_LIBDIR}\")
  set(PROJECT_HOMEPAGE_URL \"${PROJECT_HOMEPAGE_URL}\")
  set(PROJECT_VERSION \"${PROJECT_VERSION}\")
  configure_file(\"${PROJECT_SOURCE_DIR}/cmake/symrig.pc.in\" \"${PROJECT_BINARY_DIR}/symrig.pc\" @ONLY)"
  COMPONENT development)
install(FILES ${PROJECT_BINARY_DIR}/symrig.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development)
