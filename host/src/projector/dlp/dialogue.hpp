// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/dlp/bytes.hpp"
#include "projector/dlp/commands.hpp"
#include "projector/dlp/hid_transport.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace symrig::projector::dlp {

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
