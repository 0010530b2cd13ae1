// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scanout/scanout.hpp"

#include <algorithm>
#include <charconv>
#include <string_view>

namespace symrig::bench_vm {

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
