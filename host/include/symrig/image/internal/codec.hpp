// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/file.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

/// One pair of functions for each format, all in memory. Decoders check the header's size before they
/// allocate; read_image tests for NaN. Encoders get 1 or 3 channels of finite values.
namespace symrig::image {

using Bytes = std::span<const std::byte>;
using Buffer = std::vector<std::byte>;

bool is_exr(Bytes bytes);
bool is_png(Bytes bytes);
bool is_pfm(Bytes bytes);

Result<Image<float>> decode_exr(Bytes bytes, const std::string& name);
Result<Image<float>> decode_png(Bytes bytes, const std::string& name);
Result<Image<float>> decode_pfm(Bytes bytes, const std::string& name);

/// facts: for the header.
Result<Buffer> encode_exr(const Image<float>& image, const std::string& name, const PictureFacts& facts = {});
Result<PictureFacts> decode_exr_facts(Bytes bytes, const std::string& name);
Buffer encode_pfm(const Image<float>& image);

/// Rows of interleaved 8- or 16-bit codes (16 bits in the machine's byte order) → PNG. Empty if libpng fails.
template <class Code>
Buffer encode_png_codes(const Image<Code>& image);
/// One bit for each pixel: code 0 is black, any other code white. One channel. Empty if libpng fails.
Buffer encode_png_bits(const Image<std::uint8_t>& image);

/// ".exr" of "A.EXR".
std::string lower_suffix(const std::filesystem::path& path);

/// The error bad_format with the file's name.
Error damaged(const std::string& name, const std::string& what);
/// Refuses a header with more than kMaxPicturePixels, or with no pixels.
Result<Grid> checked_grid(std::int64_t rows, std::int64_t cols, const std::string& name);

}  // namespace symrig::image
