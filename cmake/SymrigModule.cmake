# SPDX-License-Identifier: Apache-2.0
# A module of libsymrig is a library of its own: what it may include is what it links.

# symrig_module(name [COMPUTES] [LINKS module...] [PACKAGES target...]): the library symrig_<name>, made of every .cpp below the
# caller's folder. COMPUTES: it spends time on every pixel or leaf, so it is compiled for speed; the others for a short build.
# LINKS: the modules and parts of ours that it includes; tools/check-layers holds the #include lines against them.
# PACKAGES: libraries of others that it uses; its headers show none of them.
function(symrig_module name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "COMPUTES" "" "LINKS;PACKAGES")
  set(target symrig_${name})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  add_library(${target} STATIC ${sources})
  add_library(symrig::${name} ALIAS ${target})
  symrig_options(${target})
  # A build for the fuzzer spends its time in what the fuzzer watches.
  if(SYMRIG_FUZZ AND name IN_LIST SYMRIG_FUZZED)
    set(arg_COMPUTES ON)
  elseif(SYMRIG_FUZZ)
    set(arg_COMPUTES OFF)
  endif()
  if(NOT arg_COMPUTES)
    symrig_quick_to_compile(${target})
  elseif(SYMRIG_SANITIZE MATCHES address AND NOT SYMRIG_FUZZ)
    # -Og inlines nothing: each v[i] is then a call, and the tests take several times as long.
    target_compile_options(${target} PRIVATE -O1)
  endif()
  set_target_properties(${target} PROPERTIES SYMRIG_COMPUTES "${arg_COMPUTES}")
  target_include_directories(${target}
    PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/host/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${PROJECT_SOURCE_DIR}/host/src)
  list(TRANSFORM arg_LINKS PREPEND symrig_)
  target_link_libraries(${target} PUBLIC ${arg_LINKS} PRIVATE ${arg_PACKAGES})
  install(TARGETS ${target} EXPORT symrigTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  target_link_libraries(symrig INTERFACE ${target})
endfunction()
