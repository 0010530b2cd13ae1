// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::projector::dlp {

/// A HID report has 64 bytes in both directions, without a report number.
inline constexpr std::size_t kReportBytes = 64;
using Report = std::array<std::uint8_t, kReportBytes>;

/// Carries reports to a controller and back. Tests put an emulated controller behind it.
class HidTransport {
 public:
  HidTransport() = default;
  HidTransport(const HidTransport&) = delete;
  HidTransport& operator=(const HidTransport&) = delete;
  virtual ~HidTransport() = default;

  /// fails: device_lost (unplugged).
  virtual Result<void> write(const Report& report) = 0;
  /// Waits for a report. fails: timeout (none came within `patience`), device_lost.
  virtual Result<Report> read(Nanoseconds patience) = 0;
  /// For messages: "DLPC350 at /dev/hidraw0".
  virtual std::string name() const = 0;
};

/// A kind of controller that symrig drives, with its USB numbers.
struct ControllerKind {
  std::string_view name;
  std::uint16_t vendor, product;
  bool operator==(const ControllerKind&) const = default;
};

inline constexpr ControllerKind kDlpc350{"DLPC350", 0x0451, 0x6401};
inline constexpr ControllerKind kDlpc900{"DLPC900", 0x0451, 0xC900};
inline constexpr std::array kControllerKinds{kDlpc350, kDlpc900};

/// A controller on this computer's USB.
struct FoundController {
  ControllerKind kind;
  std::string path;     ///< "/dev/hidraw0"
  std::string maker;    ///< as the device says
  std::string product;  ///< as the device says
  std::string serial;   ///< may be empty
};

/// Lists the controllers. Changes nothing. Empty in a build without hidapi.
std::vector<FoundController> find_controllers();

/// The error if nothing of this name is at a path, or anywhere: device_lost; device_refused if this build has
/// no hidapi.
Error missing(std::string_view name, const std::string& path);

/// path: "/dev/hidraw0"; empty: the only controller of this kind.
/// fails: as missing(), device_lost (no permission, or in use), bad_argument (several match).
Result<std::unique_ptr<HidTransport>> open_transport(const ControllerKind& kind, const std::string& path);

/// The data of a message. Numbers have their low byte first.
using Bytes = std::vector<std::uint8_t>;

inline std::uint16_t half(const Bytes& bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8U);
}

inline std::uint32_t word(const Bytes& bytes, std::size_t at) {
  return half(bytes, at) | std::uint32_t{half(bytes, at + 2)} << 16U;
}

/// Appends the lowest `count` bytes of a number.
inline void append(Bytes& bytes, std::uint32_t value, unsigned count) {
  for (unsigned k = 0; k < count; ++k) bytes.push_back(static_cast<std::uint8_t>(value >> 8U * k));
}

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

/// Flags of a message (DLPU010 and DLPU018, "USB Interface").
inline constexpr std::uint8_t kRead = 0x80;        ///< else a write
inline constexpr std::uint8_t kReplyAsked = 0x40;  ///< the host wants a reply
inline constexpr std::uint8_t kRefused = 0x20;     ///< in a reply: the controller refused the command
inline constexpr std::size_t kHeadBytes = 4;       ///< flags, number, length in two bytes

/// A message in reports: flags, number, length (low byte first), command (CMD3 first), data. A longer message
/// goes on in the next report without a head.
std::vector<Report> message_reports(std::uint8_t flags, std::uint8_t number,
                                    std::span<const std::uint8_t> body);
/// The body of a command: its two bytes, CMD3 first, then its data.
Bytes command_body(Command command, std::span<const std::uint8_t> data);

/// Sends one command at a time to a controller and waits for its reply.
///
/// Every message has a number, and a reply repeats it. A reply with another number is one that came too late
/// for an earlier command: it is read and dropped.
class Dialogue {
 public:
  /// firmware: the major version for which symrig was written.
  Dialogue(std::unique_ptr<HidTransport> transport, int firmware,
           Nanoseconds patience = Nanoseconds{1'000'000'000});

  /// fails: timeout (no reply), device_refused (the controller refused the command), device_lost, protocol (a
  /// reply with fewer bytes than `least`).
  Result<Bytes> read(Command command, std::size_t least);
  Result<void> write(Command command, std::span<const std::uint8_t> data);
  /// The same with one byte.
  Result<void> write(Command command, std::uint8_t byte) { return write(command, {&byte, 1}); }

  std::string name() const { return transport_->name(); }

 private:
  struct Reply {
    bool refused = false;
    Bytes data;
  };
  Result<Reply> exchange(std::uint8_t flags, Command command, std::span<const std::uint8_t> data);
  Result<Reply> reply(Command command);
  Error silent(Command command) const;
  std::string other_firmware() const;

  std::unique_ptr<HidTransport> transport_;
  int firmware_;
  Nanoseconds patience_;
  std::uint8_t number_ = 0;
};

}  // namespace symrig::projector::dlp
