// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/diagnostics.hpp"

namespace symrig::hal {

/// Why the board started. Values are those of the wire.
enum class ResetCause : uint8_t { power = 0, pin = 1, watchdog = 2, request = 3 };

/// The chip as a whole.
class System {
 public:
  virtual ResetCause reset_cause() const = 0;
  /// Restarts the chip; in the boot loader, if requested and present. May return before the restart.
  virtual void reboot(bool bootloader) = 0;
  /// false: the board measures nothing about itself.
  virtual bool diagnose(Diagnostics& /*out*/) const { return false; }

 protected:
  ~System() = default;
};

}  // namespace symrig::hal
