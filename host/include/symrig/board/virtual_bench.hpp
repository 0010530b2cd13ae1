// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/link.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace symrig {

/// An edge on a pin of a board in virtual time.
struct PinEdge {
  std::uint64_t cycle = 0;  ///< units of 8 ns since power-up
  std::uint8_t gpio = 0;
  bool level = false;

  bool operator==(const PinEdge&) const = default;
};

/// The surroundings of a board in virtual time behind a socket, such as an emulated Pico: wires, pulses,
/// cable, supply, and a logic analyser on every pin. Its time advances only while its link waits for bytes,
/// and while a cable or supply is connected again. Bytes of the protocol: docs/howto-boards.md.
///
/// All calls can fail with: device_lost (the server is gone, or refused: the message contains its reason),
/// protocol (the answer does not match the request).
class VirtualBench {
 public:
  /// uri: virtual:unix:PATH or virtual:tcp:HOST:PORT. fails: also bad_argument (another kind of uri).
  static Result<VirtualBench> connect(const DeviceUri& uri);

  /// The board's cable as a Link; now() is the board's time, receive() lets it run. May outlive the bench.
  std::unique_ptr<Link> link() const;

  const std::string& name() const { return name_; }  ///< "pico-emulated"
  std::uint64_t tick_hz() const { return tick_hz_; }

  /// The board's time.
  Result<Nanoseconds> now() const;
  /// Drives an input pin.
  Result<void> drive(std::uint8_t gpio, bool level) const;
  /// Stops driving it.
  Result<void> let_go(std::uint8_t gpio) const;
  /// A wire from an output pin to an input pin.
  Result<void> jumper(std::uint8_t from, std::uint8_t to) const;
  Result<void> remove_jumpers() const;
  /// A pulse of `width` on a pin every `period` from now on; a period of 0 ends it.
  Result<void> pulse(std::uint8_t gpio, Nanoseconds period, Nanoseconds width) const;
  /// All edges on all pins since the last call, in order of time.
  Result<std::vector<PinEdge>> edges() const;
  /// Plugs the cable in or pulls it.
  Result<void> cable(bool in) const;
  Result<void> power_cycle() const;
  /// Stops the board's processor for `time` (as a stuck firmware would); its hardware continues.
  Result<void> stall(Nanoseconds time) const;

  class Connection;

 private:
  explicit VirtualBench(std::shared_ptr<Connection> connection) : connection_(std::move(connection)) {}

  std::shared_ptr<Connection> connection_;
  std::string name_;
  std::uint64_t tick_hz_ = 0;
};

}  // namespace symrig
