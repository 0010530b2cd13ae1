// SPDX-License-Identifier: Apache-2.0
#ifndef EXPECT_H
#define EXPECT_H

#include <stdio.h>

/* Counts what is not so, and goes on. Each C test has its own count. */
static int failures = 0;

#define EXPECT(condition)                                                     \
  do {                                                                        \
    if (!(condition)) {                                                       \
      fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
      ++failures;                                                             \
    }                                                                         \
  } while (0)

#endif
