// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/internal/video_system.hpp"
#include "symrig/image/grid.hpp"

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <linux/videodev2.h>

namespace symrig::test {

/// A pixel format of a fake camera.
struct FakeFormat {
  std::uint32_t fourcc = V4L2_PIX_FMT_Y16;
  std::uint32_t bits_a_pixel = 16;
  std::vector<Grid> sizes{{6, 8}};
};

/// A control of a fake camera.
struct FakeControl {
  std::uint32_t id = 0;
  std::string title;
  std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
  std::int64_t least = 0, most = 100, step = 1, value = 0;
  std::uint32_t flags = 0;
  std::vector<std::string> menu = {};                   ///< empty text: left out
  std::function<std::int64_t(std::int64_t)> hold = {};  ///< what the driver makes of a value
};

/// What a fake camera hands out.
struct FakeFrame {
  std::uint32_t sequence = 0;
  Nanoseconds stamp{};
  std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  std::vector<std::byte> bytes = {};  ///< the begin of the picture; the rest stays as it was
  std::int64_t used = -1;             ///< bytes that the driver says are filled; -1: the whole picture
  std::uint32_t index_offset = 0;     ///< a driver that names a buffer that is none
};

/// A camera's driver in a script: answers the calls of V4L2 as the kernel's videobuf2 does [Linux media,
/// VIDIOC_REQBUFS to VIDIOC_DQBUF], and lies where the test says so. May be used by several threads.
class FakeCamera {
 public:
  std::string card = "Fake camera", driver = "fake", bus = "platform:fake", serial;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<FakeFormat> formats{FakeFormat{}};
  std::vector<FakeControl> controls;
  std::function<void(v4l2_format&)> twist_format;  ///< what the driver makes of a format
  std::function<void(v4l2_streamparm&)> twist_rate;
  std::function<void(v4l2_requestbuffers&)> twist_request;
  std::function<void(v4l2_buffer&)> twist_query;

  /// The next `times` calls of this request end with this errno.
  void fail(unsigned long request, int reason, int times = 1);
  /// Fills the buffer that was queued first. false: none is queued, the frame is lost.
  bool deliver(const FakeFrame& frame);
  /// The camera is pulled out: every call fails from now on.
  void unplug();
  void hang_up();
  void set_now(Nanoseconds now);
  /// Waits until `count` buffers are with the driver and the stream runs.
  void await_queued(std::size_t count);
  std::size_t calls(unsigned long request) const;
  bool streaming() const;
  int mapped() const;

 private:
  friend class FakeNode;
  int control(unsigned long request, void* argument);
  int dispatch(unsigned long request, void* argument);
  int format_call(unsigned long request, void* argument);
  int control_call(unsigned long request, void* argument);
  int buffer_call(unsigned long request, void* argument);
  int enumerate_format(v4l2_fmtdesc& answer) const;
  int enumerate_size(v4l2_frmsizeenum& answer) const;
  int set_format(v4l2_format& wanted);
  int query_control(v4l2_query_ext_ctrl& answer) const;
  int query_menu(v4l2_querymenu& answer) const;
  int access_control(v4l2_ext_controls& list, bool set);
  int request_buffers(v4l2_requestbuffers& request);
  int query_buffer(v4l2_buffer& buffer) const;
  int queue_buffer(const v4l2_buffer& buffer);
  int dequeue_buffer(v4l2_buffer& buffer);
  int stream(bool on);
  const FakeFormat* find(std::uint32_t fourcc) const;
  bool multiplanar() const { return (capabilities & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0; }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  v4l2_format format_{};
  std::vector<std::vector<std::byte>> buffers_;
  std::deque<std::uint32_t> queued_;
  std::deque<v4l2_buffer> filled_;
  std::map<unsigned long, std::deque<int>> failures_;
  std::map<unsigned long, std::size_t> calls_;
  Nanoseconds now_ = std::chrono::seconds(100);
  bool gone_ = false, hung_up_ = false, streaming_ = false, interrupted_ = false;
  int mapped_ = 0;
};

/// Nodes of a fake machine.
class FakeSystem final : public camera::VideoSystem {
 public:
  std::vector<std::string> paths() override;
  std::string serial(const std::string& path) override;
  int open(const std::string& path, std::unique_ptr<camera::VideoNode>& node) override;

  std::map<std::string, std::shared_ptr<FakeCamera>> cameras;
  std::map<std::string, int> refusals;  ///< errno of open
};

}  // namespace symrig::test
