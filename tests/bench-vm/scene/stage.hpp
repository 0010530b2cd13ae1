// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/ports.hpp"
#include "bench-vm/scene/screen_timeline.hpp"
#include "symrig/base/result.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <vector>

namespace symrig::bench_vm {

/// The shutter was open from begin to end, as the strobe told the board.
struct Exposure {
  std::uint64_t frame = 0;  ///< exposures before it
  Moment begin;
  Moment end;
};

/// What the watching threads tell the one that develops frames.
class Stage {
 public:
  /// From the screen's watcher.
  void show(Nanoseconds since, const Picture& picture);
  /// From the trigger's watcher.
  void exposed(const Exposure& exposure);
  /// Ends everything; the first error stays.
  void stop(std::optional<Error> failure = {});

  bool stopped() const { return stopped_; }
  std::optional<Error> failure();

  /// Whether the camera's cable is to be in. One without it answers no trigger.
  void plug_camera(bool in);
  bool camera_is_in() const { return plugged_; }

  /// The newest picture, so that its light can be computed before it is needed.
  ScreenTimeline::Lit newest();
  /// The oldest exposure that was not taken yet and was over before `now` − `age`; waits for one until
  /// `until`.
  std::optional<Exposure> next_exposure(Nanoseconds age, Nanoseconds until);
  std::vector<ScreenTimeline::Lit> lit_during(const Exposure& exposure);

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  ScreenTimeline timeline_;
  std::deque<Exposure> exposures_;
  std::optional<Error> failure_;
  std::atomic<bool> stopped_ = false;
  std::atomic<bool> plugged_ = true;
};

}  // namespace symrig::bench_vm
