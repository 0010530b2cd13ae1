// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/modules/testcam/testcam.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <linux/videodev2.h>

/// Both sides of the test camera with plain system calls, for the camera's own tests.
namespace symrig::bench_vm {

/// The side that makes frames.
class Injector {
 public:
  Injector();
  Injector(const Injector&) = delete;
  Injector& operator=(const Injector&) = delete;
  ~Injector();

  /// 0, or the errno.
  int frame(const testcam_frame& head, std::span<const std::byte> pixels) const;
  testcam_state state() const;
  int unplug() const;
  int plug() const;

 private:
  int command(unsigned long request) const;
  int file_;
};

/// The side of other programs: four mapped buffers.
class Stream {
 public:
  /// Opens the camera. Does not throw; see ok().
  explicit Stream(const std::string& path);
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream();

  bool ok() const { return file_ >= 0; }
  /// Returns the format that the driver set.
  v4l2_pix_format set_format(std::uint32_t fourcc, std::uint32_t width, std::uint32_t height) const;
  /// Returns 0 or the errno. queued: how many of the four buffers are queued.
  int start(std::uint32_t queued = 4);
  int stop() const;
  /// Waits for a frame. Its pixels are valid until requeue(). None: see error() for the errno.
  std::optional<v4l2_buffer> take();
  std::span<const std::byte> pixels(const v4l2_buffer& buffer) const;
  int requeue(std::uint32_t index) const;
  int error() const { return error_; }
  int set_control(std::uint32_t id, std::int32_t value) const;

 private:
  struct Mapping {
    void* memory;
    std::size_t bytes;
  };
  bool map(std::uint32_t index);

  int file_;
  int error_ = 0;
  std::vector<Mapping> buffers_;
};

}  // namespace symrig::bench_vm
