// SPDX-License-Identifier: Apache-2.0
// Displays: the bench reads back exactly what a program shows, on vkms and on QEMU's adapter.
#include "assert_ok.hpp"
#include "bench-vm/scanout/scanout.hpp"
#include "bench-vm/selftest/guest.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>
#include <xf86drm.h>
#include <xf86drmMode.h>

namespace symrig::bench_vm::screens_test {
namespace {

/// A display that shows one picture in the simplest way: a mode, a buffer, no flips. The destructor switches
/// it off.
class Screen {
 public:
  /// Uses the card's mode of this size. error() is empty after success.
  Screen(const std::string& card, int cols, int rows);
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;
  ~Screen();

  /// 0x00RRGGBB in raster order. Returns the error, empty after success.
  std::string show(const std::vector<std::uint32_t>& rgb);
  const std::string& error() const { return error_; }
  int rows() const { return rows_; }
  int cols() const { return cols_; }

 private:
  std::string set_up();
  std::string make_buffer();

  int rows_, cols_;
  int card_;
  std::uint32_t crtc_ = 0, buffer_ = 0, pitch_ = 0;
  std::byte* memory_ = nullptr;
  std::size_t bytes_ = 0;
  std::string error_;
};

template <auto Free>
struct FreedBy {
  template <class T>
  void operator()(T* pointer) const {
    Free(pointer);
  }
};
using Resources = std::unique_ptr<drmModeRes, FreedBy<drmModeFreeResources>>;
using Connector = std::unique_ptr<drmModeConnector, FreedBy<drmModeFreeConnector>>;

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

std::vector<std::uint32_t> random_pixels(std::size_t count) {
  std::mt19937 random(7);
  std::vector<std::uint32_t> rgb(count);
  for (std::uint32_t& pixel : rgb) pixel = random() & 0x00ff'ffffU;
  return rgb;
}

/// Shows `rgb` and expects to read back the same.
void expect_read_back(Screen& screen, const std::string& card, std::vector<std::uint32_t> rgb) {
  ASSERT_EQ(screen.show(rgb), "");
  const auto seen = read_screen(card);
  ASSERT_OK(seen);
  EXPECT_EQ(differing_pixels(*seen, {0, screen.rows(), screen.cols(), std::move(rgb)}), 0U);
}

TEST(Vkms, shows_what_can_be_read_back) {
  const std::string card = place("BENCH_VKMS");
  for (const auto& [cols, rows] : {std::pair{1024, 768}, std::pair{1920, 1080}}) {
    Screen screen(card, cols, rows);
    ASSERT_EQ(screen.error(), "");
    const auto random = random_pixels(static_cast<std::size_t>(rows) * static_cast<std::size_t>(cols));
    expect_read_back(screen, card, random);
    std::vector<std::uint32_t> other = random;
    other[12345] ^= 1U;
    expect_read_back(screen, card, other);
    const auto seen = read_screen(card);
    ASSERT_OK(seen);
    EXPECT_EQ(differing_pixels(*seen, {0, rows, cols, random}), 1U);
  }
}

TEST(Screens, that_are_not_there_are_named) {
  const auto seen = read_screen("/dev/dri/card7");
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().code, ErrorCode::not_found);
  EXPECT_NE(seen.error().what.find("card7"), std::string::npos);
}

TEST(Vga, shows_what_can_be_read_back_and_photographed_from_outside) {
  const std::string card = place("BENCH_VGA");
  Screen screen(card, 912, 1140);
  ASSERT_EQ(screen.error(), "");
  const auto random = random_pixels(std::size_t{912} * 1140);
  expect_read_back(screen, card, random);
  ASSERT_EQ(std::system("bench-screendump shot"), 0);  // NOLINT(*-mt-unsafe,cert-env33-c)
  const std::string file = read_text(place("BENCH_OUT") + "/shot.ppm");
  const auto shot = parse_ppm(std::as_bytes(std::span(file)));
  ASSERT_OK(shot);
  EXPECT_EQ(differing_pixels(*shot, {0, 1140, 912, random}), 0U);
}

TEST(Screendump, of_a_bad_name_is_refused) {
  EXPECT_NE(std::system("bench-screendump ../shot 2>/dev/null"), 0);  // NOLINT(*-mt-unsafe,cert-env33-c)
}

}  // namespace
}  // namespace symrig::bench_vm::screens_test
