# SPDX-License-Identifier: Apache-2.0
# The Python that the package symrig is for, and pybind11. SYMRIG_PYTHON_FOUND: both are there.
# The system's Python, unless -DPython3_EXECUTABLE says another: an interpreter that comes first in PATH may have no numpy.
if(NOT Python3_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python3_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "The Python that the package symrig is for")
endif()
set(SYMRIG_PYTHON_FOUND OFF)
if(CMAKE_CROSSCOMPILING OR SYMRIG_BOARD OR SYMRIG_FUZZ)
  return()
endif()
# GCC's run-time of AddressSanitizer is a library that can be loaded before Python (tests/python). ThreadSanitizer would
# report the interpreter's own threads.
if(SYMRIG_SANITIZE AND NOT (SYMRIG_SANITIZE MATCHES address AND CMAKE_CXX_COMPILER_ID STREQUAL GNU))
  return()
endif()
find_package(Python3 3.9 QUIET COMPONENTS Interpreter Development.Module NumPy)
set(PYBIND11_NOPYTHON ON)  # it would look for another Python
find_package(pybind11 2.10 QUIET)
if(Python3_Development.Module_FOUND AND Python3_NumPy_FOUND AND pybind11_FOUND)
  set(SYMRIG_PYTHON_FOUND ON)
endif()
