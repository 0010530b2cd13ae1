// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// A level that the search has finished.
struct LiveLevel {
  int level = 0;
  std::int64_t photographs = 0;             ///< taken by then
  std::optional<double> error, half_width;  ///< estimated frobenius error if the search had ended there
};

/// How far a capture is.
struct LiveStatus {
  std::string stage;  ///< "level 3"
  std::int64_t done = 0,
               expected = 0;         ///< photographs: taken, expected by the end of the stage (0: not known)
  StepCount steps = {};              ///< what the computer has done in this stage
  bool computing = false;            ///< the stage takes no photographs
  std::int64_t frames = 0;           ///< exposures
  double rig_seconds = 0;            ///< on the rig's clock
  std::optional<double> to_go = {};  ///< seconds; none: not known
  std::int64_t lost_frames = 0;      ///< exposures without a frame, and frames that were not used
  std::vector<std::string> trouble = {};  ///< what went wrong and was repaired, a sentence each
};

struct LivePhotograph {
  Pattern pattern;
  Image<float> photograph;
};

/// A scene that is being captured. One thread captures and hands over what it has; another one serves the
/// page. Neither waits for the work of the other: the lock is held while a few pointers are copied.
class LiveScene {
 public:
  using MakeTensor = std::function<TransportTensor()>;
  using Truth = std::function<Result<Image<float>>(const Image<float>&)>;

  LiveScene(Grid grid, int channels, ViewLayout views) : grid_(grid), channels_(channels), views_(views) {}

  /// Since the capture began.
  double seconds() const { return watch_.seconds(); }
  Grid grid() const { return grid_; }
  int channels() const { return channels_; }
  ViewLayout views() const { return views_; }

  // The capturing thread hands over:
  void show(LiveStatus status);
  void show(LivePhotograph last);
  /// A further finished level; none: the flood-lit photograph. make: the tensor so far, which the serving
  /// thread makes if anybody asks for it.
  void show(const std::optional<LiveLevel>& level, MakeTensor make);
  /// The capture is complete. truth: as ViewOptions::truth.
  void complete(StoredScene scene, Truth truth);

  /// The capture has ended without a scene. reason: a sentence for the page.
  void fail(std::string reason);

  // The serving thread:
  /// Somebody has asked how far the capture is. told: the answer said that it has failed.
  void asked(bool told) const;

  // The capturing thread again, after fail():
  /// Whether somebody has asked within this time.
  bool watched_within(Nanoseconds time) const;
  /// Whether an answer has said why the capture failed.
  bool failure_told() const { return told_; }

  /// What the page shows. Each part keeps its value when a later one takes its place.
  struct Now {
    std::shared_ptr<const LiveStatus> status;              ///< never empty
    std::shared_ptr<const std::vector<LiveLevel>> levels;  ///< never empty
    std::shared_ptr<const LivePhotograph> last = {};
    std::shared_ptr<const MakeTensor> make = {};
    std::shared_ptr<const StoredScene> scene = {};  ///< set: the capture is complete
    std::shared_ptr<const Truth> truth = {};
    std::shared_ptr<const std::string> failure = {};  ///< set: the capture has failed, for this reason
    std::int64_t tensors = 0, photographs = 0;        ///< how many were handed over
  };
  Now now() const;

 private:
  static constexpr std::int64_t kNever = -1;

  const Grid grid_;
  const int channels_;
  const ViewLayout views_;
  const Stopwatch watch_;
  mutable std::mutex mutex_;
  mutable std::atomic<std::int64_t> last_asked_ = kNever;  // ns of the steady clock
  mutable std::atomic<bool> told_ = false;
  Now now_{.status = std::make_shared<const LiveStatus>(),
           .levels = std::make_shared<const std::vector<LiveLevel>>()};
};

}  // namespace symrig
