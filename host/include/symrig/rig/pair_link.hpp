// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/link.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/rig/rig.hpp"

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace symrig {

/// Where the server of a pair is.
struct PairAddress {
  DeviceUri uri;       ///< tcp or unix_socket
  std::string secret;  ///< path of the file with the shared secret; empty: none
};

/// A connection to the server of a pair (docs/pair-protocol.md). After a failure it is of no more use: open a
/// new one. Not thread-safe.
class PairLink {
 public:
  /// Called while it waits. false: stop waiting. Empty: wait.
  using KeepWaiting = std::function<bool()>;

  /// Connects, proves on both sides that the secret is the same, and reads what the pair states of itself.
  /// fails: as read_pair_secret; device_lost (nobody answers, or another host uses the pair), device_refused
  /// (another version, another secret), protocol, timeout, interrupted, bad_argument (TCP without a secret).
  static Result<std::unique_ptr<PairLink>> open(const PairAddress& address, KeepWaiting keep_waiting = {});
  ~PairLink();
  PairLink(const PairLink&) = delete;
  PairLink& operator=(const PairLink&) = delete;

  /// The value of a word that the pair stated: "scene" of "version=1 scene=sim:views2". Empty: none.
  std::string fact(std::string_view key) const;
  /// "tcp:192.168.1.7:7001".
  const std::string& place() const;

  // Each fails with device_lost (the pair has gone), device_refused (it answers "error: ..."), protocol,
  // timeout (no byte for ten minutes), interrupted.
  Result<void> send(std::span<const std::byte> bytes);
  Result<void> send(std::string_view text) { return send(std::as_bytes(std::span(text))); }
  Result<std::string> receive_line();
  Result<void> receive(std::span<std::byte> into);

 private:
  class Talk;
  explicit PairLink(std::unique_ptr<Talk> talk);
  std::unique_ptr<Talk> talk_;
  std::string facts_;
};

/// The secret in a file: its bytes without line breaks at the end.
/// fails: not_found, io, bad_value (fewer than 16 bytes, or others can read the file), limit (over 4,096).
Result<std::string> read_pair_secret(const std::string& file);

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
  /// Answers one request. false: the host has gone. The host gets an error, and is then disconnected.
  virtual Result<bool> answer(const std::string& request, rig::ClientTalk& talk) = 0;
};

/// A projector-camera pair behind a socket, for a host that joins several (docs/pair-protocol.md). It serves
/// one host at a time. Another one gets the line "busy: ...". A host that breaks the framing or does not know
/// the secret gets the line "error: ...". Both are then disconnected.
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
  class ServedPair;
  explicit PairServer(std::unique_ptr<ServedPair> served);
  std::unique_ptr<ServedPair> served_;
};

/// A camera and a projector of this computer, for a host whose board fires them (docs/pair-protocol.md).
/// devices: its camera and its projector; the board is the host's. They are opened when a host comes, and
/// opened again after one was lost. pair: its place in the layout, from 0.
std::unique_ptr<PairService> serve_devices(RigDevices devices, ViewLayout layout, std::size_t pair);

/// The camera and the projector of such a pair, as devices of the host. They share a connection, which is
/// made when they are opened, and again after it was lost. Frames have no stamps: the two computers share no
/// clock. So the ledger trusts their numbers and contents only (docs/ledger.md). The openers fail as
/// PairLink::open, and with bad_argument (another place, layout or kind of pair), size_mismatch (other cells
/// than `cells`).
RigDevices linked_devices(PairAddress address, ViewLayout layout, std::size_t pair, Grid cells,
                          PairLink::KeepWaiting keep_waiting);

}  // namespace symrig
