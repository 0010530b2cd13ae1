# SPDX-License-Identifier: Apache-2.0
# A module of libsymrig is a library of its own: what it may include is what it links.

# symrig_module(name [LINKS module...] [PACKAGES target...] [ALONE file...]): the library symrig_<name>, made of every .cpp below the
# caller's folder. LINKS: the modules and parts of ours that it includes; tools/check-layers holds the #include lines against them.
# PACKAGES: libraries of others that it uses; its headers show none of them. ALONE: as in symrig_alone.
function(symrig_module name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "LINKS;PACKAGES;ALONE")
  set(target symrig_${name})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  add_library(${target} STATIC ${sources})
  add_library(symrig::${name} ALIAS ${target})
  symrig_options(${target})
  target_include_directories(${target}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/host/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${PROJECT_SOURCE_DIR}/host/src)
  list(TRANSFORM arg_LINKS PREPEND symrig_)
  target_link_libraries(${target} PUBLIC ${arg_LINKS} PRIVATE ${arg_PACKAGES})
  install(TARGETS ${target} EXPORT symrigTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  target_link_libraries(symrig INTERFACE ${target})
  symrig_alone(${target} ${arg_ALONE})
endfunction()
