// SPDX-License-Identifier: Apache-2.0
// Portable float map: "PF" or "Pf", width height, scale (its sign gives the byte order), rows from the bottom
// up.
#include "symrig/image/internal/codec.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace symrig::image {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

/// The next word of a text header. It leaves the white space after the word.
std::string_view next_word(std::string_view& text) {
  const std::size_t begin = std::min(text.find_first_not_of(kSpace), text.size());
  const std::size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

template <class Number>
std::optional<Number> number(std::string_view word) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return {};
  return value;
}

struct PfmHeader {
  int channels = 0;
  Grid grid;
  bool little_endian = true;
  std::size_t bytes = 0;  ///< up to the scale, without the white space that ends it

  std::size_t pixel_bytes() const {
    return static_cast<std::size_t>(grid.size()) * static_cast<std::size_t>(channels) * sizeof(float);
  }
};

/// Whether this ends a header: one white-space byte, or an LF or CR LF after any blanks.
bool ends_a_header(std::string_view text) {
  if (text.size() == 1) return kSpace.find(text[0]) != std::string_view::npos;
  if (!text.ends_with('\n')) return false;
  text.remove_suffix(text.ends_with("\r\n") ? 2 : 1);
  return text.find_first_not_of(" \t") == std::string_view::npos;
}

/// Where the pixels begin. The first byte of a pixel can be 10, as LF is. So the size of the file decides
/// which white space belongs to the header.
Result<std::size_t> pixels_begin(Bytes bytes, const PfmHeader& header, const std::string& name) {
  const std::size_t wanted = header.pixel_bytes();
  if (bytes.size() < header.bytes + 1 + wanted) return damaged(name, "PFM ends before its last pixel");
  const std::size_t begin = bytes.size() - wanted;
  const std::size_t gap = begin - header.bytes;
  if (ends_a_header({reinterpret_cast<const char*>(bytes.data()) + header.bytes, gap})) return begin;
  return damaged(
      name, fmt::format("PFM has {} bytes after the scale in its header; a line end and {} bytes of pixels "
                        "belong there (a copy as text adds bytes to line ends)",
                        bytes.size() - header.bytes, wanted));
}

Result<PfmHeader> read_header(Bytes bytes, const std::string& name) {
  const std::string_view whole(reinterpret_cast<const char*>(bytes.data()),
                               std::min<std::size_t>(bytes.size(), 256));
  std::string_view text = whole;
  const bool colour = next_word(text) == "PF";
  const auto cols = number<std::int64_t>(next_word(text));
  const auto rows = number<std::int64_t>(next_word(text));
  const auto scale = number<double>(next_word(text));
  if (!cols || !rows || !scale || *scale == 0 || !std::isfinite(*scale))
    return damaged(name, "PFM header cannot be read");
  SYMRIG_TRY(const Grid grid, checked_grid(*rows, *cols, name));
  return PfmHeader{colour ? 3 : 1, grid, *scale < 0, whole.size() - text.size()};
}

float load(const std::byte* at, bool little_endian) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, at, sizeof bits);
  if (little_endian != (std::endian::native == std::endian::little)) bits = __builtin_bswap32(bits);
  return std::bit_cast<float>(bits);
}

}  // namespace

bool is_pfm(Bytes bytes) {
  if (bytes.size() < 4) return false;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), 3);
  return (text.starts_with("PF") || text.starts_with("Pf")) && kSpace.find(text[2]) != std::string_view::npos;
}

Result<Image<float>> decode_pfm(Bytes bytes, const std::string& name) {
  SYMRIG_TRY(const PfmHeader header, read_header(bytes, name));
  SYMRIG_TRY(const std::size_t begin, pixels_begin(bytes, header, name));
  Image<float> image(header.grid, header.channels);
  const std::byte* at = bytes.data() + begin;
  for (int row = header.grid.rows - 1; row >= 0; --row)
    for (int col = 0; col < header.grid.cols; ++col)
      for (int c = 0; c < header.channels; ++c, at += sizeof(float))
        image.at(row, col, c) = load(at, header.little_endian);
  return image;
}

Buffer encode_pfm(const Image<float>& image) {
  const Grid grid = image.grid();
  constexpr bool kLittle = std::endian::native == std::endian::little;
  const std::string header = std::string(image.channels() == 3 ? "PF\n" : "Pf\n") +
                             std::to_string(grid.cols) + " " + std::to_string(grid.rows) +
                             (kLittle ? "\n-1.0\n" : "\n1.0\n");
  Buffer bytes(header.size() + image.values().size_bytes());
  std::memcpy(bytes.data(), header.data(), header.size());
  std::byte* at = bytes.data() + header.size();
  for (int row = grid.rows - 1; row >= 0; --row)
    for (int col = 0; col < grid.cols; ++col)
      for (int c = 0; c < image.channels(); ++c, at += sizeof(float))
        std::memcpy(at, &image.at(row, col, c), sizeof(float));
  return bytes;
}

}  // namespace symrig::image
