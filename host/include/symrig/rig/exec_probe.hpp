// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace symrig {

struct ExecOptions {
  /// How long the child may move no byte in either direction. The child's answer may state another time.
  Nanoseconds patience{600'000'000'000};
  /// How long the child may go on after its input has ended. Then its process group is killed.
  Nanoseconds grace{5'000'000'000};
  /// Called at least every 0.1 s while the probe waits. false: stop waiting. Empty: wait.
  std::function<bool()> keep_waiting = {};
};

/// A rig that is a child process. It gets patterns on its standard input, and answers photographs on its
/// standard output (docs/howto-own-rig.md). Its standard error is that of the caller.
///
/// The child runs in a process group of its own. The destructor ends its input and waits for its end; after
/// any failure the group is ended at once. A probe that has failed gives the same error again.
class ExecProbe final : public Probe {
 public:
  /// Starts `/bin/sh -c COMMAND`, and waits for the child's description of itself.
  /// fails: bad_argument (an empty command), not_found (the shell finds no such command), io (no process can
  /// be started), limit (the grid, the channels or the size of a photograph); and as measure().
  static Result<std::unique_ptr<ExecProbe>> open(std::string command, ExecOptions options = {});
  ~ExecProbe() override;

  Grid grid() const override;
  Grid camera_grid() const override;
  ViewLayout views() const override;
  int channels() const override;
  /// The patterns go to the child in batches of at most kExecBatch.
  /// fails: also device_lost (the child has ended or has closed a pipe), protocol (its answer breaks the
  /// framing, or a value is NaN, infinite, or a negative variance), timeout, interrupted.
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override;
  /// Each photograph counts as one frame. rig_seconds: wall-clock time of all measure() that succeeded.
  /// After each photograph.
  void tell(const TakenSome& taken) override;
  ProbeCost cost() const override { return cost_; }
  /// "exec:COMMAND", or "exec:COMMAND (NAME)" if the child states a name.
  std::string describe() const override;

 private:
  class Conversation;
  ExecProbe(std::string command, std::unique_ptr<Conversation> conversation);

  std::string command_;
  std::unique_ptr<Conversation> conversation_;
  std::optional<Error> failed_;
  ProbeCost cost_;
};

/// The largest number of patterns in one batch.
inline constexpr std::size_t kExecBatch = 16;
/// The largest number of bytes of one pattern and its photograph together.
inline constexpr std::int64_t kExecLargest = std::int64_t{1} << 30;
inline constexpr int kExecChannels = 64;  ///< the largest number of channels

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
  class ServedRig;
  explicit PhotographServer(std::unique_ptr<ServedRig> served);
  std::unique_ptr<ServedRig> served_;
};

}  // namespace symrig
