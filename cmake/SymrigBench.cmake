# SPDX-License-Identifier: Apache-2.0
# Jobs of the virtual bench (tests/bench-vm) as tests of ctest.

# Asked for once: whether a build like this one has them. They test how programs meet a kernel, which a second build or a
# sanitizer on the host side does not change; a job that is about memory errors says SANITIZED.
set(SYMRIG_BENCH_VM_HERE OFF)
if(CMAKE_HOST_SYSTEM_PROCESSOR STREQUAL x86_64 AND CMAKE_BUILD_TYPE STREQUAL Release AND NOT SYMRIG_SANITIZE)
  set(SYMRIG_BENCH_VM_HERE ON)
endif()

# symrig_bench_job(NAME name LANE a|b [SLOW k] [WITH device...] [USER name] [OUT folder] [TIMEOUT seconds] [LANDING] [SANITIZED] [ABOUT folder...] COMMAND ...)
# registers bench.<name>: COMMAND in a guest with these devices, in the build's folder of the caller. One guest of lane a at a
# time, because its time is the wall's; a machine that cannot have the bench shows the job as skipped.
# TIMEOUT: seconds on a machine with nothing else to do, 120 unless given. A job that hangs is ended after four times as long,
# since a busy machine takes several times as long for all of it.
# LANDING: a landing runs it in any case, not only if its code has changed. ABOUT: as for symrig_about (tests/CMakeLists.txt).
# SANITIZED: also in builds with a sanitizer; ONLY_SANITIZED: in no other.
function(symrig_bench_job)
  cmake_parse_arguments(PARSE_ARGV 0 job "LANDING;SANITIZED;ONLY_SANITIZED" "NAME;LANE;SLOW;USER;OUT;TIMEOUT" "WITH;ABOUT;COMMAND")
  if(SYMRIG_SANITIZE)
    if(NOT job_SANITIZED AND NOT job_ONLY_SANITIZED)
      return()
    endif()
  elseif(NOT SYMRIG_BENCH_VM_HERE OR job_ONLY_SANITIZED)
    return()
  endif()
  if(NOT job_TIMEOUT)
    set(job_TIMEOUT 120)
  endif()
  math(EXPR limit "4 * ${job_TIMEOUT}")
  set(options --lane ${job_LANE} --timeout ${limit})
  if(job_WITH)
    list(JOIN job_WITH "," devices)
    list(APPEND options --with ${devices})
  endif()
  foreach(option SLOW USER OUT)
    if(job_${option})
      string(TOLOWER ${option} word)
      list(APPEND options --${word} ${job_${option}})
    endif()
  endforeach()
  add_test(NAME bench.${job_NAME} COMMAND ${PROJECT_SOURCE_DIR}/tests/bench-vm/run ${options} -- ${job_COMMAND}
    WORKING_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
  # The runner ends a job that takes too long, and says where the guest was; ctest's limit only stands behind it.
  math(EXPR limit "${limit} + 60")
  set_tests_properties(bench.${job_NAME} PROPERTIES LABELS bench SKIP_RETURN_CODE 77 TIMEOUT ${limit}
    FIXTURES_REQUIRED bench_vm)
  if(NOT job_LANDING)
    symrig_in_full(bench.${job_NAME})
  endif()
  symrig_about(FOLDERS ${job_ABOUT} TESTS bench.${job_NAME})
  if(job_LANE STREQUAL a)
    set_tests_properties(bench.${job_NAME} PROPERTIES RESOURCE_LOCK bench_wall_time)
  endif()
endfunction()

# symrig_guest_programs(target...): programs of jobs that are not SANITIZED. A build with a sanitizer does not wait for them.
function(symrig_guest_programs)
  if(SYMRIG_SANITIZE)
    set_target_properties(${ARGN} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
endfunction()
