// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/frame_queue.hpp"
#include "camera/genicam/features.hpp"
#include "camera/genicam/set_up.hpp"
#include "symrig/board/clock_model.hpp"
#include "symrig/camera/internal/counts.hpp"
#include "symrig/camera/internal/frame_reader.hpp"
#include "symrig/camera/internal/network.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace symrig::camera {

/// The camera's clock against CLOCK_MONOTONIC. The camera latches its clock between two readings of ours, so
/// the offset is known to half the time between them.
class ClockMap {
 public:
  /// Latches the camera's clock. false: the camera has no such command, or did not answer within 200 µs. Then
  /// the last offset stays.
  bool latch(Features& features);
  /// at: the camera's stamp in nanoseconds. None: no latch has succeeded yet.
  std::optional<SteadyTime> host(std::uint64_t at) const;

 private:
  std::optional<Nanoseconds> offset_;  // ours minus the camera's
};

/// CLOCK_MONOTONIC.
Nanoseconds monotonic_now();

/// The settings of a stream.
struct GenicamPlan {
  PictureLayout layout;
  int binning = 1;
  int saturation = 0;  ///< as FrameReader
  int buffers = 64;    ///< fewer if frames are large: 256 MiB are enough
  std::size_t waiting = 64;
  std::optional<std::size_t> socket_limit;  ///< as GenicamSettings
  bool triggered = true;                    ///< a frame comes only after a trigger
  StampOf stamp = StampOf::nothing;
  ChunkNames chunks;
  std::string camera;  ///< for messages
};

/// A running stream of an open camera. A thread turns Aravis's buffers into frames.
class GenicamStream {
 public:
  /// fails: device_refused, device_lost.
  static Result<std::unique_ptr<GenicamStream>> start(ArvDevice* device, const GenicamPlan& plan,
                                                      StreamReport report);
  GenicamStream(const GenicamStream&) = delete;
  GenicamStream& operator=(const GenicamStream&) = delete;
  ~GenicamStream();

  /// As Camera::take(). The result includes the frames whose packets have begun to arrive.
  Result<std::vector<CameraFrame>> take(std::size_t count, Nanoseconds patience);
  StreamReport report() const;

 private:
  GenicamStream(ArvDevice* device, const GenicamPlan& plan, StreamReport report);
  Result<void> begin();
  void enlarge_socket(std::size_t payload);
  void run();
  void close();
  void accept(ArvBuffer* buffer);
  CameraFrame develop(ArvBuffer* buffer, bool damaged);
  FrameChunks chunks_of(ArvBuffer* buffer);
  bool arriving() const;
  std::uint64_t unbuffered() const;
  std::uint64_t without_buffer(std::uint64_t gap);
  std::string socket_words() const;
  static void control_lost(ArvDevice* device, gpointer stream);

  ArvDevice* device_;
  GenicamPlan plan_;
  Features features_;
  FrameReader reader_;
  FrameNumbers numbers_;
  ClockMap clock_;
  mutable std::mutex closing_;  // held while a stream that another thread may close is used
  Owned<ArvStream> stream_;     // nullptr: closed, because its camera is gone
  Owned<ArvChunkParser> parser_;
  gulong lost_signal_ = 0;
  bool acquiring_ = false;
  FrameQueue queue_;
  std::unique_ptr<StreamSocket> socket_;
  std::string socket_cure_;                   // what to do if the socket is too small
  std::uint64_t unbuffered_ = 0;              // of a stream that is closed
  std::uint64_t each_unbuffered_ = 1;         // how much of unbuffered() a frame is
  std::atomic<std::uint64_t> explained_ = 0;  // of unbuffered(), what gaps in the numbers explain
  std::atomic<bool> stopping_ = false;
  std::atomic<int> in_hand_ = 0;  // buffers between Aravis and the queue
  int buffers_ = 0;
  std::thread thread_;
};

}  // namespace symrig::camera
