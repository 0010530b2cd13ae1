// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// The most pixels a picture may have to be read. Checked against its header before anything is allocated.
inline constexpr std::int64_t kMaxPicturePixels = std::int64_t{1} << 27;

/// Reads a picture; the format is chosen by the file's content, never by its name.
///   OpenEXR  float, half or uint; R G B → 3 channels, any single channel → 1; A is dropped
///   PNG      1 to 16 bits, grey, RGB, palette: value = code / largest code, *linear* (no tone curve undone);
///            alpha is dropped and the colours stay as stored; grey → 1 channel, colour → 3
///   PFM      PF → 3 channels, Pf → 1; values as stored (the size of the scale line is not applied)
/// fails: not_found, io, bad_format (no known picture, truncated, damaged, too large), bad_value (NaN or
/// infinity: the first such pixel is named).
Result<Image<float>> read_image(const std::filesystem::path& path);
/// The same from memory; `name` stands in messages.
Result<Image<float>> decode_image(std::span<const std::byte> bytes, const std::string& name);

/// Writes a linear picture of 1 or 3 channels; the suffix chooses: .exr (32-bit float), .pfm, .png (16 bits,
/// clipped to [0,1], linear). Written atomically.
/// fails: bad_argument (another suffix, other channels, empty), bad_value (NaN or infinity), not_found, io.
Result<void> write_image(const std::filesystem::path& path, const Image<float>& image);

/// A picture for people: 8-bit PNG, sRGB tone curve of exposure · value, clipped. Written atomically.
/// fails: as write_image, and bad_argument unless exposure is positive and finite.
Result<void> write_display_png(const std::filesystem::path& path, const Image<float>& image,
                               double exposure = 1);

/// exposure · value through the sRGB curve (IEC 61966-2-1), clipped and rounded to 8 bits. NaN becomes 0.
Image<std::uint8_t> to_display(const Image<float>& image, double exposure = 1);

/// 8-bit PNG in memory, codes as they are (say to_display first), 1 or 3 channels.
/// Empty if the image is empty or has other channels.
std::vector<std::uint8_t> encode_png(const Image<std::uint8_t>& image);

/// 1-bit PNG in memory: black where the code is 0, else white. Empty if the image is empty or has more than
/// one channel.
std::vector<std::uint8_t> encode_bit_png(const Image<std::uint8_t>& image);

}  // namespace symrig
