// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/frame_queue.hpp"
#include "camera/v4l2/open_node.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/camera/internal/counts.hpp"
#include "symrig/camera/internal/frame_reader.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <thread>
#include <vector>

namespace symrig::camera {

/// A buffer that the driver filled.
struct FilledBuffer {
  std::uint32_t index = 0;  ///< give_back() needs it
  std::uint32_t sequence = 0;
  DriverStamp stamp;
  bool error = false;               ///< the driver reports that the contents are incomplete
  std::span<const std::byte> data;  ///< valid until the buffer is given back
};

/// Buffers that are shared with the driver (V4L2_MEMORY_MMAP), and their stream. The driver must outlive the
/// ring.
class BufferRing {
 public:
  /// count: how many to ask for; the driver may give more or fewer. least: bytes that a buffer must hold.
  /// fails: device_lost, device_refused (another program uses it, no memory, fewer than 2 buffers, buffers
  /// too small).
  static Result<BufferRing> make(OpenNode& driver, int count, std::size_t least);
  BufferRing(BufferRing&& other) noexcept;
  BufferRing& operator=(BufferRing&&) = delete;
  ~BufferRing();

  int size() const { return static_cast<int>(memory_.size()); }
  /// Queues all buffers and starts the stream.
  /// fails: as make().
  Result<void> start();
  /// Takes the oldest filled buffer. Returns 0, EAGAIN (none yet), or the driver's errno.
  int take(FilledBuffer& filled);
  /// Returns errno, 0 = success.
  int give_back(std::uint32_t index);

 private:
  explicit BufferRing(OpenNode& driver) : driver_(&driver) {}
  Result<void> map(std::uint32_t count, std::size_t least);
  void stop();

  OpenNode* driver_;
  std::vector<std::span<const std::byte>> memory_;
  bool streaming_ = false;
};

/// The settings of a stream.
struct StreamPlan {
  PictureLayout layout;
  Region region;
  int saturation = 0;        ///< as FrameReader
  int buffers = 8;           ///< shared with the driver
  std::size_t waiting = 64;  ///< longest queue for take(); a take() of more frames lengthens it
};

/// A running stream. A thread takes each filled buffer, makes a frame from it, and gives it back at once.
/// Frames wait in a queue of limited length. A frame that finds the queue full is dropped and counted, and
/// leaves a gap. One other thread may call take() and report() at any time.
class Stream {
 public:
  /// counts: from this camera's earlier streams.
  /// fails: as BufferRing::make() and start().
  static Result<std::unique_ptr<Stream>> start(OpenNode driver, const StreamPlan& plan, SequenceCount counts,
                                               StreamReport report);
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  /// Stops the stream and closes the node.
  ~Stream();

  /// As Camera::take(). Frames that came before the end of the stream are returned first.
  /// fails: device_lost.
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience) {
    return queue_.take(count, patience);
  }
  StreamReport report() const { return queue_.report(); }
  /// For controls. Its calls may run beside the thread's calls.
  OpenNode& driver() { return driver_; }
  /// Ends the thread. Returns the frame count for this camera's next stream.
  SequenceCount finish();

 private:
  Stream(OpenNode driver, const StreamPlan& plan, SequenceCount counts, StreamReport report);
  Result<void> begin();
  void run();
  bool drain();
  bool handle_error(int reason);
  bool accept(const FilledBuffer& filled);
  CameraFrame develop(const FilledBuffer& filled, bool damaged);
  void count(const CountedFrame& reading);
  bool lose(int reason, std::string_view doing);

  OpenNode driver_;
  StreamPlan plan_;
  FrameReader reader_;
  std::optional<BufferRing> ring_;
  SequenceCount counts_;  // used by the thread, as all members above
  std::optional<StampJudge> judge_;
  bool after_stale_ = false;
  int errors_in_a_row_ = 0;
  int buffers_out_ = 0;  // buffers that the driver has

  FrameQueue queue_;
  std::atomic<bool> stopping_ = false;
  std::thread thread_;
};

}  // namespace symrig::camera
