// SPDX-License-Identifier: Apache-2.0

#include "camera/v4l2/stream.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
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

namespace {

constexpr int kMostErrorsInARow = 16;
constexpr Nanoseconds kLook = std::chrono::seconds(1);  // interval of the checks while no frame arrives

}  // namespace

Stream::Stream(OpenNode driver, const StreamPlan& plan, SequenceCount counts, StreamReport report)
    : driver_(std::move(driver)),
      plan_(plan),
      reader_(plan.layout, plan.region, plan.saturation),
      counts_(counts),
      queue_(plan.waiting, std::move(report)) {}

Result<std::unique_ptr<Stream>> Stream::start(OpenNode driver, const StreamPlan& plan, SequenceCount counts,
                                              StreamReport report) {
  std::unique_ptr<Stream> stream(new Stream(std::move(driver), plan, counts, std::move(report)));
  SYMRIG_CHECK(stream->begin());
  return stream;
}

Result<void> Stream::begin() {
  SYMRIG_TRY(auto ring, BufferRing::make(driver_, plan_.buffers, plan_.layout.bytes()));
  ring_.emplace(std::move(ring));
  buffers_out_ = ring_->size();
  judge_.emplace(driver_.node().now(), ring_->size());
  SYMRIG_CHECK(ring_->start());
  thread_ = std::thread([this] { run(); });
  return {};
}

Stream::~Stream() {
  finish();
}

SequenceCount Stream::finish() {
  stopping_ = true;
  if (thread_.joinable()) {
    driver_.node().interrupt();
    thread_.join();
  }
  return counts_;
}

void Stream::run() {
  for (;;) {
    const Wake wake = driver_.node().wait(kLook);
    if (stopping_) return;
    // After a hangup, too, the call that takes a buffer reports the reason.
    if ((wake == Wake::frame || wake == Wake::hangup) && !drain()) return;
    if (wake == Wake::hangup && !handle_error(EIO)) return;
  }
}

/// Takes all filled buffers. false: the stream has ended.
bool Stream::drain() {
  for (;;) {
    FilledBuffer filled;
    const int reason = ring_->take(filled);
    if (reason == EAGAIN) return true;
    if (reason != 0) return handle_error(reason);
    errors_in_a_row_ = 0;
    --buffers_out_;
    if (!accept(filled)) return false;
  }
}

/// EIO may be temporary [Linux media, VIDIOC_DQBUF]: only several in a row end the stream. Any other error
/// ends it.
bool Stream::handle_error(int reason) {
  if (!is_gone(reason)) queue_.count([](StreamReport& report) { ++report.errors; });
  if (reason == EIO && ++errors_in_a_row_ < kMostErrorsInARow) return true;
  return lose(reason, "taking a frame");
}

/// Makes a frame from one buffer, queues it, and gives the buffer back. false: the stream has ended.
bool Stream::accept(const FilledBuffer& filled) {
  const bool damaged = filled.error || filled.data.size() < plan_.layout.bytes();
  const StampVerdict verdict = judge_->judge(filled.stamp, driver_.node().now(), damaged);
  const CountedFrame reading = counts_.read(filled.sequence);
  if (!verdict.note.empty()) queue_.note(verdict.note);
  if (verdict.stale) {
    after_stale_ = true;
    queue_.count([](StreamReport& report) { ++report.stale; });
  } else {
    // A gap between an old frame and the stream's first frame is no loss of this stream.
    if (!std::exchange(after_stale_, false)) count(reading);
    CameraFrame frame = develop(filled, damaged);
    frame.sequence = reading.number;
    frame.stamp = {filled.stamp.at};
    frame.stamp_of = verdict.of;
    queue_.keep(std::move(frame));
  }
  if (const int reason = ring_->give_back(filled.index); reason == 0)
    ++buffers_out_;
  else if (is_gone(reason) || buffers_out_ == 0)
    return lose(reason, "giving a buffer back");
  else
    queue_.note(fmt::format("the driver refuses to take a buffer back ({})", std::strerror(reason)));
  return true;
}

void Stream::count(const CountedFrame& reading) {
  queue_.count([&reading](StreamReport& report) {
    report.missing += reading.missing;
    if (reading.step == CountStep::repeated) ++report.repeated;
    if (reading.step == CountStep::backwards) ++report.reordered;
  });
}

CameraFrame Stream::develop(const FilledBuffer& filled, bool damaged) {
  CameraFrame frame;
  frame.damaged = damaged;
  frame.raw.resize(reader_.grid().size());
  const unsigned seen = reader_.read(filled.data, frame.raw);
  const auto& [bits, shift] = plan_.layout.depth;
  if (damaged) return frame;
  if (seen >> (bits + shift) != 0)
    queue_.note(fmt::format("samples have bits above the stated {}; they count as saturated", bits));
  if ((seen & ((1U << shift) - 1)) != 0)
    queue_.note(fmt::format(
        "samples have bits below the upper {}: the stated depth is too small, or samples are in the low bits",
        bits));
  return frame;
}

/// Ends the stream. For any reason, the caller gets device_lost.
bool Stream::lose(int reason, std::string_view doing) {
  Error error = driver_.error(reason, doing);
  error.code = ErrorCode::device_lost;
  queue_.lose(std::move(error));
  return false;
}

}  // namespace symrig::camera
