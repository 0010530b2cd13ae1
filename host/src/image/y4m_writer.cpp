// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/files.hpp"
#include "symrig/image/y4m.hpp"

#include <algorithm>
#include <cstdint>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

/// One plane of Y, Cb, Cr from codes of R, G, B (ITU-T T.871, JFIF, section 7), in whole numbers, so that
/// several pixels are made at once.
struct JfifPlane {
  std::int32_t red, green, blue;  ///< weights in 65536ths
  std::int32_t zero;              ///< code of a plane that is 0

  char of(std::uint8_t r, std::uint8_t g, std::uint8_t b) const {
    const std::int32_t sum = red * r + green * g + blue * b + (zero << 16) + (1 << 15);
    return static_cast<char>(static_cast<std::uint8_t>(std::min(sum >> 16, 255)));
  }
};

// 0.299, 0.587, 0.114; the same over -1.772, and 0.5 for blue; over -1.402, and 0.5 for red. Rounded, they
// add up to 1, 0 and 0 as before, so grey stays grey.
constexpr JfifPlane kLuma{19595, 38470, 7471, 0};
constexpr JfifPlane kBlueness{-11058, -21710, 32768, 128};
constexpr JfifPlane kRedness{32768, -27439, -5329, 128};
static_assert(kLuma.red + kLuma.green + kLuma.blue == 1 << 16);
static_assert(kBlueness.red + kBlueness.green + kBlueness.blue == 0);
static_assert(kRedness.red + kRedness.green + kRedness.blue == 0);

}  // namespace

Error Y4mWriter::cannot_be_written() const {
  return {ErrorCode::io, path_.string() + " cannot be written",
          "check the folder, its permissions and the free space"};
}

Result<Y4mWriter> Y4mWriter::begin(const std::filesystem::path& path, Grid grid, int channels,
                                   FrameRate rate) {
  if (!grid.valid() || (channels != 1 && channels != 3))
    return Error{ErrorCode::bad_argument, fmt::format("{}: cannot write a film of {} pixels and {} channels",
                                                      path.string(), to_string(grid), channels)};
  Y4mWriter film;
  film.path_ = path;
  SYMRIG_TRY(film.target_, replaceable_file(path));
  film.temporary_ = temporary_name(film.target_);
  film.grid_ = grid;
  film.channels_ = channels;
  film.out_.open(film.temporary_, std::ios::binary);
  film.out_ << fmt::format("YUV4MPEG2 W{} H{} F{}:{} Ip A1:1 C{} XCOLORRANGE=FULL\n", grid.cols, grid.rows,
                           rate.frames, rate.seconds, channels == 1 ? "mono" : "444");
  if (!film.out_) return film.cannot_be_written();
  return film;
}

Y4mWriter::Y4mWriter(Y4mWriter&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      grid_(other.grid_),
      channels_(other.channels_),
      out_(std::move(other.out_)) {}

Y4mWriter::~Y4mWriter() {
  if (temporary_.empty()) return;
  out_.close();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

Result<void> Y4mWriter::add(const Image<std::uint8_t>& codes) {
  if (codes.grid() != grid_ || codes.channels() != channels_)
    return Error{ErrorCode::size_mismatch, fmt::format("{}: a frame of another size", path_.string())};
  return add_planes(planes_of(codes));
}

std::vector<char> Y4mWriter::planes_of(const Image<std::uint8_t>& codes) {
  std::vector<char> planes(codes.values().size());
  if (codes.channels() == 1) {
    std::transform(codes.values().begin(), codes.values().end(), planes.begin(),
                   [](std::uint8_t code) { return static_cast<char>(code); });
    return planes;
  }
  const auto red = codes.plane(0), green = codes.plane(1), blue = codes.plane(2);
  const std::size_t pixels = red.size();
  char* to = planes.data();
  for (const JfifPlane& plane : {kLuma, kBlueness, kRedness}) {
    for (std::size_t i = 0; i < pixels; ++i) to[i] = plane.of(red[i], green[i], blue[i]);
    to += pixels;
  }
  return planes;
}

Result<void> Y4mWriter::add_planes(std::span<const char> planes) {
  if (planes.size() != static_cast<std::size_t>(grid_.size()) * static_cast<std::size_t>(channels_))
    return Error{ErrorCode::size_mismatch, fmt::format("{}: a frame of another size", path_.string())};
  out_ << "FRAME\n";
  out_.write(planes.data(), static_cast<std::streamsize>(planes.size()));
  return out_ ? Result<void>() : cannot_be_written();
}

Result<void> Y4mWriter::finish() {
  out_.close();
  if (!out_) return cannot_be_written();
  SYMRIG_CHECK(replace_file(temporary_, target_));
  temporary_.clear();
  return {};
}

}  // namespace symrig
