// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/settings.hpp"

namespace symrig::pico {

/// The flash chip's own 8-byte number. Before anything else runs; zeros if there is no boot ROM to ask it.
void read_unique_id(uint8_t (&id)[8]);

/// Two sectors at the end of flash that take turns: each holds a record with a sequence number and a CRC, the
/// sound one with the higher number counts.
class PicoSettings final : public hal::Settings {
 public:
  size_t load(uint8_t* out, size_t room) const override;
  bool save(const uint8_t* bytes, size_t size) override;
};

}  // namespace symrig::pico
