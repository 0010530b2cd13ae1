// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/hal/indicator.hpp"

#include <string>

#include <fcntl.h>
#include <unistd.h>

namespace symrig::board_linux {

/// One of the kernel's LEDs (/sys/class/leds/.../brightness), or none.
class Led final : public hal::Indicator {
 public:
  explicit Led(const std::string& brightness)
      : file_(brightness.empty() ? -1 : ::open(brightness.c_str(), O_WRONLY | O_CLOEXEC)) {}

  bool ok() const { return static_cast<bool>(file_); }
  void show(bool on) override {
    if (!file_ || on == on_) return;
    on_ = on;
    [[maybe_unused]] const ssize_t written = ::pwrite(file_.get(), on ? "1" : "0", 1, 0);
  }

 private:
  Fd file_;
  bool on_ = false;
};

}  // namespace symrig::board_linux
