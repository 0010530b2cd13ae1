// SPDX-License-Identifier: Apache-2.0
#include "terminal_line.hpp"

#include <algorithm>

#include <sys/ioctl.h>

namespace symrig::apps {
namespace {

/// One character of UTF-8 and the columns that it takes on the screen. Characters from Hangul on may be two
/// columns wide.
struct Letter {
  std::size_t bytes = 1, columns = 1;
};

Letter letter_at(std::string_view text, std::size_t at) {
  const auto first = static_cast<unsigned char>(text[at]);
  std::size_t bytes = 1;
  if (first >= 0xC0) bytes = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  const std::size_t columns = first >= 0xE2 ? 2 : 1;
  return {std::min(bytes, text.size() - at), columns};
}

}  // namespace

std::size_t columns_of(std::string_view text) {
  std::size_t columns = 0;
  for (std::size_t at = 0; at < text.size();) {
    const Letter letter = letter_at(text, at);
    columns += letter.columns;
    at += letter.bytes;
  }
  return columns;
}

std::string cut_to(std::string_view text, std::size_t columns) {
  std::size_t at = 0;
  while (at < text.size()) {
    const Letter letter = letter_at(text, at);
    if (letter.columns > columns) break;
    columns -= letter.columns;
    at += letter.bytes;
  }
  return std::string(text.substr(0, at));
}

std::string fitting(std::span<const std::string> forms, std::size_t columns) {
  for (const std::string& form : forms)
    if (columns_of(form) <= columns) return form;
  return forms.empty() ? std::string() : cut_to(forms.back(), columns);
}

std::size_t terminal_columns(int descriptor) {
  constexpr std::size_t kUsual = 80;
  winsize size{};
  return ioctl(descriptor, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kUsual;
}

}  // namespace symrig::apps
