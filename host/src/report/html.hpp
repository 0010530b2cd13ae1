// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "report/picture.hpp"
#include "symrig/image/image.hpp"
#include "symrig/report/text.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Pieces of the page. Every text argument is escaped. Arguments named html are inserted unchanged.

namespace symrig::report {

using text::byte_size, text::duration, text::grouped, text::percent, text::short_number;

std::string escape(std::string_view text);
/// Escaped text with possible line breaks after the punctuation of paths, addresses and commands.
std::string breakable(std::string_view text);

/// A number with its unrounded value and its source, so that scripts and tests can find both. from:
/// "capture:", "inspect:" or "evaluate:" and a JSON pointer into that command's --json output.
std::string number(double value, std::string_view from, std::string_view text);

/// The texts and links around a picture.
struct Framing {
  std::string alt, caption_html;
  std::string scale_html = {};
  std::string file = {};                 ///< name of the saved files, without suffix; empty: no buttons
  const Image<float>* values = nullptr;  ///< values of its OpenEXR file; nullptr: no such file
};

/// A picture with its caption. The page's style enlarges small pictures with sharp pixels.
std::string figure(const Picture& picture, const Framing& framing);
std::string figure(const Picture& picture, std::string_view alt, std::string_view caption_html,
                   std::string_view scale_html = {});
/// Figures side by side, as many in a row as fit; each at least `least` CSS pixels wide.
std::string row_of(const std::vector<std::string>& figures, int least);
/// The colours of false_colour, with a label at the dark and at the bright end.
std::string colour_scale(std::string_view dark, std::string_view bright);
/// Greys of levels 0..deepest with their numbers.
std::string level_scale(int deepest);

std::string section(std::string_view id, std::string_view heading, std::string_view body_html);
std::string paragraph(std::string_view html);
/// One number with its meaning, for a row of tiles.
std::string tile(std::string_view number_html, std::string_view meaning);
std::string tiles(std::string_view tiles_html);
/// Two columns: names and values (html).
std::string facts_table(const std::vector<std::pair<std::string, std::string>>& rows);
/// The content of the last column of a table.
enum class Last : std::uint8_t { number, words };
/// A table with a head. The first column is the row's name, the others are numbers. name: for screen readers.
std::string number_table(const std::vector<std::string>& head,
                         const std::vector<std::vector<std::string>>& rows);
std::string number_table_html(std::string_view name, const std::vector<std::string>& head,
                              const std::vector<std::vector<std::string>>& rows_html,
                              Last last = Last::number);

/// Links to sections: id and name of each.
std::string navigation(const std::vector<std::pair<std::string, std::string>>& sections);

/// The whole page around its sections.
std::string page(std::string_view title, std::string_view body_html);

}  // namespace symrig::report

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
