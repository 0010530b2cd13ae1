// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace symrig::projector::dlpc350 {

/// The commands that symrig uses. The high byte is CMD2, the low byte is CMD3.
///
/// Source: DLPU010 (DLPC350 Programmer's Guide), chapter 2, as TI's published interface library repeats it
/// (dlpc350_api.cpp, Texas Instruments 2015). docs/howto-projectors.md says what was not checked on hardware.
enum class Command : std::uint16_t {
  power = 0x0200,            ///< 1 byte, bits 1:0: 0 = normal, else standby
  version = 0x0205,          ///< 4 words: application, interface, configuration, sequences
  signal = 0x071C,           ///< 28 bytes: the video signal
  led_current = 0x0B01,      ///< 3 bytes: red, green, blue
  source = 0x1A00,           ///< 1 byte: bits 2:0 the port, bits 7:3 its width
  led_enable = 0x1A07,       ///< 1 byte: bits 0..2 red, green, blue; bit 3: by the sequencer
  hardware_status = 0x1A0A,  ///< 1 byte
  system_status = 0x1A0B,    ///< 1 byte
  main_status = 0x1A0C,      ///< 1 byte
  validate = 0x1A1A,         ///< write: begin; read: 1 byte, bit 7: not ready
  display_mode = 0x1A1B,     ///< 1 byte: 0 = video, 1 = patterns
  trigger_out_1 = 0x1A1D,    ///< 3 bytes: inverted, rising delay, falling delay
  trigger_out_2 = 0x1A1E,    ///< 2 bytes: inverted, rising delay
  pattern_source = 0x1A22,   ///< 1 byte: 0 = video port, 3 = flash
  trigger_mode = 0x1A23,     ///< 1 byte: 0 = VSYNC begins the sequence
  run = 0x1A24,              ///< 1 byte: 0 = stop, 1 = pause, 2 = start
  exposure = 0x1A29,         ///< 2 words in microseconds: exposure, period
  invert = 0x1A30,           ///< 1 byte: 1 = a 0 is bright
  pattern_count =
      0x1A31,  ///< 4 bytes, each minus 1 but the second: entries, repeat, patterns a TRIG_OUT_2, images
  table_address = 0x1A32,  ///< 1 byte: first entry to write or read
  table_open = 0x1A33,     ///< 1 byte: 0 = close, 1 = images, 2 = patterns
  table_data = 0x1A34,     ///< 3 bytes an entry
};

}  // namespace symrig::projector::dlpc350
