# SPDX-License-Identifier: Apache-2.0
# Warnings, sanitizers and language level, given to every target of ours through symrig_options(target).

set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_C_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

find_program(SYMRIG_CCACHE ccache)
if(SYMRIG_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_C_COMPILER_LAUNCHER ${SYMRIG_CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SYMRIG_CCACHE})
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
  symrig_sanitize(${target})
endfunction()

function(symrig_sanitize target)
  if(SYMRIG_SANITIZE)
    # vptr checks need run-time type information, which firmware is built without.
    target_compile_options(${target} PUBLIC -fsanitize=${SYMRIG_SANITIZE} -fno-sanitize=vptr -fno-omit-frame-pointer
      -fno-sanitize-recover=all)
    target_link_options(${target} PUBLIC -fsanitize=${SYMRIG_SANITIZE})
  endif()
endfunction()
