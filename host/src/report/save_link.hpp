// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Buttons that save data of the page. They are plain links that contain the bytes: no script.
namespace symrig::report {

/// A file name from a text: letters, digits, '-', '_' and '.' stay, other characters become one '-'. "symrig"
/// if nothing is left.
std::string file_stem(std::string_view text);

/// label: on the button. what: for screen readers.
std::string save_link(std::string_view file, std::string_view label, std::string_view what,
                      std::string_view media_type, std::span<const std::uint8_t> bytes);

/// A link to an OpenEXR file of values; empty if they are more than kMostSavedValues, or not all finite.
std::string exr_link(std::string_view file, std::string_view what, const Image<float>& values);
inline constexpr std::size_t kMostSavedValues = 250'000;

/// Comma-separated values [RFC 4180]: quoted where needed, CRLF. Text that a spreadsheet would read as a
/// formula gets an apostrophe.
class Csv {
 public:
  explicit Csv(const std::vector<std::string>& head) { add(head); }
  void add(const std::vector<std::string>& row);
  const std::string& text() const { return text_; }
  std::string link(std::string_view file, std::string_view what) const;

 private:
  std::string text_;
};
/// The shortest text that is read back as the same number.
std::string exact(double number);

/// A row of buttons.
std::string save_row(std::string_view links_html);

}  // namespace symrig::report
