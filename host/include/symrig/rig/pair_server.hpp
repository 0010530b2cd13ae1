// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <functional>
#include <memory>
#include <string>

namespace symrig {

namespace rig {
class ClientTalk;
}

/// What a pair does for its host, behind a PairServer.
class PairService {
 public:
  PairService() = default;
  PairService(const PairService&) = delete;
  PairService& operator=(const PairService&) = delete;
  virtual ~PairService() = default;

  /// A host has come. fails: device errors.
  virtual Result<void> begin() { return {}; }
  /// After begin(): what it states of itself, words KEY=VALUE without line breaks.
  virtual std::string facts() const = 0;
  /// Answers one request. false: the host has gone. An error is sent to the host, which is then sent away.
  virtual Result<bool> answer(const std::string& request, rig::ClientTalk& talk) = 0;
};

/// A projector-camera pair behind a socket, for a host that joins several (docs/pair-protocol.md). It serves
/// one host at a time. Another one gets the line "busy: ...". A host that breaks the framing or does not know
/// the secret gets the line "error: ...". Both are then sent away.
class PairServer {
 public:
  /// place: "unix:PATH", which only this user can reach, or "tcp:HOST:PORT" of an address of this machine.
  /// secret: path of the file with the shared secret; empty: none, which TCP does not allow.
  /// fails: as read_pair_secret; bad_argument, io (the socket cannot be made).
  static Result<PairServer> open(std::unique_ptr<PairService> service, const std::string& place,
                                 const std::string& secret);
  PairServer(PairServer&&) noexcept;
  PairServer& operator=(PairServer&&) noexcept;
  ~PairServer();

  /// Serves until keep_going() is false. It is asked ten times a second, but not while the pair works.
  void run(const std::function<bool()>& keep_going);

 private:
  class Serving;
  explicit PairServer(std::unique_ptr<Serving> serving);
  std::unique_ptr<Serving> serving_;
};

}  // namespace symrig
