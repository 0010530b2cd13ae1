# SPDX-License-Identifier: Apache-2.0
# cmake -DBUILD= -DSOURCE= -DPROBE= -DC_EXAMPLE= -DWORK= -DBUILD_TYPE= -DGENERATOR= -DCXX= -DC= -P install_test.cmake
set(prefix ${WORK}/prefix)
file(REMOVE_RECURSE ${WORK})

function(step what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE printed ERROR_VARIABLE printed)
  message("${what}: ${ARGN}\n${printed}")
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${what} failed (${code})")
  endif()
endfunction()

step("install" ${CMAKE_COMMAND} --install ${BUILD} --prefix ${prefix})
# Nothing installed may point back at the tree that it was built in.
file(GLOB_RECURSE cmake_files ${prefix}/*.cmake)
get_filename_component(tree ${SOURCE}/../../.. ABSOLUTE)
foreach(file IN LISTS cmake_files)
  file(STRINGS ${file} back REGEX "${tree}/(host|protocol|hal|firmware|boards|build|\\.deps)")
  if(back)
    message(FATAL_ERROR "${file} points into the build tree: ${back}")
  endif()
endforeach()

# Every file belongs to one of the components that cmake/SymrigInstall.cmake lists.
file(GLOB_RECURSE whole RELATIVE ${prefix} ${prefix}/*)
set(parts "")
foreach(component library development command python board mpi)
  step("install ${component}" ${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/${component} --component ${component})
  file(GLOB_RECURSE part RELATIVE ${WORK}/${component} ${WORK}/${component}/*)
  list(APPEND parts ${part})
endforeach()
list(SORT whole)
list(SORT parts)
if(NOT whole STREQUAL parts)
  list(REMOVE_ITEM whole ${parts})
  message(FATAL_ERROR "files of no component, or of two: ${whole} (all components: ${parts})")
endif()

# A prefix may be relative to the folder where it is typed.
step("install below here" ${CMAKE_COMMAND} -E chdir ${WORK} ${CMAKE_COMMAND} --install ${BUILD} --prefix below --component development)
file(GLOB_RECURSE pc ${WORK}/below/symrig.pc)
file(STRINGS ${pc} prefix_of_pc REGEX "^prefix=")
if(NOT prefix_of_pc STREQUAL "prefix=${WORK}/below")
  message(FATAL_ERROR "symrig.pc has ${prefix_of_pc}, not the folder ${WORK}/below")
endif()

# For the C interface a C compiler and pkg-config are enough.
file(GLOB_RECURSE pc ${prefix}/symrig.pc)
get_filename_component(pc_folder ${pc} DIRECTORY)
get_filename_component(library_folder ${pc_folder} DIRECTORY)
step("a C program by pkg-config" ${CMAKE_COMMAND} -E env PKG_CONFIG_PATH=${pc_folder} sh -c
  "${C} -std=c11 -Wall -Werror ${C_EXAMPLE} -o ${WORK}/c_example $(pkg-config --cflags --libs symrig)")
step("its library" ${CMAKE_COMMAND} -E env LD_LIBRARY_PATH=${library_folder} sh -c
  "ldd ${WORK}/c_example | grep libsymrig.so.0 && ! ldd ${WORK}/c_example | grep 'not found' && {\n ${WORK}/c_example\n test $? = 2\n }")

# Every installed header stands alone, with nothing but what is installed. Those of symrig/testing need GoogleTest.
file(GLOB_RECURSE headers RELATIVE ${prefix}/include ${prefix}/include/symrig/*.hpp)
set(project "cmake_minimum_required(VERSION 3.25)\nproject(headers LANGUAGES CXX)\nfind_package(symrig REQUIRED)\nfind_package(GTest REQUIRED)\n")
string(APPEND project "file(GLOB each *.cpp)\nadd_library(headers OBJECT \${each})\ntarget_link_libraries(headers symrig::symrig GTest::gtest)\n")
file(WRITE ${WORK}/headers/CMakeLists.txt "${project}")
foreach(header IN LISTS headers)
  string(MAKE_C_IDENTIFIER ${header} name)
  file(WRITE ${WORK}/headers/${name}.cpp "#include \"${header}\"\n#include \"${header}\"\n")
endforeach()
step("configure headers" ${CMAKE_COMMAND} -S ${WORK}/headers -B ${WORK}/headers-build -G ${GENERATOR}
  -DCMAKE_BUILD_TYPE=Debug -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_C_COMPILER=${C})
step("build headers" ${CMAKE_COMMAND} --build ${WORK}/headers-build)

foreach(project ${SOURCE} ${PROBE})
  get_filename_component(name ${project} NAME)
  step("configure ${name}" ${CMAKE_COMMAND} -S ${project} -B ${WORK}/${name} -G ${GENERATOR} -DCMAKE_BUILD_TYPE=${BUILD_TYPE}
    -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${CXX} -DCMAKE_C_COMPILER=${C})
  step("build ${name}" ${CMAKE_COMMAND} --build ${WORK}/${name})
endforeach()
step("run" ${WORK}/consumer/relight)
step("laws of a probe" ${WORK}/probe/foreign_probe_test)
step("installed command" ${prefix}/bin/symrig --version)
