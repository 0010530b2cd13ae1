// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/libdrm_kms.hpp"

#include "symrig/base/files.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>

#include <drm_fourcc.h>
#include <sys/mman.h>
#include <xf86drm.h>

namespace symrig::projector::drm {
namespace {

/// Most libdrm functions return −errno. Some return −1 and set errno.
Errno errno_of(int answer) {
  if (answer >= 0) return 0;
  return answer == -1 ? errno : -answer;
}

struct FreeRequest {
  void operator()(drmModeAtomicReq* request) const { drmModeAtomicFree(request); }
};
using Request = std::unique_ptr<drmModeAtomicReq, FreeRequest>;

std::uint32_t flags_of(Commit how) {
  switch (how) {
    case Commit::test:
      return DRM_MODE_ATOMIC_TEST_ONLY | DRM_MODE_ATOMIC_ALLOW_MODESET;
    case Commit::modeset:
      return DRM_MODE_ATOMIC_ALLOW_MODESET;
    case Commit::flip:
      return DRM_MODE_ATOMIC_NONBLOCK | DRM_MODE_PAGE_FLIP_EVENT;
  }
  return 0;
}

/// The kernel returns user data unchanged, so it need not be a valid pointer.
void* as_user_data(std::uint64_t token) {
  return reinterpret_cast<void*>(token);  // NOLINT(performance-no-int-to-ptr)
}

}  // namespace

LibdrmKms::LibdrmKms(Fd card, const std::string& name) : card_(std::move(card)), hotplug_(name) {}

LibdrmKms::~LibdrmKms() = default;

std::string LibdrmKms::driver() {
  drmVersion* version = drmGetVersion(fd());
  if (version == nullptr) return "unknown";
  std::string name(version->name, static_cast<std::size_t>(version->name_len));
  drmFreeVersion(version);
  return name;
}

Errno LibdrmKms::become_master() {
  return drmIsMaster(fd()) != 0 ? 0 : errno_of(drmSetMaster(fd()));
}

bool LibdrmKms::is_master() {
  return drmIsMaster(fd()) != 0;
}

void LibdrmKms::drop_master() {
  drmDropMaster(fd());
}

bool LibdrmKms::enable_atomic() {
  drmSetClientCap(fd(), DRM_CLIENT_CAP_UNIVERSAL_PLANES, 1);
  return drmSetClientCap(fd(), DRM_CLIENT_CAP_ATOMIC, 1) == 0;
}

Answer<std::uint32_t> LibdrmKms::create_blob(std::span<const std::byte> bytes) {
  std::uint32_t id = 0;
  const Errno error = errno_of(drmModeCreatePropertyBlob(fd(), bytes.data(), bytes.size(), &id));
  return {error, id};
}

void LibdrmKms::destroy_blob(std::uint32_t id) {
  drmModeDestroyPropertyBlob(fd(), id);
}

Answer<Buffer> LibdrmKms::create_buffer(Grid grid) {
  const auto width = static_cast<std::uint32_t>(grid.cols);
  const auto height = static_cast<std::uint32_t>(grid.rows);
  Answer<Buffer> answer;
  Buffer& buffer = answer.value;
  std::uint32_t pitch = 0;
  std::uint64_t bytes = 0, offset = 0;
  answer.error =
      errno_of(drmModeCreateDumbBuffer(fd(), width, height, 32, 0, &buffer.handle, &pitch, &bytes));
  if (!answer) return answer;
  const std::uint32_t handles[4] = {buffer.handle}, pitches[4] = {pitch}, offsets[4] = {};
  answer.error = errno_of(
      drmModeAddFB2(fd(), width, height, DRM_FORMAT_XRGB8888, handles, pitches, offsets, &buffer.fb, 0));
  if (answer) answer.error = errno_of(drmModeMapDumbBuffer(fd(), buffer.handle, &offset));
  void* memory =
      answer ? ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd(), static_cast<off_t>(offset))
             : MAP_FAILED;
  if (answer && memory == MAP_FAILED) answer.error = errno;
  if (answer) {
    buffer.pitch = pitch / sizeof(std::uint32_t);
    buffer.words = {static_cast<std::uint32_t*>(memory), bytes / sizeof(std::uint32_t)};
  } else {
    destroy_buffer(buffer);
  }
  return answer;
}

