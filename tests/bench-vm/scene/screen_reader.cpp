// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/screen_reader.hpp"

#include "bench-vm/scene/ports.hpp"
#include "symrig/base/files.hpp"

#include <memory>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <xf86drm.h>
#include <xf86drmMode.h>

namespace symrig::bench_vm {

namespace {

template <auto Free>
struct FreedBy {
  template <class T>
  void operator()(T* pointer) const {
    Free(pointer);
  }
};
template <class T, auto Free>
using Owned = std::unique_ptr<T, FreedBy<Free>>;
using Crtc = Owned<drmModeCrtc, drmModeFreeCrtc>;
using Framebuffer = Owned<drmModeFB, drmModeFreeFB>;
using Resources = Owned<drmModeRes, drmModeFreeResources>;

constexpr std::uint32_t kBitsPerPixel = 32;

/// The offset of a framebuffer's memory for mmap(). Releases the handle, so that handles do not accumulate.
std::uint64_t offset_of(int card, std::uint32_t handle) {
  drm_mode_map_dumb request{};
  request.handle = handle;
  const int failed = drmIoctl(card, DRM_IOCTL_MODE_MAP_DUMB, &request);
  return failed != 0 ? 0 : request.offset;
}

void close_handle(int card, std::uint32_t handle) {
  drm_gem_close request{};
  request.handle = handle;
  drmIoctl(card, DRM_IOCTL_GEM_CLOSE, &request);
}

}  // namespace

Result<ScreenReader> ScreenReader::open(const std::string& card, const Placement& placement) {
  Fd file(::open(card.c_str(), O_RDWR | O_CLOEXEC));  // NOLINT(cppcoreguidelines-pro-type-vararg)
  if (!file) return system_error(fmt::format("{} cannot be opened", card), "needs root in the guest");
  drmDropMaster(file.get());  // the first program to open a card becomes its master, but this one only reads
  const Resources resources(drmModeGetResources(file.get()));
  if (!resources || resources->count_crtcs < 1)
    return Error{ErrorCode::not_found, fmt::format("{} has no screen", card), "see /sys/class/drm"};
  return ScreenReader(std::move(file), resources->crtcs[0], placement);
}

ScreenReader::ScreenReader(ScreenReader&& other) noexcept
    : card_(std::move(other.card_)),
      crtc_(other.crtc_),
      placement_(other.placement_),
      framebuffer_(std::exchange(other.framebuffer_, 0)),
      mapped_(std::exchange(other.mapped_, 0)),
      pixels_(std::exchange(other.pixels_, {})),
      glance_(other.glance_),
      picture_(std::move(other.picture_)) {}

ScreenReader::~ScreenReader() {
  unmap();
}

void ScreenReader::unmap() {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-const-cast): munmap() takes what mmap() gave
  if (mapped_ > 0) munmap(const_cast<std::byte*>(pixels_.first), mapped_);
  mapped_ = 0;
  framebuffer_ = 0;
  pixels_ = {};
}

bool ScreenReader::map(std::uint32_t framebuffer) {
  unmap();
  const Framebuffer fb(drmModeGetFB(card_.get(), framebuffer));
  if (!fb || fb->handle == 0) return false;
  const std::uint64_t offset = fb->bpp == kBitsPerPixel ? offset_of(card_.get(), fb->handle) : 0;
  const std::size_t bytes = static_cast<std::size_t>(fb->pitch) * fb->height;
  void* memory = offset == 0
                     ? MAP_FAILED
                     : mmap(nullptr, bytes, PROT_READ, MAP_SHARED, card_.get(), static_cast<off_t>(offset));
  close_handle(card_.get(), fb->handle);  // the mapping keeps the memory
  if (memory == MAP_FAILED) return false;
  mapped_ = bytes;
  framebuffer_ = framebuffer;
  pixels_ = {static_cast<const std::byte*>(memory), fb->pitch, static_cast<int>(fb->height),
             static_cast<int>(fb->width)};
  return true;
}

Result<Refresh> ScreenReader::wait_refresh() const {
  drmVBlank request{};
  request.request.type = DRM_VBLANK_RELATIVE;
  request.request.sequence = 1;
  if (drmWaitVBlank(card_.get(), &request) != 0)
    return Error{ErrorCode::device_lost, "the screen is off", "the screen starts when a program sets a mode"};
  return Refresh{request.reply.sequence,
                 Nanoseconds{request.reply.tval_sec * 1'000'000'000L + request.reply.tval_usec * 1'000L}};
}

/// false: no picture is scanned out, or it cannot be read.
bool ScreenReader::follow_framebuffer() {
  const Crtc crtc(drmModeGetCrtc(card_.get(), crtc_));
  const std::uint32_t framebuffer = crtc && crtc->mode_valid != 0 ? crtc->buffer_id : 0;
  if (framebuffer == 0) {
    unmap();
    return false;
  }
  mapped_anew_ = framebuffer != framebuffer_;
  return !mapped_anew_ || map(framebuffer);
}

const ScanoutPixels* ScreenReader::scanned_out() {
  return follow_framebuffer() ? &pixels_ : nullptr;
}

/// The screen's driver may also draw into the buffer on the screen. So the checksum of cell_checksum()
/// decides.
Picture ScreenReader::read() {
  if (!follow_framebuffer()) return picture_ = nullptr;
  const std::uint64_t seen = cell_checksum(pixels_, placement_);
  if (mapped_anew_ || seen != glance_ || !picture_)
    picture_ = std::make_shared<const Image<float>>(light_on_grid(pixels_, placement_));
  glance_ = seen;
  return picture_;
}

}  // namespace symrig::bench_vm
