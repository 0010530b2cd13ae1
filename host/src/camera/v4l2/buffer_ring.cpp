// SPDX-License-Identifier: Apache-2.0
#include "camera/v4l2/buffer_ring.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <fmt/format.h>
#include <linux/videodev2.h>

namespace symrig::camera {
namespace {

/// A buffer's description for V4L2 calls: single-planar, or multi-planar with one plane.
struct Description {
  Description(const OpenNode& driver, std::uint32_t index) : multiplanar(driver.identity().multiplanar) {
    buffer.index = index;
    buffer.type = driver.buffer_type();
    buffer.memory = V4L2_MEMORY_MMAP;
    if (!multiplanar) return;
    buffer.m.planes = &plane;
    buffer.length = 1;
  }
  Description(const Description&) = delete;
  Description& operator=(const Description&) = delete;

  std::size_t length() const { return multiplanar ? plane.length : buffer.length; }
  std::uint32_t map_offset() const { return multiplanar ? plane.m.mem_offset : buffer.m.offset; }
  std::size_t used() const { return multiplanar ? plane.bytesused : buffer.bytesused; }
  std::size_t begin() const { return multiplanar ? plane.data_offset : 0; }

  v4l2_buffer buffer{};
  v4l2_plane plane{};
  bool multiplanar;
};

/// The part of the buffer that the driver reports as filled, limited to the buffer's size.
std::span<const std::byte> filled_part(std::span<const std::byte> memory, const Description& description) {
  const std::size_t used = std::min(description.used(), memory.size());
  return memory.first(used).subspan(std::min(description.begin(), used));
}

/// Clamps impossible stamps, so that the conversion does not overflow.
Nanoseconds time_of(const timeval& stamp) {
  constexpr std::int64_t kMostSeconds = 9'000'000'000;  // 285 years
  const std::int64_t whole = std::clamp<std::int64_t>(stamp.tv_sec, -kMostSeconds, kMostSeconds);
  const std::int64_t rest = std::clamp<std::int64_t>(stamp.tv_usec, -1'000'000, 1'000'000);
  return std::chrono::seconds(whole) + std::chrono::microseconds(rest);
}

}  // namespace

BufferRing::BufferRing(BufferRing&& other) noexcept
    : driver_(other.driver_),
      memory_(std::exchange(other.memory_, {})),
      streaming_(std::exchange(other.streaming_, false)) {}

BufferRing::~BufferRing() {
  if (memory_.empty()) return;
  stop();
  for (const auto memory : memory_) driver_->node().unmap(memory);
  v4l2_requestbuffers none{};
  none.type = driver_->buffer_type();
  none.memory = V4L2_MEMORY_MMAP;
  driver_->call(VIDIOC_REQBUFS, &none);  // a lost node has already freed them
}

Result<BufferRing> BufferRing::make(OpenNode& driver, int count, std::size_t least) {
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(count);
  request.type = driver.buffer_type();
  request.memory = V4L2_MEMORY_MMAP;
  SYMRIG_CHECK(driver.ask(VIDIOC_REQBUFS, &request, fmt::format("asking for {} buffers", count)));
  BufferRing ring(driver);
  SYMRIG_CHECK(ring.map(request.count, least));
  if (ring.size() < 2)
    return Error{ErrorCode::device_refused,
                 fmt::format("camera {} has memory for only {} buffer(s)", driver.path(), ring.size()),
                 "a stream needs 2; choose a smaller picture"};
  return ring;
}

Result<void> BufferRing::map(std::uint32_t count, std::size_t least) {
  for (std::uint32_t index = 0; index < count; ++index) {
    Description description(*driver_, index);
    SYMRIG_CHECK(driver_->ask(VIDIOC_QUERYBUF, &description.buffer, "querying a buffer"));
    if (description.length() < least)
      return Error{ErrorCode::device_refused,
                   fmt::format("camera {} has buffers of {} bytes, but its format needs {}", driver_->path(),
                               description.length(), least),
                   "the driver is wrong about this format; choose another format"};
    std::span<const std::byte> memory;
    if (const int reason = driver_->node().map(description.length(), description.map_offset(), memory);
        reason != 0)
      return driver_->error(reason, "mapping a buffer");
    memory_.push_back(memory);
  }
  return {};
}

Result<void> BufferRing::start() {
  for (std::uint32_t index = 0; index < memory_.size(); ++index)
    if (const int reason = give_back(index); reason != 0) return driver_->error(reason, "queueing a buffer");
  int type = static_cast<int>(driver_->buffer_type());
  SYMRIG_CHECK(driver_->ask(VIDIOC_STREAMON, &type, "starting the stream"));
  streaming_ = true;
  return {};
}

void BufferRing::stop() {
  if (!std::exchange(streaming_, false)) return;
  int type = static_cast<int>(driver_->buffer_type());
  driver_->call(VIDIOC_STREAMOFF, &type);  // the stream of a lost node has already ended
}

int BufferRing::take(FilledBuffer& filled) {
  Description description(*driver_, 0);
  if (const int reason = driver_->call(VIDIOC_DQBUF, &description.buffer); reason != 0) return reason;
  const v4l2_buffer& buffer = description.buffer;
  if (buffer.index >= memory_.size()) return EPROTO;
  filled.index = buffer.index;
  filled.sequence = buffer.sequence;
  filled.stamp = {time_of(buffer.timestamp), buffer.flags};
  filled.error = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  filled.data = filled_part(memory_[buffer.index], description);
  return 0;
}

int BufferRing::give_back(std::uint32_t index) {
  Description description(*driver_, index);
  return driver_->call(VIDIOC_QBUF, &description.buffer);
}

}  // namespace symrig::camera
