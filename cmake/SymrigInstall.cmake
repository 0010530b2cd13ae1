# SPDX-License-Identifier: Apache-2.0
# The CMake package: libsymrig, its headers, and the parts that it links (protocol, firmware core, simulated board).
# Included last, when every target exists.
include(CMakePackageConfigHelpers)

# symrig_installed_targets(out): symrig and every target of ours that it links, directly or not. An alias or a
# foreign package is left to SymrigDependencies.cmake.
function(symrig_installed_targets out)
  set(found)
  set(queue symrig)
  while(queue)
    list(POP_FRONT queue target)
    list(APPEND found ${target})
    get_target_property(linked ${target} LINK_LIBRARIES)
    get_target_property(passed_on ${target} INTERFACE_LINK_LIBRARIES)
    foreach(library IN LISTS linked passed_on)
      string(REGEX REPLACE "^\\$<[A-Z_]+:(.*)>$" "\\1" library "${library}")
      if(TARGET ${library})
        get_target_property(aliased ${library} ALIASED_TARGET)
        get_target_property(foreign ${library} IMPORTED)
        if(aliased)
          set(library ${aliased})
        endif()
        if(NOT foreign AND NOT library IN_LIST found AND NOT library IN_LIST queue)
          list(APPEND queue ${library})
        endif()
      endif()
    endforeach()
  endwhile()
  set(${out} ${found} PARENT_SCOPE)
endfunction()

symrig_installed_targets(targets)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/symrig)
install(TARGETS ${targets} EXPORT symrigTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT symrigTargets NAMESPACE symrig:: DESTINATION ${package_dir})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/host/include/symrig DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN "*.hpp")
if(TARGET symrig_cli)
  install(TARGETS symrig_cli RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/symrigConfig.cmake.in
  ${PROJECT_BINARY_DIR}/symrigConfig.cmake INSTALL_DESTINATION ${package_dir})
# Before 1.0 a minor version may break its users.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/symrigConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/symrigConfig.cmake ${PROJECT_BINARY_DIR}/symrigConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/SymrigDependencies.cmake DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
