// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/v4l2/open_node.hpp"
#include "camera/v4l2/stamps.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
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

}  // namespace symrig::camera
