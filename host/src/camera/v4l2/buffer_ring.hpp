// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/v4l2/open_node.hpp"
#include "camera/v4l2/stamps.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig::camera {

/// A buffer that the driver has filled.
struct FilledBuffer {
  std::uint32_t index = 0;  ///< to give it back by
  std::uint32_t sequence = 0;
  DriverStamp stamp;
  bool error = false;               ///< the driver says that its contents are not whole
  std::span<const std::byte> data;  ///< until it is given back
};

/// Buffers shared with the driver (V4L2_MEMORY_MMAP) and the stream through them. The driver must outlive
/// the ring.
class BufferRing {
 public:
  /// count: as many as wanted; the driver may give more or fewer. least: bytes that a buffer must hold.
  /// fails: device_lost, device_refused (held by another program, no memory, fewer than 2, too small ones).
  static Result<BufferRing> make(OpenNode& driver, int count, std::size_t least);
  BufferRing(BufferRing&& other) noexcept;
  BufferRing& operator=(BufferRing&&) = delete;
  ~BufferRing();

  int size() const { return static_cast<int>(memory_.size()); }
  /// Gives the driver all buffers and starts the stream.  fails: as make().
  Result<void> start();
  /// The oldest filled buffer. 0, EAGAIN (none yet), or the errno of a driver in trouble.
  int take(FilledBuffer& filled);
  /// errno, 0 = done.
  int give_back(std::uint32_t index);

 private:
  explicit BufferRing(OpenNode& driver) : driver_(&driver) {}
  Result<void> map(std::uint32_t count, std::size_t least);
  void stop();

  OpenNode* driver_;
  std::vector<std::span<const std::byte>> memory_;
  bool streaming_ = false;
};

}  // namespace symrig::camera
