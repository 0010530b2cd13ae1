// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gpio.hpp"

#include <cstdint>

namespace symrig::board_linux {

/// Sets the outputs to their safe levels if the process crashes: SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT
/// (including std::terminate). It cannot help against SIGKILL, a stopped kernel, or power loss.
class Emergency {
 public:
  /// Active until it is destroyed. Only one may exist at a time. gpio must outlive it.
  explicit Emergency(Gpio& gpio);
  ~Emergency();
  Emergency(const Emergency&) = delete;
  Emergency& operator=(const Emergency&) = delete;

  static void set_safe(std::uint32_t levels);
};

}  // namespace symrig::board_linux
