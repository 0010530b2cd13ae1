// SPDX-License-Identifier: Apache-2.0
#include "fake_video.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

namespace symrig::test {

using camera::VideoNode;
using camera::Wake;

namespace {

template <std::size_t N>
void put(const std::string& text, __u8 (&field)[N]) {
  std::memcpy(field, text.data(), std::min(text.size(), N));
}

std::uint32_t number(int value) {
  return static_cast<std::uint32_t>(value);
}

timeval to_timeval(Nanoseconds t) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(t).count();
  return {us / 1'000'000, us % 1'000'000};
}

}  // namespace

/// An open fake camera.
class FakeNode final : public VideoNode {
 public:
  explicit FakeNode(std::shared_ptr<FakeCamera> camera) : camera_(std::move(camera)) {}

  int control(unsigned long request, void* argument) override { return camera_->control(request, argument); }

  int map(std::size_t length, std::int64_t offset, std::span<const std::byte>& memory) override {
    const std::lock_guard lock(camera_->mutex_);
    const std::size_t index = offset;
    if (index >= camera_->buffers_.size() || length > camera_->buffers_[index].size()) return EINVAL;
    memory = {camera_->buffers_[index].data(), length};
    ++camera_->mapped_;
    return 0;
  }

  void unmap(std::span<const std::byte> /*memory*/) override {
    const std::lock_guard lock(camera_->mutex_);
    --camera_->mapped_;
  }

  Wake wait(Nanoseconds patience) override {
    std::unique_lock lock(camera_->mutex_);
    auto& c = *camera_;
    c.changed_.wait_for(lock, patience,
                        [&c] { return c.interrupted_ || c.gone_ || c.hung_up_ || !c.filled_.empty(); });
    if (std::exchange(c.interrupted_, false)) return Wake::interrupted;
    if (c.gone_ || c.hung_up_) return Wake::hangup;
    return c.filled_.empty() ? Wake::nothing : Wake::frame;
  }

  void interrupt() override {
    const std::lock_guard lock(camera_->mutex_);
    camera_->interrupted_ = true;
    camera_->changed_.notify_all();
  }

  Nanoseconds now() override {
    const std::lock_guard lock(camera_->mutex_);
    return camera_->now_;
  }

 private:
  std::shared_ptr<FakeCamera> camera_;
};

void FakeCamera::fail(unsigned long request, int reason, int times) {
  const std::lock_guard lock(mutex_);
  failures_[request].insert(failures_[request].end(), static_cast<std::size_t>(times), reason);
}

bool FakeCamera::deliver(const FakeFrame& frame) {
  const std::lock_guard lock(mutex_);
  if (queued_.empty() || !streaming_) return false;
  const std::uint32_t index = queued_.front();
  queued_.pop_front();
  auto& buffer = buffers_[index];
  std::copy_n(frame.bytes.begin(), std::min(frame.bytes.size(), buffer.size()), buffer.begin());
  v4l2_buffer filled{};
  filled.index = index + frame.index_offset;
  filled.sequence = frame.sequence;
  filled.flags = frame.flags;
  filled.timestamp = to_timeval(frame.stamp);
  filled.bytesused =
      frame.used < 0 ? static_cast<std::uint32_t>(buffer.size()) : static_cast<std::uint32_t>(frame.used);
  filled_.push_back(filled);
  changed_.notify_all();
  return true;
}

void FakeCamera::unplug() {
  const std::lock_guard lock(mutex_);
  gone_ = true;
  changed_.notify_all();
}

void FakeCamera::hang_up() {
  const std::lock_guard lock(mutex_);
  hung_up_ = true;
  changed_.notify_all();
}

void FakeCamera::set_now(Nanoseconds now) {
  const std::lock_guard lock(mutex_);
  now_ = now;
}

void FakeCamera::await_queued(std::size_t count) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return gone_ || (streaming_ && queued_.size() >= count); });
}

std::size_t FakeCamera::calls(unsigned long request) const {
  const std::lock_guard lock(mutex_);
  const auto found = calls_.find(request);
  return found == calls_.end() ? 0 : found->second;
}

bool FakeCamera::streaming() const {
  const std::lock_guard lock(mutex_);
  return streaming_;
}

int FakeCamera::mapped() const {
  const std::lock_guard lock(mutex_);
  return mapped_;
}

int FakeCamera::control(unsigned long request, void* argument) {
  const std::lock_guard lock(mutex_);
  ++calls_[request];
  if (gone_) return ENODEV;
  if (auto& script = failures_[request]; !script.empty()) {
    const int reason = script.front();
    script.pop_front();
    return reason;
  }
  const int result = dispatch(request, argument);
  changed_.notify_all();
  return result;
}

