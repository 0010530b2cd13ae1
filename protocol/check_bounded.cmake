# SPDX-License-Identifier: Apache-2.0
# Fails the build if a field of symrig.proto has no bound: nanopb would make it a callback.
file(READ ${HEADER} text)
if(text MATCHES "pb_callback_t|X\\(a, *(CALLBACK|POINTER)")
  file(REMOVE ${HEADER})
  message(FATAL_ERROR "a field of symrig.proto has no bound (callback or pointer in ${HEADER}): give it max_size or "
    "max_count in symrig.options")
endif()
