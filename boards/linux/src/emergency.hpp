// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gpio.hpp"

#include <cstdint>

namespace symrig::board_linux {

/// Outputs go to their safe levels when the process breaks down: SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT (so
/// also std::terminate). Nothing can be done about SIGKILL, a stopped kernel, or power.
class Emergency {
 public:
  /// From here on, until it goes. There is one at a time; gpio outlives it.
  explicit Emergency(Gpio& gpio);
  ~Emergency();
  Emergency(const Emergency&) = delete;
  Emergency& operator=(const Emergency&) = delete;

  static void set_safe(std::uint32_t levels);
};

}  // namespace symrig::board_linux
