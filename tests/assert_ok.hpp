// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

/// Stops the test with the error's line if a Result is not a success.
#define ASSERT_OK(expression)                           \
  do {                                                  \
    const auto& result_of = (expression);               \
    if (!result_of) FAIL() << result_of.error().line(); \
  } while (false)
