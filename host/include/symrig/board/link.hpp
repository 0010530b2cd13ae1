// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/clock_time.hpp"
#include "symrig/board/device_uri.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace symrig::board_sim {
class SimBoard;
}

namespace symrig {

/// A pipe of bytes to one board, with its own clock: real time on a cable, virtual time in this process.
class Link {
 public:
  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  /// Sends all bytes. fails: device_lost.
  virtual Result<void> send(std::span<const std::uint8_t> bytes) = 0;
  /// Waits until bytes arrive. Returns an empty result after `timeout`. fails: device_lost.
  virtual Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) = 0;
  /// Time on the link's clock since it was opened.
  virtual Nanoseconds now() const = 0;
  /// When the link was opened, on this machine's clock: now() counts from there. A link in virtual time uses
  /// the clock of that virtual time instead.
  virtual SteadyTime opened() const { return {}; }
  /// Opening the link may restart the board, which then needs so long. A boot loader that hears bytes
  /// meanwhile may stay, so the first question is asked once, and the next one after a silence of this
  /// length.
  virtual Nanoseconds restart_time() const { return Nanoseconds{0}; }
};

/// A link to a board in virtual time in this process. Waiting advances the board's clock. The board must
/// outlive the link.
std::unique_ptr<Link> make_sim_link(board_sim::SimBoard& board);

/// A link to the board at `uri`. sim: makes a new board with a 60 Hz projector and a camera on its lines; it
/// lives as long as the link. The link locks a serial port or a USB interface: no other program of symrig can
/// open it meanwhile.
/// fails: device_lost (no board, no permission, in use, connection refused; the message says which),
/// bad_argument (a baud rate that the system does not know, a path that is too long), unknown_name (a line of
/// the jumper), protocol (a virtual link of another version).
Result<std::unique_ptr<Link>> open_link(const DeviceUri& uri);

}  // namespace symrig