int FakeCamera::dispatch(unsigned long request, void* argument) {
  if (request == VIDIOC_QUERYCAP) {
    auto& answer = *static_cast<v4l2_capability*>(argument);
    put(card, answer.card), put(driver, answer.driver), put(bus, answer.bus_info);
    answer.capabilities = capabilities | V4L2_CAP_DEVICE_CAPS;
    answer.device_caps = capabilities;
    return 0;
  }
  int result = format_call(request, argument);
  if (result == ENOTTY) result = control_call(request, argument);
  if (result == ENOTTY) result = buffer_call(request, argument);
  return result;
}

int FakeCamera::format_call(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_ENUM_FMT:
      return enumerate_format(*static_cast<v4l2_fmtdesc*>(argument));
    case VIDIOC_ENUM_FRAMESIZES:
      return enumerate_size(*static_cast<v4l2_frmsizeenum*>(argument));
    case VIDIOC_ENUM_FRAMEINTERVALS: {
      auto& answer = *static_cast<v4l2_frmivalenum*>(argument);
      answer.type = V4L2_FRMIVAL_TYPE_DISCRETE;
      answer.discrete = {1, 30 * (answer.index + 1)};
      return answer.index < 2 ? 0 : EINVAL;
    }
    case VIDIOC_G_FMT: {
      v4l2_format first{};
      if (format_.type == 0) set_format(first);
      *static_cast<v4l2_format*>(argument) = format_;
      return 0;
    }
    case VIDIOC_S_FMT:
      return set_format(*static_cast<v4l2_format*>(argument));
    case VIDIOC_S_PARM: {
      auto& parameters = *static_cast<v4l2_streamparm*>(argument);
      if (twist_rate) twist_rate(parameters);
      return 0;
    }
    default:
      return ENOTTY;
  }
}

const FakeFormat* FakeCamera::find(std::uint32_t fourcc) const {
  const auto found =
      std::find_if(formats.begin(), formats.end(), [&](const FakeFormat& f) { return f.fourcc == fourcc; });
  return found == formats.end() ? nullptr : &*found;
}

int FakeCamera::enumerate_format(v4l2_fmtdesc& answer) const {
  if (answer.index >= formats.size()) return EINVAL;
  answer.pixelformat = formats[answer.index].fourcc;
  put("A format", answer.description);
  return 0;
}

int FakeCamera::enumerate_size(v4l2_frmsizeenum& answer) const {
  const FakeFormat* const format = find(answer.pixel_format);
  if (format == nullptr || answer.index >= format->sizes.size()) return EINVAL;
  answer.type = V4L2_FRMSIZE_TYPE_DISCRETE;
  answer.discrete = {number(format->sizes[answer.index].cols), number(format->sizes[answer.index].rows)};
  return 0;
}

/// As drivers do: what is not offered becomes the first that is.
int FakeCamera::set_format(v4l2_format& wanted) {
  auto& pix = wanted.fmt.pix;
  auto& planes = wanted.fmt.pix_mp;
  const FakeFormat* format = find(multiplanar() ? planes.pixelformat : pix.pixelformat);
  if (format == nullptr) format = &formats.front();
  const Grid asked{static_cast<int>(multiplanar() ? planes.height : pix.height),
                   static_cast<int>(multiplanar() ? planes.width : pix.width)};
  const bool known = std::find(format->sizes.begin(), format->sizes.end(), asked) != format->sizes.end();
  const Grid size = known ? asked : format->sizes.front();
  const std::uint32_t stride = number(size.cols) * format->bits_a_pixel / 8;
  wanted.type = multiplanar() ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (multiplanar()) {
    planes.pixelformat = format->fourcc, planes.width = number(size.cols), planes.height = number(size.rows);
    planes.num_planes = 1, planes.field = V4L2_FIELD_NONE;
    planes.plane_fmt[0].bytesperline = stride, planes.plane_fmt[0].sizeimage = stride * number(size.rows);
  } else {
    pix.pixelformat = format->fourcc, pix.width = number(size.cols), pix.height = number(size.rows);
    pix.bytesperline = stride, pix.sizeimage = stride * number(size.rows), pix.field = V4L2_FIELD_NONE;
  }
  if (twist_format) twist_format(wanted);
  format_ = wanted;
  return 0;
}

int FakeCamera::control_call(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERY_EXT_CTRL:
      return query_control(*static_cast<v4l2_query_ext_ctrl*>(argument));
    case VIDIOC_QUERYMENU:
      return query_menu(*static_cast<v4l2_querymenu*>(argument));
    case VIDIOC_G_EXT_CTRLS:
      return access_control(*static_cast<v4l2_ext_controls*>(argument), false);
    case VIDIOC_S_EXT_CTRLS:
      return access_control(*static_cast<v4l2_ext_controls*>(argument), true);
    default:
      return ENOTTY;
  }
}

