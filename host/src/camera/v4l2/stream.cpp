// SPDX-License-Identifier: Apache-2.0
#include "camera/v4l2/stream.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include <fmt/format.h>

namespace symrig::camera {
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
  const SequenceCount::Reading reading = counts_.read(filled.sequence);
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

void Stream::count(const SequenceCount::Reading& reading) {
  queue_.count([&reading](StreamReport& report) {
    report.missing += reading.missing;
    if (reading.step == Step::repeated) ++report.repeated;
    if (reading.step == Step::backwards) ++report.reordered;
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
