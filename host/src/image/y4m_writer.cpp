// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/atomic_file.hpp"
#include "symrig/image/y4m.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

char sample_of(double value) {
  return static_cast<char>(static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))));
}

/// Y, Cb, Cr of R, G, B, all 0 to 255 (ITU-T T.871, JFIF, section 7).
std::array<char, 3> jfif(double r, double g, double b) {
  const double luma = 0.299 * r + 0.587 * g + 0.114 * b;
  return {sample_of(luma), sample_of(128 + (b - luma) / 1.772), sample_of(128 + (r - luma) / 1.402)};
}

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
      out_(std::move(other.out_)),
      planes_(std::move(other.planes_)) {}

Y4mWriter::~Y4mWriter() {
  if (temporary_.empty()) return;
  out_.close();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

Result<void> Y4mWriter::add(const Image<std::uint8_t>& codes) {
  if (codes.grid() != grid_ || codes.channels() != channels_)
    return Error{ErrorCode::size_mismatch, fmt::format("{}: a frame of another size", path_.string())};
  const auto pixels = static_cast<std::size_t>(grid_.size());
  planes_.resize(pixels * static_cast<std::size_t>(channels_));
  if (channels_ == 1) {
    std::transform(codes.values().begin(), codes.values().end(), planes_.begin(),
                   [](std::uint8_t code) { return static_cast<char>(code); });
  } else {
    const auto red = codes.plane(0), green = codes.plane(1), blue = codes.plane(2);
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::array<char, 3> one = jfif(red[i], green[i], blue[i]);
      for (std::size_t plane = 0; plane < one.size(); ++plane) planes_[plane * pixels + i] = one[plane];
    }
  }
  out_ << "FRAME\n";
  out_.write(planes_.data(), static_cast<std::streamsize>(planes_.size()));
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