void LibdrmKms::destroy_buffer(const Buffer& buffer) {
  if (!buffer.words.empty()) ::munmap(buffer.words.data(), buffer.words.size_bytes());
  if (buffer.fb != 0) drmModeRmFB(fd(), buffer.fb);
  if (buffer.handle != 0) drmModeDestroyDumbBuffer(fd(), buffer.handle);
}

Errno LibdrmKms::commit(std::span<const Setting> settings, Commit how, std::uint64_t token) {
  const Request request(drmModeAtomicAlloc());
  if (!request) return ENOMEM;
  for (const Setting& setting : settings) {
    const int added =
        drmModeAtomicAddProperty(request.get(), setting.object, setting.property, setting.value);
    if (added < 0) return errno_of(added);
  }
  return errno_of(drmModeAtomicCommit(fd(), request.get(), flags_of(how), as_user_data(token)));
}

Errno LibdrmKms::set_crtc(const Crtc& crtc, std::span<const std::uint32_t> connectors) {
  std::vector<std::uint32_t> ids(connectors.begin(), connectors.end());
  drmModeModeInfo mode = crtc.mode.value_or(drmModeModeInfo{});
  return errno_of(drmModeSetCrtc(fd(), crtc.id, crtc.mode ? crtc.fb : 0, crtc.x, crtc.y,
                                 crtc.mode ? ids.data() : nullptr,
                                 crtc.mode ? static_cast<int>(ids.size()) : 0, crtc.mode ? &mode : nullptr));
}

Errno LibdrmKms::set_property(const Setting& setting) {
  return errno_of(drmModeObjectSetProperty(fd(), setting.object, static_cast<std::uint32_t>(setting.kind),
                                           setting.property, setting.value));
}

Errno LibdrmKms::page_flip(std::uint32_t crtc, std::uint32_t fb, std::uint64_t token) {
  return errno_of(drmModePageFlip(fd(), crtc, fb, DRM_MODE_PAGE_FLIP_EVENT, as_user_data(token)));
}

Errno LibdrmKms::disable_plane(std::uint32_t plane) {
  return errno_of(drmModeSetPlane(fd(), plane, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0));
}

Errno LibdrmKms::hide_cursor(std::uint32_t crtc) {
  return errno_of(drmModeSetCursor(fd(), crtc, 0, 0, 0));
}

Answer<Gamma> LibdrmKms::gamma(std::uint32_t crtc, int size) {
  const std::size_t count = size;
  Gamma gamma{std::vector<std::uint16_t>(count), std::vector<std::uint16_t>(count),
              std::vector<std::uint16_t>(count)};
  const Errno error = errno_of(drmModeCrtcGetGamma(fd(), crtc, static_cast<std::uint32_t>(size),
                                                   gamma.red.data(), gamma.green.data(), gamma.blue.data()));
  return {error, std::move(gamma)};
}

Errno LibdrmKms::set_gamma(std::uint32_t crtc, const Gamma& gamma) {
  Gamma copy = gamma;  // libdrm takes pointers to non-const tables
  return errno_of(drmModeCrtcSetGamma(fd(), crtc, static_cast<std::uint32_t>(copy.red.size()),
                                      copy.red.data(), copy.green.data(), copy.blue.data()));
}

Errno LibdrmKms::counts_refreshes(std::uint32_t crtc) {
  std::uint64_t sequence = 0, stamp = 0;
  return errno_of(drmCrtcGetSequence(fd(), crtc, &sequence, &stamp));
}

Answer<FlipEvent> LibdrmKms::next_flip(Nanoseconds patience) {
  return events_.next(fd(), patience);
}

bool LibdrmKms::hotplugged(std::uint32_t connector) {
  return hotplug_.received(connector);
}

SteadyTime LibdrmKms::now() {
  return {steady_now()};
}

void LibdrmKms::sleep_until(SteadyTime time) {
  const std::int64_t ns = time.since.count();
  const timespec until{.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

}  // namespace symrig::projector::drm
