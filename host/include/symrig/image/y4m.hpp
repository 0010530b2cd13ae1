// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// True for a name that ends in .y4m, in small or large letters.
bool is_film(const std::filesystem::path& path);

/// Frames a second of a film, as a fraction.
struct FrameRate {
  std::int64_t frames = 25, seconds = 1;
};

/// Reads a film of uncompressed frames: YUV4MPEG2, one header line, then "FRAME" and its planes, again and
/// again (yuv4mpeg(5) of mjpegtools). 8 to 16 bits; mono, 4:2:0, 4:1:1, 4:2:2, 4:4:4. Chroma and alpha are
/// skipped.
class Y4mReader {
 public:
  /// Finds all frames; reads none.
  /// fails: not_found, io, bad_format (another format, damaged, cut short, interlaced, no frame, too large).
  static Result<Y4mReader> open(const std::filesystem::path& path);

  Grid grid() const { return grid_; }
  FrameRate rate() const { return rate_; }
  std::size_t frames() const { return offsets_.size(); }

  /// The luma of a frame, linear: no tone curve is undone, as with PNG. 1 is white: code 235 of 8 bits, or
  /// 255 if the header says XCOLORRANGE=FULL. 0 is black: code 16, or 0. Beyond both it is clipped.
  /// Frames may be read by several threads at once.
  /// fails: bad_argument (no such frame), io.
  Result<Image<float>> luma(std::size_t frame) const;

 private:
  Y4mReader() = default;

  std::string name_;
  Fd file_;
  Grid grid_;
  FrameRate rate_;
  int bits_ = 8;
  bool full_range_ = false;
  std::vector<std::uint64_t> offsets_;  ///< of the first sample of each frame
};

/// Writes such a film of 8-bit pictures: mono, or 4:4:4 by the full-range matrix of JFIF. It appears under
/// its name when it is finished.
class Y4mWriter {
 public:
  /// channels: 1 or 3.  fails: not_found (no folder), io, bad_argument (other channels, empty).
  static Result<Y4mWriter> begin(const std::filesystem::path& path, Grid grid, int channels, FrameRate rate);
  Y4mWriter(Y4mWriter&& other) noexcept;
  Y4mWriter& operator=(Y4mWriter&&) = delete;
  /// An unfinished film is deleted.
  ~Y4mWriter();

  /// codes: as to_display makes them.  fails: size_mismatch, io.
  Result<void> add(const Image<std::uint8_t>& codes);
  /// The samples of a frame as a film has them, plane after plane; codes: of 1 or 3 channels. Luma and chroma
  /// are within 0.51 of what ITU-T T.871 (JFIF) says before rounding.
  static std::vector<char> planes_of(const Image<std::uint8_t>& codes);
  /// planes: of planes_of(), which several threads may call at once.  fails: as add().
  Result<void> add_planes(std::span<const char> planes);
  /// fails: io.
  Result<void> finish();

 private:
  Y4mWriter() = default;
  Error cannot_be_written() const;

  std::filesystem::path path_, target_, temporary_;  ///< temporary_: empty when finished
  Grid grid_;
  int channels_ = 1;
  std::ofstream out_;
};

}  // namespace symrig
