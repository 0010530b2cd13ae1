# SPDX-License-Identifier: Apache-2.0
# Warnings, sanitizers and language level, given to every target of ours through symrig_options(target).

set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

find_program(SYMRIG_CCACHE ccache)
if(SYMRIG_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_C_COMPILER_LAUNCHER ${SYMRIG_CCACHE})
  # ccache takes precompiled headers only if it may trust what CMake says of them. Paths count from the source folder, so that
  # a second checkout finds what the first one compiled.
  set(CMAKE_CXX_COMPILER_LAUNCHER env CCACHE_SLOPPINESS=pch_defines,time_macros CCACHE_BASEDIR=${PROJECT_SOURCE_DIR}
    CCACHE_NOHASHDIR=1 ${SYMRIG_CCACHE})
endif()

# A sanitized test is 120 MB. GNU ld needs 5 s of a processor to link it, LLVM's linker 2 s.
find_program(SYMRIG_LLD ld.lld)
if(SYMRIG_UNITY AND SYMRIG_LLD AND NOT CMAKE_CROSSCOMPILING)
  add_link_options(-fuse-ld=lld)
endif()

# AddressSanitizer describes each global variable with pointers: a million in the command. In a program that may lie anywhere, the
# loader corrects each at every start. That is a third of the time of a short command.
if(SYMRIG_SANITIZE MATCHES address AND NOT SYMRIG_FUZZ AND NOT CMAKE_CROSSCOMPILING)
  string(APPEND CMAKE_EXE_LINKER_FLAGS " -no-pie")
endif()

function(symrig_options target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "FREESTANDING" "" "")
  if(arg_FREESTANDING)
    # Firmware: C++17, nothing that allocates, throws or needs run-time type information.
    target_compile_features(${target} PUBLIC cxx_std_17)
    target_compile_options(${target} PRIVATE $<$<COMPILE_LANGUAGE:CXX>:-fno-exceptions -fno-rtti -fno-threadsafe-statics>)
  else()
    target_compile_features(${target} PUBLIC cxx_std_20)
  endif()
  # No fused multiply-add behind our back (results are the same on every machine of one ISA) and never -ffast-math.
  target_compile_options(${target} PRIVATE -ffp-contract=off -fno-math-errno -Wall -Wextra -Wpedantic -Wshadow
    -Wconversion -Wno-sign-conversion $<$<COMPILE_LANGUAGE:CXX>:-Wnon-virtual-dtor -Woverloaded-virtual>)
  if(SYMRIG_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  symrig_sanitize(${target} ${ARGN})
endfunction()

# symrig_quick_to_compile(target): commands, tests and modules that do not compute spend their time in the modules that do.
# Those are compiled for speed, these for a short build.
function(symrig_quick_to_compile target)
  if(SYMRIG_SANITIZE)
    target_compile_options(${target} PRIVATE -O0)
  else()
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  endif()
endfunction()

# symrig_unity(target [HEADERS header... | HEADERS_OF target]): with SYMRIG_UNITY, the files of one folder are compiled as one,
# because most of the time that a file takes is that of its headers. So no two files of a folder have a name of an unnamed
# namespace in common. Kernels that Highway compiles once for each instruction set stay alone. HEADERS are precompiled for
# them; HEADERS_OF: those of another target that is compiled alike. Call it when the target has all its sources.
function(symrig_unity target)
  if(NOT SYMRIG_UNITY)
    return()
  endif()
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "HEADERS_OF" "HEADERS")
  if(arg_HEADERS_OF)
    target_precompile_headers(${target} REUSE_FROM ${arg_HEADERS_OF})
  elseif(arg_HEADERS)
    target_precompile_headers(${target} PRIVATE ${arg_HEADERS})
  endif()
  get_target_property(sources ${target} SOURCES)
  get_target_property(folder ${target} SOURCE_DIR)
  foreach(source IN LISTS sources)
    get_filename_component(path ${source} ABSOLUTE BASE_DIR ${folder})
    if(NOT path MATCHES "\\.cpp$" OR NOT EXISTS ${path})
      continue()
    endif()
    file(STRINGS ${path} kernel REGEX "foreach_target\\.h")
    if(NOT kernel)
      get_filename_component(group ${path} DIRECTORY)
      file(RELATIVE_PATH group ${PROJECT_SOURCE_DIR} ${group})
      string(MAKE_C_IDENTIFIER ${group} group)
      set_source_files_properties(${source} TARGET_DIRECTORY ${target} PROPERTIES UNITY_GROUP ${group})
    endif()
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()

# symrig_test_options(target [COMPUTES]): for programs of tests. UndefinedBehaviorSanitizer watches the product, not its tests: that
# takes a quarter of the time that a sanitized test takes to compile. COMPUTES: also a sanitized build compiles it for speed.
function(symrig_test_options target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "COMPUTES" "" "")
  symrig_options(${target})
  if(arg_COMPUTES AND SYMRIG_SANITIZE)
    target_compile_options(${target} PRIVATE -O1)
  else()
    symrig_quick_to_compile(${target})
  endif()
  if(SYMRIG_SANITIZE MATCHES undefined)
    target_compile_options(${target} PRIVATE -fno-sanitize=undefined)
  endif()
endfunction()

# symrig_sanitize(target [FREESTANDING]): the build's sanitizers.
function(symrig_sanitize target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "FREESTANDING" "" "")
  if(NOT SYMRIG_SANITIZE)
    return()
  endif()
  # vptr checks need run-time type information, which firmware is built without.
  target_compile_options(${target} PUBLIC -fsanitize=${SYMRIG_SANITIZE} -fno-sanitize=vptr -fno-omit-frame-pointer
    -fno-sanitize-recover=all)
  target_link_options(${target} PUBLIC -fsanitize=${SYMRIG_SANITIZE})
  # Checking each pointer for null and alignment takes a quarter of the compiling time. AddressSanitizer reports null too. What
  # also runs on microcontrollers (firmware, protocol) keeps both checks, and so does the build for the fuzzer.
  if(SYMRIG_SANITIZE MATCHES undefined AND NOT arg_FREESTANDING AND NOT SYMRIG_FUZZ)
    target_compile_options(${target} PRIVATE -fno-sanitize=null,alignment)
  endif()
endfunction()
