# SPDX-License-Identifier: Apache-2.0
# Tool chain of the boards with an AVR: avr-g++ for C++17 (Debian 13: gcc-avr 14, avr-libc). Debian 12 has 5.4, which is too old:
# tools/firmware then compiles in a Debian 13 root. docs/board-mega2560.md says why clang is not used.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR avr)
set(CMAKE_C_COMPILER avr-gcc)
set(CMAKE_CXX_COMPILER avr-g++)
set(CMAKE_OBJCOPY avr-objcopy)
set(CMAKE_NM avr-nm)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
