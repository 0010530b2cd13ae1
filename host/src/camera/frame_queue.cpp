// SPDX-License-Identifier: Apache-2.0

#include "camera/frame_queue.hpp"

#include "symrig/camera/camera.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace symrig::camera {
namespace {

constexpr std::size_t kRemarks = 32;

}  // namespace

void FrameQueue::keep(CameraFrame frame) {
  const std::lock_guard lock(mutex_);
  if (queue_.size() >= room_) {
    ++report_.overflowed;
    return;
  }
  ++report_.delivered;
  report_.damaged += frame.damaged ? 1 : 0;
  report_.unstamped += frame.stamp_of == StampOf::nothing ? 1 : 0;
  queue_.push_back(std::move(frame));
  ++arrived_;
  changed_.notify_all();
}

void FrameQueue::lose(Error error) {
  const std::lock_guard lock(mutex_);
  if (!lost_) lost_ = std::move(error);
  changed_.notify_all();
}

bool FrameQueue::lost() const {
  const std::lock_guard lock(mutex_);
  return lost_.has_value();
}

void FrameQueue::note(const std::string& line) {
  const std::lock_guard lock(mutex_);
  const bool known = std::ranges::find(report_.notes, line) != report_.notes.end();
  if (!known && report_.notes.size() < kRemarks) report_.notes.push_back(line);
}

StreamReport FrameQueue::report() const {
  const std::lock_guard lock(mutex_);
  return report_;
}

Result<std::vector<CameraFrame>> FrameQueue::take(std::size_t count, Nanoseconds patience) {
  std::unique_lock lock(mutex_);
  room_ = std::max(room_, count);
  for (std::uint64_t before = arrived_; queue_.size() < count && !lost_; before = arrived_)
    if (!changed_.wait_for(lock, patience, [&] { return arrived_ != before || lost_; })) break;
  if (queue_.empty() && lost_) return *lost_;
  std::vector<CameraFrame> frames(std::make_move_iterator(queue_.begin()),
                                  std::make_move_iterator(queue_.end()));
  queue_.clear();
  return frames;
}

}  // namespace symrig::camera

namespace symrig {

std::string StreamReport::to_string() const {
  using Count = std::pair<std::uint64_t, std::string_view>;
  std::string text = fmt::format("{} frames", delivered);
  for (const auto& [count, what] :
       {Count{missing, "missing"}, Count{overflowed, "lost because the queue was full"},
        Count{stale, "older than the stream"}, Count{damaged, "damaged"},
        Count{repeated, "with a repeated number"}, Count{reordered, "with a number out of order"},
        Count{unstamped, "without a usable stamp"}, Count{errors, "driver errors"},
        Count{restarts, "restarts"}})
    if (count != 0) text += fmt::format(", {} {}", count, what);
  return text;
}

}  // namespace symrig
