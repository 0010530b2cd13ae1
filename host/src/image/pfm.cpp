// SPDX-License-Identifier: Apache-2.0
// Portable float map: "PF" or "Pf", width height, scale (its sign gives the byte order), rows from the bottom
// up.
#include "image/codec.hpp"

#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

namespace symrig::image {
namespace {

/// The next word of a text header. It also consumes the single white-space byte after the word.
std::string_view next_word(std::string_view& text) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t begin = std::min(text.find_first_not_of(kSpace), text.size());
  const std::size_t end = std::min(text.find_first_of(kSpace, begin), text.size());
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(std::min(end + 1, text.size()));
  return word;
}

template <class Number>
std::optional<Number> number(std::string_view word) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size()) return {};
  return value;
}

struct Header {
  int channels = 0;
  Grid grid;
  bool little_endian = true;
  std::size_t bytes = 0;  ///< length of the header
};

Result<Header> read_header(Bytes bytes, const std::string& name) {
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
  return Header{colour ? 3 : 1, grid, *scale < 0, whole.size() - text.size()};
}

float load(const std::byte* at, bool little_endian) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, at, sizeof bits);
  if (little_endian != (std::endian::native == std::endian::little)) bits = __builtin_bswap32(bits);
  return std::bit_cast<float>(bits);
}

}  // namespace

bool is_pfm(Bytes bytes) {
  return bytes.size() > 3 && bytes[0] == std::byte{'P'} &&
         (bytes[1] == std::byte{'F'} || bytes[1] == std::byte{'f'}) &&
         (bytes[2] == std::byte{'\n'} || bytes[2] == std::byte{'\r'} || bytes[2] == std::byte{' '});
}

Result<Image<float>> decode_pfm(Bytes bytes, const std::string& name) {
  SYMRIG_TRY(const Header header, read_header(bytes, name));
  const std::size_t channels = header.channels;
  const std::size_t wanted = static_cast<std::size_t>(header.grid.size()) * channels * sizeof(float);
  if (bytes.size() - header.bytes < wanted) return damaged(name, "PFM ends before its last pixel");
  Image<float> image(header.grid, header.channels);
  const std::byte* at = bytes.data() + header.bytes;
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
