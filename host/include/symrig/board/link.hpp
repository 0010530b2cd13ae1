// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/board/clock_time.hpp"
#include "symrig/board/device_uri.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace symrig::boards {
class SimBoard;
}

namespace symrig {

/// A pipe of bytes to one board, with its own idea of time: the wall clock on a cable, virtual time in
/// process.
class Link {
 public:
  Link() = default;
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  virtual ~Link() = default;

  /// Sends all bytes. fails: device_lost.
  virtual Result<void> send(std::span<const std::uint8_t> bytes) = 0;
  /// Waits until bytes arrive or `timeout` has passed; then the result is empty. fails: device_lost.
  virtual Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) = 0;
  /// Time on the link's clock since it was opened.
  virtual Nanoseconds now() const = 0;
  /// When the link was opened, on this machine's clock: now() counts from there. A link in virtual time has a
  /// clock of its own, with the same meaning for all that lives in that time.
  virtual SteadyTime opened() const { return {}; }
};

/// In process to a board in virtual time: waiting advances the board's clock. The board must outlive the
/// link.
std::unique_ptr<Link> make_sim_link(boards::SimBoard& board);

/// A link to the board at `uri`. sim: is a new board of its own, with a 60 Hz projector and a camera on its
/// lines, that lives as long as the link. A serial port and a USB interface are claimed: no other program of
/// ours can open them meanwhile.
/// fails: device_lost (nothing there, no permission, in use, connection refused; the text says which),
/// bad_argument (a baud rate that the system does not know, too long a path), unknown_name (a jumper's line),
/// protocol (a virtual link of another version).
Result<std::unique_ptr<Link>> open_link(const DeviceUri& uri);

}  // namespace symrig
