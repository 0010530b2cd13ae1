// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/frame_reader.hpp"
#include "camera/v4l2/buffer_ring.hpp"
#include "camera/v4l2/sequence.hpp"
#include "camera/v4l2/stamps.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/camera/stream_report.hpp"

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace symrig::camera {

/// How a stream runs.
struct StreamPlan {
  PictureLayout layout;
  Region region;
  int saturation = 0;        ///< as FrameReader
  int buffers = 8;           ///< shared with the driver
  std::size_t waiting = 64;  ///< frames that wait for take() at most, or as many as it has asked for at once
};

/// A running stream: a thread takes each buffer as soon as it is filled, turns it into a frame, and gives it
/// back at once. Frames wait in a queue of fixed length; one that finds it full is counted and leaves a gap.
/// take() and report() may be called while the thread works, by one thread.
class Stream {
 public:
  /// counts: of the streams of this camera before it.  fails: as BufferRing::make and start.
  static Result<std::unique_ptr<Stream>> start(OpenNode driver, const StreamPlan& plan, SequenceCount counts,
                                               StreamReport report);
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  /// Stops the stream and closes the node.
  ~Stream();

  /// As Camera::take(); frames that came before the stream ended are handed over first.  fails: device_lost.
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience);
  StreamReport report() const;
  /// For controls: these calls go well beside the thread's.
  OpenNode& driver() { return driver_; }
  /// Ends the thread; what the next stream of this camera must know.
  SequenceCount finish();

 private:
  Stream(OpenNode driver, const StreamPlan& plan, SequenceCount counts, StreamReport report);
  Result<void> begin();
  void run();
  bool drain();
  bool handle_error(int reason);
  bool accept(const FilledBuffer& filled);
  CameraFrame develop(const FilledBuffer& filled, bool damaged);
  void count(const SequenceCount::Reading& reading);
  void keep(CameraFrame frame);
  bool lose(int reason, std::string_view doing);
  void note(const std::string& line);

  OpenNode driver_;
  StreamPlan plan_;
  FrameReader reader_;
  std::optional<BufferRing> ring_;
  SequenceCount counts_;  // the thread's, as all above
  std::optional<StampJudge> judge_;
  bool after_stale_ = false;
  int errors_in_a_row_ = 0;
  int buffers_out_ = 0;  // with the driver

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<CameraFrame> queue_;
  std::uint64_t arrived_ = 0;  // frames kept, ever
  std::size_t room_;           // frames that the queue holds
  StreamReport report_;
  std::optional<Error> lost_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace symrig::camera
