// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/device_uri.hpp"

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

}  // namespace symrig
