// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scanout/scanout.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <memory>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>
#include <xf86drm.h>
#include <xf86drmMode.h>

namespace symrig::bench_vm {

namespace {

constexpr std::uint32_t kBitsPerPixel = 32;
constexpr std::uint32_t kColours = 0x00ff'ffff;  // the highest byte is unused

template <auto Free>
struct FreedBy {
  template <class T>
  void operator()(T* pointer) const {
    Free(pointer);
  }
};
using Resources = std::unique_ptr<drmModeRes, FreedBy<drmModeFreeResources>>;
using Crtc = std::unique_ptr<drmModeCrtc, FreedBy<drmModeFreeCrtc>>;
using Framebuffer = std::unique_ptr<drmModeFB, FreedBy<drmModeFreeFB>>;

Error io_error(std::string what) {
  return {ErrorCode::io, fmt::format("{}: {}", what, std::generic_category().message(errno)),
          "is this root?"};
}

class Card {
 public:
  explicit Card(const std::string& path)
      : file_(open(path.c_str(), O_RDWR | O_CLOEXEC)) {}  // NOLINT(*-vararg)
  Card(const Card&) = delete;
  Card& operator=(const Card&) = delete;
  ~Card() {
    if (file_ >= 0) close(file_);
  }
  int file() const { return file_; }

 private:
  int file_;
};

/// The first screen that shows a picture.
std::optional<std::uint32_t> shown_framebuffer(int card) {
  const Resources resources(drmModeGetResources(card));
  if (!resources) return std::nullopt;
  for (const std::uint32_t id :
       std::span(resources->crtcs, static_cast<std::size_t>(resources->count_crtcs))) {
    const Crtc crtc(drmModeGetCrtc(card, id));
    if (crtc && crtc->buffer_id != 0) return crtc->buffer_id;
  }
  return std::nullopt;
}

/// Maps a buffer of the card into memory. The handle is a reference of our own, and is released so that
/// handles do not accumulate.
class Mapping {
 public:
  Mapping(int card, const drmModeFB& buffer) : bytes_(std::size_t{buffer.pitch} * buffer.height) {
    drm_mode_map_dumb map{};
    map.handle = buffer.handle;
    if (drmIoctl(card, DRM_IOCTL_MODE_MAP_DUMB, &map) == 0)
      memory_ = mmap(nullptr, bytes_, PROT_READ, MAP_SHARED, card, static_cast<off_t>(map.offset));
    const int error = errno;
    drm_gem_close handle{};
    handle.handle = buffer.handle;
    drmIoctl(card, DRM_IOCTL_GEM_CLOSE, &handle);
    errno = error;
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;
  ~Mapping() {
    if (ok()) munmap(memory_, bytes_);
  }
  bool ok() const { return memory_ != MAP_FAILED; }
  const std::byte* row(std::size_t y, std::uint32_t pitch) const {
    return static_cast<const std::byte*>(memory_) + y * pitch;
  }

 private:
  void* memory_ = MAP_FAILED;
  std::size_t bytes_;
};

ScreenPixels copy(const drmModeFB& buffer, const Mapping& mapping) {
  ScreenPixels pixels{buffer.fb_id, static_cast<int>(buffer.height), static_cast<int>(buffer.width), {}};
  pixels.rgb.resize(std::size_t{buffer.width} * buffer.height);
  for (std::size_t y = 0; y < buffer.height; ++y)
    std::memcpy(&pixels.rgb[y * buffer.width], mapping.row(y, buffer.pitch),
                std::size_t{buffer.width} * sizeof(std::uint32_t));
  for (std::uint32_t& pixel : pixels.rgb) pixel &= kColours;
  return pixels;
}

}  // namespace

Result<ScreenPixels> read_screen(const std::string& card) {
  const Card opened(card);
  if (opened.file() < 0)
    return Error{ErrorCode::not_found,
                 fmt::format("{} cannot be opened: {}", card, std::generic_category().message(errno))};
  drmDropMaster(opened.file());  // opening an idle card made this process its master
  const auto shown = shown_framebuffer(opened.file());
  if (!shown) return Error{ErrorCode::not_found, fmt::format("{} shows nothing", card)};
  const Framebuffer buffer(drmModeGetFB(opened.file(), *shown));
  if (!buffer || buffer->handle == 0)
    return io_error(fmt::format("{}: cannot get the buffer on its screen", card));
  if (buffer->bpp != kBitsPerPixel)
    return Error{ErrorCode::bad_format,
                 fmt::format("{} shows {} bits a pixel, not {}", card, buffer->bpp, kBitsPerPixel)};
  const Mapping mapping(opened.file(), *buffer);
  if (!mapping.ok()) return io_error(fmt::format("{}: cannot map the buffer on its screen", card));
  return copy(*buffer, mapping);
}

std::size_t differing_pixels(const ScreenPixels& a, const ScreenPixels& b) {
  if (a.rows != b.rows || a.cols != b.cols) return std::max(a.rgb.size(), b.rgb.size());
  std::size_t differing = 0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) differing += a.rgb[i] != b.rgb[i] ? 1 : 0;
  return differing;
}

namespace {

constexpr std::string_view kBlank = " \t\r\n";
constexpr int kMostPixels = 1 << 26;

/// Takes the next word of the header from `text`. Empty at its end.
std::string_view next_word(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(kBlank));
  text.remove_prefix(word.size());
  return word;
}

/// 0 if the next word is not a number.
int next_number(std::string_view& text) {
  const std::string_view word = next_word(text);
  int number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc{} && end == word.data() + word.size() && number > 0 ? number : 0;
}

std::uint32_t colour(std::string_view bytes) {
  std::uint32_t rgb = 0;
  for (const char byte : bytes) rgb = rgb << 8U | static_cast<std::uint8_t>(byte);
  return rgb;
}

}  // namespace

Result<ScreenPixels> parse_ppm(std::span<const std::byte> bytes) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): text is what the head of the file is
  std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const Error bad{ErrorCode::bad_format, "not a binary PPM with 8 bits a sample"};
  if (next_word(text) != "P6") return bad;
  const int cols = next_number(text);
  const int rows = next_number(text);
  if (cols == 0 || rows == 0 || rows > kMostPixels / cols || next_number(text) != 255 || text.empty())
    return bad;
  text.remove_prefix(1);
  ScreenPixels pixels{0, rows, cols, std::vector<std::uint32_t>(static_cast<std::size_t>(rows) * cols)};
  if (text.size() != 3 * pixels.rgb.size()) return bad;
  for (std::size_t i = 0; i < pixels.rgb.size(); ++i) pixels.rgb[i] = colour(text.substr(3 * i, 3));
  return pixels;
}

}  // namespace symrig::bench_vm
