// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <functional>
#include <memory>
#include <string>

namespace symrig {

/// A simulated board behind a socket, in real time: for people who write a host of their own. It speaks the
/// bytes of the wire (protocol/PROTOCOL.md) with one host after the other. Its clock follows the steady clock
/// of this machine within a millisecond; its edges are exact in its own time. Only this machine reaches it.
class BoardServer {
 public:
  /// device: "sim:" or "sim:?jumper=OUT:IN". place: "unix:PATH", which must not exist, or "tcp:HOST:PORT"
  /// with a HOST of this machine (127.0.0.1, [::1], localhost). fails: bad_argument (another device or
  /// place), unknown_name (a line of the jumper), io (the socket cannot be made).
  static Result<BoardServer> open(const std::string& device, const std::string& place);
  BoardServer(BoardServer&&) noexcept;
  BoardServer& operator=(BoardServer&&) noexcept;
  /// Removes the socket of unix:PATH.
  ~BoardServer();

  /// Serves until keep_going() is false. It is asked at least a hundred times a second.
  void run(const std::function<bool()>& keep_going);

 private:
  class Serving;
  explicit BoardServer(std::unique_ptr<Serving> serving);
  std::unique_ptr<Serving> serving_;
};

}  // namespace symrig
