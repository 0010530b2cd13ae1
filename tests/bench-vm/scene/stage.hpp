// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/ports.hpp"
#include "bench-vm/scene/screen_reader.hpp"
#include "symrig/base/result.hpp"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace symrig::bench_vm {

/// The shutter was open from begin to end, as the strobe showed the board.
struct Exposure {
  std::uint64_t frame = 0;  ///< number of exposures before it
  Moment begin;
  Moment end;
};

/// Passes events from the watcher threads to the thread that makes frames.
class Stage {
 public:
  /// screens: how many light the scene, side by side.
  explicit Stage(std::size_t screens = 1) : screens_(screens) {}

  /// Called by a screen's watcher.
  void show(Nanoseconds since, const Picture& picture, std::size_t screen = 0);
  /// Called by the watcher of bit planes: what is shown later, in order of time.
  void show(const std::vector<std::pair<Nanoseconds, Picture>>& changes);
  /// Called by the trigger's watcher.
  void exposed(const Exposure& exposure);
  /// Stops all threads. Keeps the first error.
  void stop(std::optional<Error> failure = {});

  bool stopped() const { return stopped_; }
  /// Number of exposures so far.
  std::uint64_t exposures() const { return exposed_; }
  std::optional<Error> failure();

  /// Plugs the camera in or out. An unplugged camera ignores triggers.
  void plug_camera(bool in);
  bool camera_is_in() const { return plugged_; }

  /// The newest picture, so that its light can be computed in advance.
  ScreenTimeline::Lit newest();
  /// Takes the oldest exposure that ended before `now` − `age`. Waits for one until `until`.
  std::optional<Exposure> next_exposure(Nanoseconds age, Nanoseconds until);
  std::vector<ScreenTimeline::Lit> lit_during(const Exposure& exposure);

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  JoinedScreens screens_;
  std::deque<Exposure> exposures_;
  std::optional<Error> failure_;
  std::atomic<std::uint64_t> exposed_ = 0;
  std::atomic<bool> stopped_ = false;
  std::atomic<bool> plugged_ = true;
};

}  // namespace symrig::bench_vm
