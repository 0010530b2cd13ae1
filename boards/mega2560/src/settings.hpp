// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/settings.hpp"

namespace symrig::mega2560 {

/// Two places in the EEPROM. save() fills the older one, and its number is written last: a loss of power
/// leaves the other record.
class MegaSettings final : public hal::Settings {
 public:
  size_t load(uint8_t* out, size_t room) const override;
  /// Takes 3.4 ms for each byte that changes (data sheet table 7-1), and feeds the watchdog meanwhile.
  bool save(const uint8_t* bytes, size_t size) override;
};

}  // namespace symrig::mega2560
