// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// What the header of an OpenEXR file states beside its pixels (docs/images.md). Empty parts are left out.
struct PictureFacts {
  std::string units = {};  ///< of the values
  std::optional<double> exposure =
      {};                  ///< factor that maps white to 1 on a screen; the values are without it
  std::string view = {};   ///< who sees it: "camera", "projector"
  std::string light = {};  ///< the light that the scene is under
  std::string scene = {};  ///< SHA-256 of the scene file

  bool operator==(const PictureFacts&) const = default;
};

/// Reads what an OpenEXR file states. Other pictures, and files of other programs, state nothing.
/// fails: not_found, io, bad_format (a damaged OpenEXR header).
Result<PictureFacts> read_picture_facts(const std::filesystem::path& path);

/// The largest number of pixels of a picture that can be read. It is compared with the header before anything
/// is allocated.
inline constexpr std::int64_t kMaxPicturePixels = std::int64_t{1} << 27;

/// Reads a picture. The content of the file chooses the format, never its name.
/// - OpenEXR: float, half or uint; R G B → 3 channels, any single channel → 1; A is ignored.
/// - PNG: 1 to 16 bits, grey, RGB or palette; value = code / largest code, *linear* (no tone curve is
/// undone); alpha is ignored, the colours stay as stored; grey → 1 channel, colour → 3.
/// - PFM: PF → 3 channels, Pf → 1; values as stored (the scale line's magnitude is not applied).
/// fails: not_found, io, bad_format (no known picture, truncated, damaged, too large), bad_value (NaN or
/// infinity; names the first such pixel).
Result<Image<float>> read_image(const std::filesystem::path& path);
/// As read_image, from memory. name: for messages.
Result<Image<float>> decode_image(std::span<const std::byte> bytes, const std::string& name);

/// True if a name ends in .exr, .pfm or .png, in small or large letters.
bool has_picture_suffix(const std::filesystem::path& path);
/// True if a name begins with a dot. A folder's pictures are those without: "._01.png" is what macOS keeps
/// beside 01.png on exFAT and network drives, and ".01.png" may still be being written.
bool has_hidden_name(const std::filesystem::path& path);

/// Writes a linear picture of 1 or 3 channels. The suffix chooses the format: .exr (32-bit float), .pfm, .png
/// (16 bits, clipped to [0,1], linear). The file is written atomically. facts: go into an OpenEXR header.
/// fails: bad_argument (another suffix, other channels, empty), bad_value (NaN or infinity), not_found, io.
Result<void> write_image(const std::filesystem::path& path, const Image<float>& image,
                         const PictureFacts& facts = {});

/// Writes a picture for viewing: 8-bit PNG, sRGB tone curve of exposure · value, clipped. The file is written
/// atomically.
/// fails: as write_image, and bad_argument unless exposure is positive and finite.
Result<void> write_display_png(const std::filesystem::path& path, const Image<float>& image,
                               double exposure = 1);

/// The factor that maps all values but the brightest half percent below white; 1 for a dark picture.
double automatic_exposure(const Image<float>& picture);

/// exposure · value through the sRGB curve (IEC 61966-2-1), clipped and rounded to 8 bits. NaN becomes 0.
Image<std::uint8_t> to_display(const Image<float>& image, double exposure = 1);

/// 8-bit PNG in memory, 1 or 3 channels. The codes stay unchanged (call to_display first). Empty if the image
/// is empty or has other channels.
std::vector<std::uint8_t> encode_png(const Image<std::uint8_t>& image);

/// 1-bit PNG in memory: black where the code is 0, else white. Empty if the image is empty or has more than
/// one channel.
std::vector<std::uint8_t> encode_bit_png(const Image<std::uint8_t>& image);

/// The bytes of the OpenEXR file that write_image would write: 32-bit float, ZIP, 1 or 3 channels.
/// fails: bad_argument (empty, other channels), io.
Result<std::vector<std::byte>> encode_exr(const Image<float>& image);

/// Whether all values are finite. name: of the picture, for the message.
/// fails: bad_value (NaN or infinity; names the first such pixel).
Result<void> check_finite(const Image<float>& image, const std::string& name);
/// The same for planes of a grid in memory of the caller.
Result<void> check_finite(std::span<const float> values, Grid grid, const std::string& name);

}  // namespace symrig
