// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/settings.hpp"

namespace symrig::pico {

/// The flash chip's 8-byte id. Call it before anything else runs. Zeros if there is no boot ROM.
void read_unique_id(uint8_t (&id)[8]);

/// Two sectors at the end of flash are used in turn. Each holds a record with a sequence number and a CRC.
/// The valid record with the higher number is the current one.
class PicoSettings final : public hal::Settings {
 public:
  size_t load(uint8_t* out, size_t room) const override;
  bool save(const uint8_t* bytes, size_t size) override;
};

}  // namespace symrig::pico