/// Always with V4L2_CTRL_FLAG_NEXT_CTRL: the first control above the id. Controls stand in order of id.
int FakeCamera::query_control(v4l2_query_ext_ctrl& answer) const {
  const std::uint32_t above = answer.id & ~std::uint32_t{V4L2_CTRL_FLAG_NEXT_CTRL};
  for (const FakeControl& control : controls) {
    if (control.id <= above) continue;
    answer = {};
    answer.id = control.id;
    answer.type = control.type;
    std::memcpy(answer.name, control.title.data(), std::min(control.title.size(), sizeof answer.name));
    answer.minimum = control.least, answer.maximum = control.most;
    answer.step = static_cast<std::uint64_t>(control.step), answer.default_value = control.least;
    answer.flags = control.flags;
    return 0;
  }
  return EINVAL;
}

int FakeCamera::query_menu(v4l2_querymenu& answer) const {
  for (const FakeControl& control : controls) {
    if (control.id != answer.id || answer.index >= control.menu.size() || control.menu[answer.index].empty())
      continue;
    // The structure is packed: its fields take no reference.
    std::memcpy(&answer.name, control.menu[answer.index].data(),
                std::min(control.menu[answer.index].size(), sizeof answer.name));
    return 0;
  }
  return EINVAL;
}

int FakeCamera::access_control(v4l2_ext_controls& list, bool set) {
  v4l2_ext_control& wanted = list.controls[0];
  for (FakeControl& control : controls) {
    if (control.id != wanted.id) continue;
    const bool wide = control.type == V4L2_CTRL_TYPE_INTEGER64;
    if (set) {
      const std::int64_t value = wide ? wanted.value64 : wanted.value;
      control.value = control.hold ? control.hold(value) : value;
    } else if (wide) {
      wanted.value64 = control.value;
    } else {
      wanted.value = static_cast<std::int32_t>(control.value);
    }
    return 0;
  }
  return EINVAL;
}

int FakeCamera::buffer_call(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_REQBUFS:
      return request_buffers(*static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF:
      return query_buffer(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_QBUF:
      return queue_buffer(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_DQBUF:
      return dequeue_buffer(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      return stream(true);
    case VIDIOC_STREAMOFF:
      return stream(false);
    default:
      return ENOTTY;
  }
}

int FakeCamera::request_buffers(v4l2_requestbuffers& request) {
  if (streaming_ || mapped_ > 0) return EBUSY;
  if (twist_request && request.count > 0) twist_request(request);
  const std::size_t size =
      multiplanar() ? format_.fmt.pix_mp.plane_fmt[0].sizeimage : format_.fmt.pix.sizeimage;
  buffers_.assign(request.count, std::vector<std::byte>(size));
  queued_.clear();
  filled_.clear();
  return 0;
}

int FakeCamera::query_buffer(v4l2_buffer& buffer) const {
  if (buffer.index >= buffers_.size()) return EINVAL;
  const auto length = static_cast<std::uint32_t>(buffers_[buffer.index].size());
  if (multiplanar()) {
    buffer.m.planes[0].length = length;
    buffer.m.planes[0].m.mem_offset = buffer.index;
  } else {
    buffer.length = length;
    buffer.m.offset = buffer.index;
  }
  if (twist_query) twist_query(buffer);
  return 0;
}

int FakeCamera::queue_buffer(const v4l2_buffer& buffer) {
  if (buffer.index >= buffers_.size() ||
      std::find(queued_.begin(), queued_.end(), buffer.index) != queued_.end())
    return EINVAL;
  queued_.push_back(buffer.index);
  return 0;
}

int FakeCamera::dequeue_buffer(v4l2_buffer& buffer) {
  if (!streaming_) return EINVAL;
  if (filled_.empty()) return EAGAIN;
  const v4l2_buffer& filled = filled_.front();
  buffer.index = filled.index, buffer.sequence = filled.sequence, buffer.flags = filled.flags;
  buffer.timestamp = filled.timestamp;
  (multiplanar() ? buffer.m.planes[0].bytesused : buffer.bytesused) = filled.bytesused;
  filled_.pop_front();
  return 0;
}

int FakeCamera::stream(bool on) {
  streaming_ = on;
  if (!on) {
    queued_.clear();
    filled_.clear();
  }
  return 0;
}

std::vector<std::string> FakeSystem::paths() {
  std::vector<std::string> all;
  for (const auto& [path, camera] : cameras) all.push_back(path);
  for (const auto& [path, reason] : refusals)
    if (!cameras.contains(path)) all.push_back(path);
  std::sort(all.begin(), all.end());
  return all;
}

std::string FakeSystem::serial(const std::string& path) {
  const auto found = cameras.find(path);
  return found == cameras.end() ? "" : found->second->serial;
}

int FakeSystem::open(const std::string& path, std::unique_ptr<VideoNode>& node) {
  if (const auto refusal = refusals.find(path); refusal != refusals.end()) return refusal->second;
  const auto found = cameras.find(path);
  if (found == cameras.end()) return ENOENT;
  node = std::make_unique<FakeNode>(found->second);
  return 0;
}

}  // namespace symrig::test
