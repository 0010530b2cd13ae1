// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"

#include <functional>
#include <memory>
#include <string>

namespace symrig {

/// A rig behind a socket: patterns in, photographs out, in the framing of exec: rigs
/// (docs/howto-own-rig.md). For people who write a host of their own. It serves one client at a time. Another
/// one gets the line "busy: …". A client that breaks the framing gets the line "error: …". Both are then sent
/// away. Memory is bounded: one pattern and its photograph. Only this machine reaches it.
class PhotographServer {
 public:
  /// Makes the rig as it is at the start of a capture. Each client gets a new one, so captures repeat.
  using OpenRig = std::function<Result<std::unique_ptr<Probe>>()>;

  /// Opens the first rig too, so that its errors come now. place: as BoardServer::open.
  /// fails: as the opener; bad_argument (another place), io (the socket cannot be made), limit (a pattern and
  /// its photograph are larger than the framing allows).
  static Result<PhotographServer> open(OpenRig open, const std::string& place);
  PhotographServer(PhotographServer&&) noexcept;
  PhotographServer& operator=(PhotographServer&&) noexcept;
  /// Removes the socket of unix:PATH.
  ~PhotographServer();

  /// Serves until keep_going() is false. It is asked ten times a second, but not while the rig takes a
  /// photograph.
  void run(const std::function<bool()>& keep_going);

 private:
  class Serving;
  explicit PhotographServer(std::unique_ptr<Serving> serving);
  std::unique_ptr<Serving> serving_;
};

}  // namespace symrig
