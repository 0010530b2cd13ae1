// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/selftest/testcam_client.hpp"

#include "bench-vm/selftest/guest.hpp"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace symrig::bench_vm {

namespace {

constexpr std::uint32_t kBuffers = 4;

// NOLINTBEGIN(cppcoreguidelines-pro-type-vararg): open() and ioctl() are what they are
int open_device(const std::string& path) {
  return open(path.c_str(), O_RDWR | O_CLOEXEC);
}

/// 0 or the errno.
int ask(int file, unsigned long request, void* argument) {
  while (ioctl(file, request, argument) != 0)
    if (errno != EINTR) return errno;
  return 0;
}
// NOLINTEND(cppcoreguidelines-pro-type-vararg)

v4l2_buffer buffer_of(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

}  // namespace

Injector::Injector() : file_(open_device(TESTCAM_DEVICE)) {}

Injector::~Injector() {
  if (file_ >= 0) close(file_);
}

int Injector::frame(const testcam_frame& head, std::span<const std::byte> pixels) const {
  std::vector<std::byte> message(sizeof(head) + pixels.size());
  std::memcpy(message.data(), &head, sizeof(head));
  if (!pixels.empty()) std::memcpy(message.data() + sizeof(head), pixels.data(), pixels.size());
  const ssize_t written = write(file_, message.data(), message.size());
  return written == static_cast<ssize_t>(message.size()) ? 0 : errno;
}

testcam_state Injector::state() const {
  testcam_state state{};
  ask(file_, TESTCAM_GET_STATE, &state);
  return state;
}

int Injector::command(unsigned long request) const {
  return ask(file_, request, nullptr);
}

int Injector::unplug() const {
  return command(TESTCAM_UNPLUG);
}

int Injector::plug() const {
  return command(TESTCAM_PLUG);
}

Stream::Stream(const std::string& path) : file_(open_device(path)) {}

Stream::~Stream() {
  for (const Mapping& mapping : buffers_) munmap(mapping.memory, mapping.bytes);
  if (file_ >= 0) close(file_);
}

v4l2_pix_format Stream::set_format(std::uint32_t fourcc, std::uint32_t width, std::uint32_t height) const {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.pixelformat = fourcc;
  format.fmt.pix.width = width;
  format.fmt.pix.height = height;
  return ask(file_, VIDIOC_S_FMT, &format) == 0 ? format.fmt.pix : v4l2_pix_format{};
}

bool Stream::map(std::uint32_t index) {
  v4l2_buffer buffer = buffer_of(index);
  if (ask(file_, VIDIOC_QUERYBUF, &buffer) != 0) return false;
  void* memory = mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, file_, buffer.m.offset);
  if (memory == MAP_FAILED) return false;
  buffers_.push_back({memory, buffer.length});
  return true;
}

int Stream::start(std::uint32_t queued) {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int error = ask(file_, VIDIOC_REQBUFS, &request)) return error;
  for (std::uint32_t i = 0; i < request.count; ++i)
    if (!map(i)) return errno;
  for (std::uint32_t i = 0; i < queued; ++i)
    if (const int error = requeue(i)) return error;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  return ask(file_, VIDIOC_STREAMON, &type);
}

int Stream::stop() const {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  return ask(file_, VIDIOC_STREAMOFF, &type);
}

std::optional<v4l2_buffer> Stream::take() {
  v4l2_buffer buffer = buffer_of(0);
  error_ = ask(file_, VIDIOC_DQBUF, &buffer);
  return error_ == 0 ? std::optional(buffer) : std::nullopt;
}

std::span<const std::byte> Stream::pixels(const v4l2_buffer& buffer) const {
  return {static_cast<const std::byte*>(buffers_[buffer.index].memory), buffer.bytesused};
}

int Stream::requeue(std::uint32_t index) const {
  v4l2_buffer buffer = buffer_of(index);
  return ask(file_, VIDIOC_QBUF, &buffer);
}

int Stream::set_control(std::uint32_t id, std::int32_t value) const {
  v4l2_control control{.id = id, .value = value};
  return ask(file_, VIDIOC_S_CTRL, &control);
}

}  // namespace symrig::bench_vm
