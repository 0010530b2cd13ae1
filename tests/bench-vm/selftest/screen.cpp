// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/selftest/screen.hpp"

#include <algorithm>
#include <cstring>
#include <memory>
#include <span>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>
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
using Resources = std::unique_ptr<drmModeRes, FreedBy<drmModeFreeResources>>;
using Connector = std::unique_ptr<drmModeConnector, FreedBy<drmModeFreeConnector>>;

}  // namespace

Screen::Screen(const std::string& card, int cols, int rows)
    : rows_(rows), cols_(cols), card_(open(card.c_str(), O_RDWR | O_CLOEXEC)) {  // NOLINT(*-vararg)
  error_ = card_ < 0 ? card + " cannot be opened" : set_up();
}

Screen::~Screen() {
  if (memory_ != nullptr) munmap(memory_, bytes_);
  if (card_ < 0) return;
  if (crtc_ != 0) drmModeSetCrtc(card_, crtc_, 0, 0, 0, nullptr, 0, nullptr);
  close(card_);
}

std::string Screen::make_buffer() {
  drm_mode_create_dumb dumb{};
  dumb.width = static_cast<std::uint32_t>(cols_);
  dumb.height = static_cast<std::uint32_t>(rows_);
  dumb.bpp = 32;
  if (drmIoctl(card_, DRM_IOCTL_MODE_CREATE_DUMB, &dumb) != 0) return "no memory for the buffer";
  pitch_ = dumb.pitch;
  bytes_ = dumb.size;
  if (drmModeAddFB(card_, dumb.width, dumb.height, 24, 32, pitch_, dumb.handle, &buffer_) != 0)
    return "the buffer cannot be shown";
  drm_mode_map_dumb map{};
  map.handle = dumb.handle;
  if (drmIoctl(card_, DRM_IOCTL_MODE_MAP_DUMB, &map) != 0) return "the buffer cannot be mapped";
  void* memory =
      mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, card_, static_cast<off_t>(map.offset));
  if (memory == MAP_FAILED) return "the buffer cannot be mapped";
  memory_ = static_cast<std::byte*>(memory);
  return "";
}

std::string Screen::set_up() {
  const Resources resources(drmModeGetResources(card_));
  if (!resources || resources->count_crtcs < 1 || resources->count_connectors < 1)
    return "the card has no screen";
  const Connector connector(drmModeGetConnector(card_, resources->connectors[0]));
  if (!connector) return "the card has no connector";
  const auto modes = std::span(connector->modes, static_cast<std::size_t>(connector->count_modes));
  const auto mode = std::ranges::find_if(
      modes, [&](const drmModeModeInfo& m) { return m.hdisplay == cols_ && m.vdisplay == rows_; });
  if (mode == modes.end()) return "the display has no mode of this size";
  if (std::string failed = make_buffer(); !failed.empty()) return failed;
  std::uint32_t id = connector->connector_id;
  if (drmModeSetCrtc(card_, resources->crtcs[0], buffer_, 0, 0, &id, 1, &*mode) != 0)
    return "the mode cannot be set";
  crtc_ = resources->crtcs[0];
  return "";
}

std::string Screen::show(const std::vector<std::uint32_t>& rgb) {
  if (memory_ == nullptr || rgb.size() != static_cast<std::size_t>(rows_) * static_cast<std::size_t>(cols_))
    return "not a picture of this screen";
  const std::size_t row = static_cast<std::size_t>(cols_) * sizeof(std::uint32_t);
  for (std::size_t y = 0; y < static_cast<std::size_t>(rows_); ++y)
    std::memcpy(memory_ + y * pitch_, &rgb[y * static_cast<std::size_t>(cols_)], row);
  return "";
}

}  // namespace symrig::bench_vm
