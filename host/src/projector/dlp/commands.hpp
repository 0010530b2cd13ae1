// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace symrig::projector::dlp {

/// The commands that symrig uses. The high byte is CMD2, the low byte is CMD3. A command means the same to
/// both controllers, if its comment names none. The bytes after a command may differ.
///
/// Sources: DLPC350: DLPU010 (Programmer's Guide), chapter 2, as TI's published interface library repeats it
/// (dlpc350_api.cpp, Texas Instruments 2015). DLPC900: DLPU018J (Programmer's Guide), chapter 2 and appendix
/// A. docs/howto-projectors.md says what was not checked on hardware.
enum class Command : std::uint16_t {
  power = 0x0200,            ///< 1 byte, bits 1:0: 0 = normal, else standby
  version = 0x0205,          ///< 4 words: application, interface, configuration, sequences
  hardware_type = 0x0206,    ///< DLPC900: 1 byte: the mirrors; 31 characters
  signal = 0x071C,           ///< DLPC350, 28 bytes: the video signal
  led_current = 0x0B01,      ///< 3 bytes: red, green, blue
  source = 0x1A00,           ///< 1 byte: bits 2:0 the port, bits 7:3 its width
  receiver = 0x1A01,         ///< DLPC900: 1 byte: the connector that the board's video receiver takes
  led_enable = 0x1A07,       ///< 1 byte: bits 0..2 red, green, blue; bit 3: by the sequencer
  hardware_status = 0x1A0A,  ///< 1 byte
  system_status = 0x1A0B,    ///< 1 byte
  main_status = 0x1A0C,      ///< 1 byte
  validate = 0x1A1A,         ///< DLPC350; write: begin; read: 1 byte, bit 7: not ready
  display_mode = 0x1A1B,     ///< 1 byte: 0 = video; DLPC350: 1 = patterns; DLPC900: 2 = video patterns
  trigger_out_1 = 0x1A1D,    ///< inverted, rising delay, falling delay
  trigger_out_2 = 0x1A1E,    ///< inverted, rising delay; DLPC900: falling delay
  pattern_source = 0x1A22,   ///< DLPC350, 1 byte: 0 = video port, 3 = flash
  trigger_mode = 0x1A23,     ///< DLPC350, 1 byte: 0 = VSYNC begins the sequence
  run = 0x1A24,              ///< 1 byte: 0 = stop, 1 = pause, 2 = start; DLPC900: only written
  exposure = 0x1A29,         ///< DLPC350, 2 words in microseconds: exposure, period
  invert = 0x1A30,           ///< DLPC350, 1 byte: 1 = a 0 is bright
  pattern_count = 0x1A31,    ///< entries of the table, and how often they are shown
  table_address = 0x1A32,    ///< DLPC350, 1 byte: first entry to write or read
  table_open = 0x1A33,       ///< DLPC350, 1 byte: 0 = close, 1 = images, 2 = patterns
  table_data = 0x1A34,       ///< DLPC350: 3 bytes an entry; DLPC900: 12 bytes an entry, only written
  source_timing = 0x1A3C,    ///< DLPC900, 18 bytes: the video signal
};

}  // namespace symrig::projector::dlp
