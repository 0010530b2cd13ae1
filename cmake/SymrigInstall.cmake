# SPDX-License-Identifier: Apache-2.0
# The CMake package: libsymrig and its headers. What it links of ours (protocol, firmware core, simulated board) joins
# the export set symrigTargets in its own folder. Included last, when every target exists.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/symrig)
install(EXPORT symrigTargets NAMESPACE symrig:: DESTINATION ${package_dir})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/host/include/symrig DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h")
if(TARGET symrig_cli)
  install(TARGETS symrig_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
# Who may open a board: read by udev where the prefix is /usr or /usr/local; else copy it to /etc/udev/rules.d.
install(FILES ${PROJECT_SOURCE_DIR}/host/udev/60-symrig.rules DESTINATION lib/udev/rules.d)
install(FILES ${PROJECT_SOURCE_DIR}/host/udev/61-symrig-group.rules DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/symrigConfig.cmake.in
  ${PROJECT_BINARY_DIR}/symrigConfig.cmake INSTALL_DESTINATION ${package_dir})
# Before 1.0 a minor version may break its users.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/symrigConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/symrigConfig.cmake ${PROJECT_BINARY_DIR}/symrigConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/SymrigDependencies.cmake DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
