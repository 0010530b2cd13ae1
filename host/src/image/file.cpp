// SPDX-License-Identifier: Apache-2.0
#include "symrig/image/file.hpp"

#include "symrig/base/files.hpp"
#include "symrig/image/internal/codec.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {

namespace image {

Error damaged(const std::string& name, const std::string& what) {
  return {ErrorCode::bad_format, name + ": " + what, "use a complete OpenEXR, PNG or PFM picture"};
}

Result<Grid> checked_grid(std::int64_t rows, std::int64_t cols, const std::string& name) {
  if (rows < 1 || cols < 1) return damaged(name, "header says the picture is empty");
  if (rows > kMaxPicturePixels || cols > kMaxPicturePixels || rows * cols > kMaxPicturePixels)
    return damaged(
        name, fmt::format("header says {}x{} pixels; at most {} are read", rows, cols, kMaxPicturePixels));
  return Grid{static_cast<int>(rows), static_cast<int>(cols)};
}

std::string lower_suffix(const std::filesystem::path& path) {
  std::string suffix = path.extension().string();
  std::ranges::transform(suffix, suffix.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return suffix;
}

}  // namespace image

bool has_picture_suffix(const std::filesystem::path& path) {
  const std::string suffix = image::lower_suffix(path);
  return suffix == ".exr" || suffix == ".pfm" || suffix == ".png";
}

bool has_hidden_name(const std::filesystem::path& path) {
  return path.filename().string().starts_with('.');
}

namespace {

Result<void> check_writable(const Image<float>& image, const std::string& name) {
  if (!image.grid().valid() || (image.channels() != 1 && image.channels() != 3))
    return Error{ErrorCode::bad_argument,
                 fmt::format("{}: cannot write a picture of {} pixels and {} channels", name,
                             to_string(image.grid()), image.channels())};
  return check_finite(image, name);
}

/// RFC 1740: version 2 of AppleDouble begins with 00 05 16 07.
bool is_apple_double(std::span<const std::byte> bytes) {
  constexpr std::array kMagic{std::byte{0}, std::byte{5}, std::byte{0x16}, std::byte{7}};
  return bytes.size() >= kMagic.size() && std::ranges::equal(bytes.first(kMagic.size()), kMagic);
}

Result<Image<float>> decode_by_content(std::span<const std::byte> bytes, const std::string& name) {
  if (image::is_exr(bytes)) return image::decode_exr(bytes, name);
  if (image::is_png(bytes)) return image::decode_png(bytes, name);
  if (image::is_pfm(bytes)) return image::decode_pfm(bytes, name);
  if (is_apple_double(bytes))
    return image::damaged(name, "has attributes that macOS keeps beside a file (AppleDouble), no pixels");
  return image::damaged(name, bytes.empty() ? "is empty" : "is not a picture of a known format");
}

Image<std::uint16_t> to_16_bits(const Image<float>& image) {
  Image<std::uint16_t> codes(image.grid(), image.channels());
  std::ranges::transform(image.values(), codes.values().begin(), [](float v) {
    return static_cast<std::uint16_t>(std::lround(std::clamp(v, 0.0F, 1.0F) * 65'535.0F));
  });
  return codes;
}

Result<void> write_png_bytes(const std::filesystem::path& path, const image::Buffer& bytes) {
  if (bytes.empty()) return Error{ErrorCode::io, path.string() + ": PNG cannot be made"};
  return write_file_atomically(path, bytes);
}

std::vector<std::uint8_t> octets(const image::Buffer& bytes) {
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  return {data, data + bytes.size()};
}

}  // namespace

Result<Image<float>> decode_image(std::span<const std::byte> bytes, const std::string& name) {
  SYMRIG_TRY(auto image, decode_by_content(bytes, name));
  SYMRIG_CHECK(check_finite(image, name));
  return image;
}

Result<Image<float>> read_image(const std::filesystem::path& path) {
  SYMRIG_TRY(const auto bytes, read_file(path));
  return decode_image(bytes, path.string());
}

Result<PictureFacts> read_picture_facts(const std::filesystem::path& path) {
  SYMRIG_TRY(const auto bytes, read_file(path));
  if (image::is_exr(bytes)) return image::decode_exr_facts(bytes, path.string());
  return PictureFacts{};
}

Result<void> write_image(const std::filesystem::path& path, const Image<float>& image,
                         const PictureFacts& facts) {
  SYMRIG_CHECK(check_writable(image, path.string()));
  const std::string suffix = image::lower_suffix(path);
  if (suffix == ".png") return write_png_bytes(path, image::encode_png_codes(to_16_bits(image)));
  if (suffix == ".pfm") return write_file_atomically(path, image::encode_pfm(image));
  if (suffix == ".exr") {
    SYMRIG_TRY(const auto bytes, image::encode_exr(image, path.string(), facts));
    return write_file_atomically(path, bytes);
  }
  return Error{ErrorCode::bad_argument,
               fmt::format("{}: pictures are written as .exr, .pfm or .png, not '{}'", path.string(), suffix),
               "choose one of these suffixes"};
}

Result<void> write_display_png(const std::filesystem::path& path, const Image<float>& image,
                               double exposure) {
  SYMRIG_CHECK(check_writable(image, path.string()));
  if (!std::isfinite(exposure) || exposure <= 0)
    return Error{ErrorCode::bad_argument, fmt::format("exposure = {}; must be a positive number", exposure)};
  return write_png_bytes(path, image::encode_png_codes(to_display(image, exposure)));
}

std::vector<std::uint8_t> encode_png(const Image<std::uint8_t>& image) {
  if (!image.grid().valid() || (image.channels() != 1 && image.channels() != 3)) return {};
  return octets(image::encode_png_codes(image));
}

std::vector<std::uint8_t> encode_bit_png(const Image<std::uint8_t>& image) {
  if (!image.grid().valid() || image.channels() != 1) return {};
  return octets(image::encode_png_bits(image));
}

Result<void> check_finite(const Image<float>& image, const std::string& name) {
  return check_finite(image.values(), image.grid(), name);
}

Result<void> check_finite(std::span<const float> values, Grid grid, const std::string& name) {
  // Counting takes a vector of pixels at a time; searching does not.
  constexpr std::uint32_t kExponent = 0x7F800000;
  const auto is_bad = [](float v) { return (std::bit_cast<std::uint32_t>(v) & kExponent) == kExponent; };
  if (std::ranges::count_if(values, is_bad) == 0) return {};
  const auto bad = std::ranges::find_if(values, is_bad);
  const std::int64_t index = bad - values.begin();
  const std::int64_t pixel = index % grid.size();
  return Error{ErrorCode::bad_value,
               fmt::format("{}: pixel (row {}, column {}) of channel {} is {}", name, pixel / grid.cols,
                           pixel % grid.cols, index / grid.size(), std::isnan(*bad) ? "NaN" : "infinite"),
               "replace such pixels before you use the picture as light"};
}

}  // namespace symrig
